#include "daemon/orders/strip_zones.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>
#include <vector>

#include "daemon/orders/panel_wood.h"

namespace veneer::daemon {
namespace {

// A sheet of 80 x 60 mm or other whole millimetres at ten pixels each, on which strips are drawn.
class Strips {
 public:
  explicit Strips(int width = 80, int height = 60)
      : mask_{raster(width, height), raster(width, height), {}, {}, {}, {}}, height_(height) {}
  // From the lower left corner, mm.
  Strips& box(int label, double x, double y, double width, double height) {
    cv::rectangle(mask_.zones.pixels, at(x, y, width, height), cv::Scalar(label), cv::FILLED);
    return *this;
  }
  Strips& disc(int label, double x, double y, double radius) {
    cv::circle(mask_.zones.pixels, {px(x), px(height_ - y)}, px(radius), cv::Scalar(label), cv::FILLED);
    return *this;
  }
  calib::VeneerMask mask(int strips) const {
    calib::VeneerMask out = mask_;
    out.usable.pixels = out.zones.pixels > 0;
    for (int label = 1; label <= strips; ++label) out.list.emplace_back().label = label;
    return out;
  }
  // Of the wood of a strip, what its zone alone offers.
  static double offered(const calib::VeneerMask& mask, const std::vector<db::ZoneRecord>& zones, std::size_t strip) {
    std::vector<Region<PanelFrame>> others;
    for (std::size_t i = 0; i < zones.size(); ++i)
      if (i != strip) others.push_back(zones[i].shape);
    const Raster<PanelFrame> wood{mask.zones.pixels == static_cast<int>(strip) + 1, mask.zones.resolution, {}};
    return wood_area(wood_within(wood, {zones[strip].shape}, others)).count() / wood_area(wood).count();
  }

