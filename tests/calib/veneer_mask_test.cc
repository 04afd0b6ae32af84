#include "calib/veneer_mask.h"

#include <gmock/gmock.h>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "calib/registration.h"
#include "tests/support/rendered_panel.h"

namespace veneer {
namespace {

using calib::PanelFiducials;
using calib::VeneerMask;

PanelFiducials fiducials_of(const rendered::Panel& panel) {
  PanelFiducials out;
  for (const auto& tag : panel.tags) out.tags.push_back({tag.id, tag.face, tag.corners()});
  for (const auto& hole : panel.holes)
    out.holes.push_back({point<PanelFrame>(hole.x, hole.y), Millimetres(hole.diameter)});
  return out;
}

// The map a perfect stitcher would make.
Raster<PanelFrame> map_of(const rendered::Panel& panel, double dpi, const rendered::Optics& optics = {}) {
  rendered::Scanner scanner;
  scanner.dpi = dpi, scanner.width_mm = panel.width, scanner.height_mm = panel.height, scanner.optics = optics;
  Raster<PanelFrame> map;
  map.resolution = scanner.nominal();
  map.pixels = scan_panel(panel, Face::kShow, rendered::lay(0, panel.height, 0, 0, 0, Face::kShow), scanner);
  map.origin = point<PanelFrame>(0, panel.height - map.height().count());
  return map;
}

struct Quality {
  double lost_fraction = 0;  // of the wood that lies 1 mm inside, what the mask misses
  int outside = 0;           // mask pixels that are not wood
};
Quality judge(const rendered::Panel& panel, const VeneerMask& mask) {
  Quality q;
  double wood = 0, lost = 0;
  const auto& usable = mask.usable;
  for (int r = 0; r < usable.pixels.rows; ++r)
    for (int c = 0; c < usable.pixels.cols; ++c) {
      const Point<PanelFrame> p = usable.from_pixels(c + 0.5, r + 0.5);
      const double x = p.x.count(), y = p.y.count();
      const bool marked = usable.pixels.at<std::uint8_t>(r, c) != 0;
      if (marked && !panel.is_wood(x, y)) ++q.outside;
      bool deep = r % 3 == 0 && c % 3 == 0 && panel.is_wood(x, y);
      for (int k = 0; deep && k < 8; ++k)
        deep = panel.is_wood(x + 1.2 * std::cos(k * 0.785), y + 1.2 * std::sin(k * 0.785));
      if (!deep) continue;
      wood += 1, lost += marked ? 0 : 1;
    }
  q.lost_fraction = lost / wood;
  return q;
}

rendered::Panel six_species() {
  rendered::Panel panel = rendered::sample_panel(184, 104, 6);
  panel.strips.back().x1 = 160;
  return panel;
}

TEST(VeneerMask, KeepsAllWoodAndNothingElseFromLightToVeryDark) {
  rendered::Panel panel = six_species();
  panel.strips.back().colour = {18, 23, 30};  // almost black, and barely warm
  const auto mask = calib::mask_veneer(map_of(panel, 300), fiducials_of(panel));
  ASSERT_TRUE(mask.ok()) << mask.error().message;
  const Quality quality = judge(panel, *mask);
  EXPECT_EQ(quality.outside, 0);
  EXPECT_LT(quality.lost_fraction, 0.01);
  EXPECT_EQ(mask->list.size(), panel.strips.size());
  for (std::size_t i = 1; i < mask->list.size(); ++i) EXPECT_LT(mask->list[i - 1].box.max.x, mask->list[i].box.min.x);
  for (const auto& zone : mask->list)
    EXPECT_GT(cv::countNonZero(mask->zones.pixels == zone.label), 1000)
        << "each has its label on its wood: " << zone.label;
}

// What is printed in black and white, with straight sides, and was not read for its dirt.
TEST(VeneerMask, AsksAboutATagThatNobodyCouldReadAndDoesNotTakeItForWood) {
  const rendered::Panel panel = six_species();
  auto scorched = map_of(panel, 150);
  PanelFiducials read = fiducials_of(panel);
  const auto tag = panel.tags.front();
  std::erase_if(read.tags, [&](const auto& other) { return other.id == tag.id; });
  cv::Point2d corner;
  scorched.to_pixels(tag.corners()[0], corner.x, corner.y);
  cv::circle(scorched.pixels, corner, static_cast<int>(2 * scorched.resolution.px_per_mm), cv::Scalar(20, 26, 34),
             cv::FILLED, cv::LINE_AA);
  const auto mask = calib::mask_veneer(scorched, read);
  ASSERT_TRUE(mask.ok()) << mask.error().message;
  EXPECT_EQ(judge(panel, *mask).outside, 0);
  EXPECT_EQ(mask->list.size(), panel.strips.size());
  ASSERT_EQ(mask->asked.size(), 1U);
  EXPECT_FALSE(mask->asked[0].taken);
  EXPECT_THAT(mask->asked[0].reason, ::testing::HasSubstr("no larger than a tag"));
}

TEST(VeneerMask, FindsEveryScrewHole) {
  const rendered::Panel panel = six_species();
  const auto mask = calib::mask_veneer(map_of(panel, 150), fiducials_of(panel));
  ASSERT_TRUE(mask.ok());
  EXPECT_EQ(mask->screws.size(), panel.screws.size());
  for (const auto& screw : panel.screws) {
    double nearest = 1e9;
    for (const auto& found : mask->screws)
      nearest = std::min(nearest, distance(found.centre, point<PanelFrame>(screw.x, screw.y)).count());
    EXPECT_LT(nearest, 0.2);
  }
}

// The nearest that any usable wood comes to a place.
double nearest_wood(const VeneerMask& mask, double x, double y) {
  double nearest = 1e9;
  for (int r = 0; r < mask.usable.pixels.rows; ++r)
    for (int c = 0; c < mask.usable.pixels.cols; ++c)
      if (mask.usable.pixels.at<std::uint8_t>(r, c) != 0)
        nearest =
            std::min(nearest, distance(mask.usable.from_pixels(c + 0.5, r + 0.5), point<PanelFrame>(x, y)).count());
  return nearest;
}

TEST(VeneerMask, KeepsTheMarginsThatItIsTold) {
  const rendered::Panel panel = six_species();
  const auto map = map_of(panel, 150);
  const auto masked = [&](double edge, double round) {
    calib::MaskOptions options;
    options.edge_margin = Millimetres(edge), options.screw_margin = Millimetres(round);
    return calib::mask_veneer(map, fiducials_of(panel), options);
  };
  const rendered::RoundHole& screw = panel.screws.front();
  const rendered::Strip& strip = panel.strips.front();
  // Wider than a screw's radius and its own margin.
  const auto wide = masked(3, 0.5), round = masked(0.5, 3);
  ASSERT_TRUE(wide.ok() && round.ok());
  const double middle = (strip.y0 + strip.y1) / 2;
  EXPECT_NEAR(nearest_wood(*wide, strip.x0, middle), 3, 0.35);
  EXPECT_NEAR(nearest_wood(*round, strip.x0, middle), 0.5, 0.35);
  EXPECT_NEAR(nearest_wood(*wide, screw.x, screw.y), screw.diameter / 2 + 3, 0.5) << "a round has an edge, too";
  EXPECT_NEAR(nearest_wood(*round, screw.x, screw.y), screw.diameter / 2 + 3, 0.5);
}

TEST(VeneerMask, LeavesOutMissingPiecesAndTheirShadows) {
  rendered::Panel panel = six_species();
  panel.gone = {{{30, 30}, {42, 30}, {42, 45}, {30, 45}}, {{75, 50}, {84, 52}, {80, 66}}};
  const auto mask = calib::mask_veneer(map_of(panel, 150), fiducials_of(panel));
  ASSERT_TRUE(mask.ok());
  const Quality quality = judge(panel, *mask);
  EXPECT_EQ(quality.outside, 0);
  EXPECT_LT(quality.lost_fraction, 0.015);
}

// As small as rounds are, and no rounds.
TEST(VeneerMask, LeavesOutSmallMissingPieces) {
  for (const double size : {6.0, 10.0}) {
    rendered::Panel panel = six_species();
    for (const auto& strip : panel.strips) {
      const double x = 0.5 * (strip.x0 + strip.x1 - size);
      panel.gone.push_back({{x, 28}, {x + size, 28}, {x + size, 28 + size}, {x, 28 + size}});
    }
    const auto mask = calib::mask_veneer(map_of(panel, 150), fiducials_of(panel));
    ASSERT_TRUE(mask.ok());
    const Quality quality = judge(panel, *mask);
    EXPECT_EQ(quality.outside, 0) << size;
    EXPECT_LT(quality.lost_fraction, 0.03) << size;
  }
}

TEST(VeneerMask, DoesNotLetWoodGrowBack) {
  rendered::Panel panel = six_species();
  const auto before = map_of(panel, 150);
  const auto whole = calib::mask_veneer(before, fiducials_of(panel));
  ASSERT_TRUE(whole.ok());
  // A cut that leaves half a screw hole in the remnant.
  const auto& screw = panel.screws[1];
  panel.gone = {
      {{screw.x, screw.y - 8}, {screw.x + 9, screw.y - 8}, {screw.x + 9, screw.y + 8}, {screw.x, screw.y + 8}}};
  const calib::EarlierLook earlier{before, whole->usable};
  const auto mask = calib::mask_veneer(map_of(panel, 150), fiducials_of(panel), {}, &earlier);
  ASSERT_TRUE(mask.ok());
  EXPECT_EQ(judge(panel, *mask).outside, 0);
  EXPECT_EQ(cv::countNonZero(mask->usable.pixels & ~whole->usable.pixels), 0);
  Raster<PanelFrame> small = whole->usable;
  small.pixels = small.pixels.rowRange(0, 50);
  const calib::EarlierLook smaller{before, small};
  EXPECT_FALSE(calib::mask_veneer(before, fiducials_of(panel), {}, &smaller).ok());
}

TEST(VeneerMask, StandsUnevenLightAndNoise) {
  const rendered::Panel panel = six_species();
  rendered::Optics optics;
  optics.uneven_light = 0.12, optics.noise = 4;
  const auto mask = calib::mask_veneer(map_of(panel, 150, optics), fiducials_of(panel));
  ASSERT_TRUE(mask.ok());
  const Quality quality = judge(panel, *mask);
  EXPECT_EQ(quality.outside, 0);
  EXPECT_LT(quality.lost_fraction, 0.01);
}

TEST(VeneerMask, IsTheSameForEqualInputs) {
  const rendered::Panel panel = six_species();
  const auto map = map_of(panel, 100);
  const auto first = calib::mask_veneer(map, fiducials_of(panel)),
             second = calib::mask_veneer(map, fiducials_of(panel));
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_EQ(cv::norm(first->usable.pixels, second->usable.pixels, cv::NORM_INF), 0);
}

TEST(VeneerMask, RefusesABareBoardAndAGreyPicture) {
  rendered::Panel bare = six_species();
  bare.strips.clear();
  bare.screws.clear();
  const auto none = calib::mask_veneer(map_of(bare, 75), fiducials_of(bare));
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().code, ErrorCode::kRefused);
  Raster<PanelFrame> grey = map_of(bare, 75);
  grey.pixels = cv::Mat(10, 10, CV_8UC1);
  EXPECT_FALSE(calib::mask_veneer(grey, {}).ok());
}

}  // namespace
}  // namespace veneer
