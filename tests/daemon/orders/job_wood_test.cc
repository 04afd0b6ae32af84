// Zones of several woods, as a plan is offered them.
#include "daemon/orders/job_wood.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

namespace veneer::daemon {
namespace {

Raster<PanelFrame> raster(int type) { return {cv::Mat(100, 100, type, cv::Scalar::all(255)), {1.0}, {}}; }

Region<PanelFrame> block(double left, double lower, double right, double upper) {
  return Region<PanelFrame>(Ring<PanelFrame>{point<PanelFrame>(left, lower), point<PanelFrame>(right, lower),
                                             point<PanelFrame>(right, upper), point<PanelFrame>(left, upper)});
}

// What a panel of 100 x 100 mm offers of its oak, which is `oak`; of maple it has a corner.
std::vector<planner::WoodZone> offered_of(const Region<PanelFrame>& oak) {
  JobWood wood;
  HeldPanel& panel = wood.panels.emplace_back();
  panel.id = PanelId{"P-0001"};
  panel.zones = {{1, oak, "oak"}, {2, block(90, 90, 100, 100), "maple"}};
  const auto stock =
      load_job_wood(wood, SquareMillimetres(100),
                    {[](const HeldPanel&) -> Result<Raster<PanelFrame>> { return raster(CV_8UC3); },
                     [](const HeldPanel&, Millimetres) -> Result<Raster<PanelFrame>> { return raster(CV_8UC1); }});
  std::vector<planner::WoodZone> out;
  EXPECT_TRUE(stock.ok());
  if (!stock) return out;
  for (const auto& zone : stock->front().zones)
    if (zone.material == "oak") out.push_back(zone);
  return out;
}

double area_of(const std::vector<planner::WoodZone>& zones) {
  double sum = 0;
  for (const auto& zone : zones) {
    EXPECT_GT(signed_area(zone.outline), 0) << "an outline, no hole";
    sum += signed_area(zone.outline);
  }
  return sum;
}

Region<PanelFrame> united(const std::vector<planner::WoodZone>& zones) {
  std::vector<Region<PanelFrame>> all;
  for (const auto& zone : zones) all.emplace_back(zone.outline);
  return unite(all);
}

TEST(JobWoodZones, AreOfferedRoundTheirHoles) {
  const auto oak =
      subtract(subtract(block(0, 0, 80, 80), block(10, 10, 30, 25)), block(40, 15, 50, 70));  // one wide, one high
  const auto zones = offered_of(oak);
  EXPECT_NEAR(area_of(zones), oak.area().count(), 1e-3) << "each part once";
  EXPECT_NEAR(subtract(united(zones), oak).area().count(), 0, 1e-3) << "nothing of the holes";
}

TEST(JobWoodZones, AnIslandInAHoleIsOffered) {
  const auto oak = unite(subtract(block(0, 0, 80, 80), block(20, 20, 60, 60)), block(30, 30, 50, 50));
  const auto zones = offered_of(oak);
  EXPECT_NEAR(area_of(zones), 80 * 80 - 40 * 40 + 20 * 20, 1e-3);
  EXPECT_TRUE(united(zones).contains(point<PanelFrame>(40, 40)));
  EXPECT_FALSE(united(zones).contains(point<PanelFrame>(25, 40)));
}

// Rounding leaves holes that are a micrometre wide, which no cut through their middle parts.
TEST(JobWoodZones, HolesThatAreMadeByRoundingAreFilled) {
  for (const double tip : {50.001, 50.002, 49.999}) {
    const Region<PanelFrame> sliver(
        Ring<PanelFrame>{point<PanelFrame>(50, 20), point<PanelFrame>(tip, 30), point<PanelFrame>(50, 40)});
    ASSERT_FALSE(sliver.empty());
    const auto oak = subtract(block(0, 0, 80, 80), sliver);
    ASSERT_EQ(oak.rings().size(), 2U) << "a hole";
    const auto zones = offered_of(oak);
    ASSERT_EQ(zones.size(), 1U) << tip;
    EXPECT_NEAR(area_of(zones), 80 * 80, 1e-6);
  }
}

}  // namespace
}  // namespace veneer::daemon
