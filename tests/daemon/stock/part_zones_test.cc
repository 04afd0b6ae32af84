// Zones of a part, as its parent knows them.
#include "daemon/stock/part_zones.h"

#include <gmock/gmock.h>

#include "base/polygon_ops.h"

namespace veneer::daemon {
namespace {

Ring<PanelFrame> strip(double left, double right, double lower = 0, double upper = 100) {
  return {point<PanelFrame>(left, lower), point<PanelFrame>(right, lower), point<PanelFrame>(right, upper),
          point<PanelFrame>(left, upper)};
}
Box<PanelFrame> sheet(double width) {
  Box<PanelFrame> box;
  box.add(point<PanelFrame>(0, 0)), box.add(point<PanelFrame>(width, 100));
  return box;
}
const std::vector<db::ZoneRecord> kParent = {{1, Region<PanelFrame>(strip(0, 30)), "maple"},
                                             {2, Region<PanelFrame>(strip(31, 60)), "walnut"},
                                             {3, Region<PanelFrame>(strip(61, 90)), ""}};

// A mosaic was cut from the strips: the eye sees what is left between the pieces as strips of their own.
TEST(PartZones, AStripThatPiecesWereCutFromStaysOneZone) {
  std::vector<db::ZoneRecord> seen;
  for (int i = 0; i < 12; ++i) seen.push_back({i + 1, Region<PanelFrame>(strip(2, 28, 8 * i, 8 * i + 5)), ""});
  for (int i = 0; i < 12; ++i) seen.push_back({13 + i, Region<PanelFrame>(strip(33, 50, 8 * i, 8 * i + 5)), ""});
  const auto zones = zones_of_part(seen, kParent, {}, sheet(50));
  ASSERT_EQ(zones.size(), 2U);
  EXPECT_EQ(zones[0].number, 1);
  EXPECT_EQ(zones[0].material, "maple");
  EXPECT_NEAR(zones[0].shape.area().count(), 3000, 1e-6);
  EXPECT_EQ(zones[1].number, 2);
  EXPECT_EQ(zones[1].material, "walnut");
  EXPECT_NEAR(zones[1].shape.area().count(), 1900, 1e-6) << "as far as it lies on the part";
}

TEST(PartZones, LieWhereThePartLayInItsParent) {
  const Isometry2<PanelFrame, PanelFrame> part_from_parent(Radians(0), point<PanelFrame>(-45, 0));
  const auto zones =
      zones_of_part({{1, Region<PanelFrame>(strip(1, 14)), ""}, {2, Region<PanelFrame>(strip(17, 44)), ""}}, kParent,
                    part_from_parent, sheet(45));
  ASSERT_EQ(zones.size(), 2U);
  EXPECT_EQ(zones[0].number, 2);
  EXPECT_NEAR(zones[0].shape.area().count(), 1500, 1e-6);
  EXPECT_EQ(zones[1].number, 3);
  EXPECT_EQ(zones[1].material, "");
}

TEST(PartZones, WoodThatTheParentKnewNothingOfIsAZoneOfItsOwn) {
  const auto zones = zones_of_part(
      {{1, Region<PanelFrame>(strip(2, 28)), ""}, {2, Region<PanelFrame>(strip(92, 99)), ""}}, kParent, {}, sheet(100));
  ASSERT_EQ(zones.size(), 2U) << "nothing is seen of two of the parent's";
  EXPECT_EQ(zones[1].number, 4);
  EXPECT_NEAR(zones[1].shape.area().count(), 700, 1e-6);
  EXPECT_EQ(zones_of_part({{1, Region<PanelFrame>(strip(2, 28)), ""}}, {}, {}, sheet(100)).size(), 1U)
      << "a parent without zones";
}

TEST(PartZones, AreAsSureAsTheParentWasOfThemOrAsWhatIsSeenNow) {
  std::vector<db::ZoneRecord> parent = kParent;
  parent[0].confidence = 0.75;
  const auto zones = zones_of_part({{1, Region<PanelFrame>(strip(2, 28)), "", 0.5},
                                    {2, Region<PanelFrame>(strip(33, 58)), "", 0.5},
                                    {3, Region<PanelFrame>(strip(92, 99)), "", 0.625}},
                                   parent, {}, sheet(100));
  ASSERT_EQ(zones.size(), 3U);
  EXPECT_EQ(zones[0].confidence, 0.75);
  EXPECT_EQ(zones[1].confidence, std::nullopt) << "nobody knows of the parent's";
  EXPECT_EQ(zones[2].confidence, 0.625);
}

}  // namespace
}  // namespace veneer::daemon