 private:
  static Raster<PanelFrame> raster(int width, int height) {
    return {cv::Mat::zeros(10 * height, 10 * width, CV_8UC1), {10.0}, {}};
  }
  static int px(double mm) { return cvRound(mm * 10); }
  cv::Rect at(double x, double y, double width, double height) const {
    return {px(x), px(height_ - y - height), px(width), px(height)};
  }
  calib::VeneerMask mask_;
  int height_;
};

double shared(const db::ZoneRecord& a, const db::ZoneRecord& b) { return intersect(a.shape, b.shape).area().count(); }

bool holds(const db::ZoneRecord& zone, double x, double y) { return zone.shape.contains(point<PanelFrame>(x, y)); }

TEST(ZonesOfStrips, AnLAndTheStripInItsCornerKeepAllTheirWoodApart) {
  const auto mask = Strips().box(1, 5, 5, 12, 50).box(1, 5, 5, 60, 10).box(2, 18, 16, 47, 39).mask(2);
  const auto zones = zones_of(mask);
  ASSERT_EQ(zones.size(), 2U);
  EXPECT_EQ(zones[0].number, 1);
  EXPECT_EQ(zones[1].number, 2);
  EXPECT_NEAR(zones[0].shape.area().count(), 12 * 50 + 48 * 10, 40) << "the L alone";
  EXPECT_FALSE(holds(zones[0], 40, 30)) << "the other strip lies there";
  EXPECT_DOUBLE_EQ(shared(zones[0], zones[1]), 0);
  EXPECT_GT(Strips::offered(mask, zones, 0), 0.999);
  EXPECT_GT(Strips::offered(mask, zones, 1), 0.999);
}

TEST(ZonesOfStrips, ARingRoundAnotherStripIsNotThatStrip) {
  const auto mask = Strips().box(1, 5, 5, 70, 50).box(0, 20, 15, 40, 30).box(2, 21, 16, 38, 28).mask(2);
  const auto zones = zones_of(mask);
  ASSERT_EQ(zones.size(), 2U);
  EXPECT_FALSE(holds(zones[0], 40, 30));
  EXPECT_TRUE(holds(zones[1], 40, 30));
  EXPECT_NEAR(zones[0].shape.area().count(), 70 * 50 - 40 * 30, 70);
  EXPECT_DOUBLE_EQ(shared(zones[0], zones[1]), 0);
  EXPECT_GT(Strips::offered(mask, zones, 0), 0.999);
  EXPECT_GT(Strips::offered(mask, zones, 1), 0.999);
}

TEST(ZonesOfStrips, ScrewsKnotsAndCracksAreOfTheStripTheyLieIn) {
  const auto mask = Strips().box(1, 5, 5, 70, 50).disc(0, 20, 30, 4).box(0, 40, 5, 2, 50).mask(1);
  const auto zones = zones_of(mask);
  ASSERT_EQ(zones.size(), 1U);
  EXPECT_TRUE(holds(zones[0], 20, 30)) << "a knot";
  EXPECT_TRUE(holds(zones[0], 41, 30)) << "a crack from side to side";
  EXPECT_EQ(zones[0].shape.micro_area().rings.size(), 1U);
}

TEST(ZonesOfStrips, PartsOfAStripThatLieApartAreOneZone) {
  const auto mask = Strips().box(1, 5, 5, 20, 50).box(1, 55, 5, 20, 50).box(2, 28, 5, 24, 50).mask(2);
  const auto zones = zones_of(mask);
  ASSERT_EQ(zones.size(), 2U);
  EXPECT_TRUE(holds(zones[0], 10, 30));
  EXPECT_TRUE(holds(zones[0], 70, 30));
  EXPECT_FALSE(holds(zones[0], 40, 30)) << "the strip between them";
  EXPECT_GT(Strips::offered(mask, zones, 0), 0.999);
}

TEST(ZonesOfStrips, StripsThatTouchEndWhereTheOtherBegins) {
  const auto mask = Strips().box(1, 0, 0, 40, 60).box(2, 40, 0, 40, 60).mask(2);
  const auto zones = zones_of(mask);
  ASSERT_EQ(zones.size(), 2U);
  EXPECT_DOUBLE_EQ(shared(zones[0], zones[1]), 0);
  EXPECT_LE(zones[0].shape.area() + zones[1].shape.area(), SquareMillimetres(80 * 60)) << "nothing beside the sheet";
  EXPECT_GT(Strips::offered(mask, zones, 0), 0.99);
  EXPECT_GT(Strips::offered(mask, zones, 1), 0.99);
}

// As wide as a hair, and closed: what it surrounds is no hole.
TEST(ZonesOfStrips, WoodInALoopIsOfTheStripAroundIt) {
  for (const double thick : {0.1, 0.2, 1.0}) {
    const auto mask =
        Strips().box(1, 5, 5, 70, 50).disc(0, 40, 30, 3).disc(1, 40, 30, 3 - thick).box(1, 10, 10, 2, 2).mask(1);
    const auto zones = zones_of(mask);
    ASSERT_EQ(zones.size(), 1U);
    EXPECT_TRUE(holds(zones[0], 40, 30)) << thick;
    EXPECT_EQ(zones[0].shape.micro_area().rings.size(), 1U) << thick;
    EXPECT_GT(Strips::offered(mask, zones, 0), 0.999) << thick;
  }
}

// A comb of `teeth` 95 mm high that are knotted all over, 1.2 mm apart: more corners than a zone may have.
void draw_comb(Strips& strips, int label, double left, int teeth) {
  strips.box(label, left, 2, 3.6 * teeth - 1.2, 3);
  for (int tooth = 0; tooth < teeth; ++tooth) {
    const double x = left + 3.6 * tooth;
    strips.box(label, x, 2, 1.2, 95);
    for (int knot = 0; knot < 38; ++knot) strips.box(label, x, 6 + 2.4 * knot, 2.4, 1.2);
  }
}

TEST(ZonesOfStrips, ARaggedStripIsToldWithBoundedCorners) {
  Strips strips(200, 100);
  draw_comb(strips, 1, 3, 45);
  const auto mask = strips.mask(1);
  const auto zones = zones_of(mask);
  ASSERT_EQ(zones.size(), 1U);
  EXPECT_LE(micro::corners_of(zones[0].shape.micro_area()), kMostZoneCorners);
  EXPECT_GT(Strips::offered(mask, zones, 0), 0.999);
}

TEST(ZonesOfStrips, ARaggedStripTakesNoWoodFromAStraightOneBesideIt) {
  for (const bool ragged_first : {true, false}) {
    Strips strips(200, 100);
    draw_comb(strips, ragged_first ? 1 : 2, 3, 45);
    strips.box(ragged_first ? 2 : 1, 3 + 3.6 * 45 - 0.7, 2, 20, 95);  // half a millimetre away
    const auto mask = strips.mask(2);
    const auto zones = zones_of(mask);
    ASSERT_EQ(zones.size(), 2U);
    EXPECT_EQ(zones[0].number, 1);
    EXPECT_DOUBLE_EQ(shared(zones[0], zones[1]), 0);
    // But for the pixels that the border between them crosses.
    EXPECT_GT(Strips::offered(mask, zones, 0), 0.99) << ragged_first;
    EXPECT_GT(Strips::offered(mask, zones, 1), 0.99) << ragged_first;
  }
}

}  // namespace
}  // namespace veneer::daemon
