// Two scans of one sheet, joined by what both show of it: rendered at known places on the glass.
#include "calib/tile_join.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "calib/point_fit.h"
#include "calib/registration.h"
#include "tests/support/rendered_panel.h"

namespace veneer {
namespace {

using calib::TileView;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

using GlassFromSheet = Isometry2<GlassFrame, PanelFrame>;

// A sheet too wide for the glass, with five tags and a hole where the two tiles overlap.
struct TwoTiles {
  rendered::Panel panel;
  rendered::Scanner scanner;
  GlassFromSheet left = rendered::lay(0, 55, 8, 70, 0.7, Face::kShow);
  GlassFromSheet right = rendered::lay(230, 55, 172, 71, -1.1, Face::kShow);
  cv::Mat pictures[2];

  TwoTiles() {
    panel = rendered::sample_panel(230, 110, 4);
    std::erase_if(panel.tags, [](const auto& tag) { return tag.face == Face::kBack; });
    const double places[][2] = {{80, 12}, {112, 12.5}, {146, 12}, {82, 98.5}, {142, 98}};
    std::erase_if(panel.tags, [](const auto& tag) { return tag.x > 60 && tag.x < 170; });
    panel.holes = {{96, 12}, {7, 55}, {223, 40}, {160, 103}};
    int id = 210;
    for (const auto& [x, y] : places) panel.tags.push_back({id, Face::kShow, x, y, 0.4 * (id - 212)}), ++id;
    scanner.dpi = 150, scanner.width_mm = 180, scanner.height_mm = 140;
    pictures[0] = scan_panel(panel, Face::kShow, left, scanner);
    pictures[1] = scan_panel(panel, Face::kShow, right, scanner);
  }
  const GlassFromSheet& pose(std::size_t tile) const { return tile == 0 ? left : right; }
  const rendered::GluedTag& tag(int id) const {
    return *std::ranges::find(panel.tags, id, [](const auto& tag) { return tag.id; });
  }
  std::vector<TileView> views(const cv::Mat& first, const cv::Mat& second) const {
    return {calib::view_tile(first, scanner.nominal(), "tile 1"),
            calib::view_tile(second, scanner.nominal(), "tile 2")};
  }
  std::vector<TileView> views() const { return views(pictures[0], pictures[1]); }

  // A pencil's line on the glass, along a side of the tag on one tile: so wide that this side seems to lie that far
  // out.
  cv::Mat with_line(std::size_t tile, int id, double wide_mm) const {
    cv::Mat picture = pictures[tile].clone();
    const auto corners = tag(id).corners();
    const Point<PanelFrame> out[] = {corners[0], corners[1],
                                     point<PanelFrame>(corners[1].x.count(), corners[1].y.count() - wide_mm),
                                     point<PanelFrame>(corners[0].x.count(), corners[0].y.count() - wide_mm)};
    constexpr int kTimes = 8;  // drawn so much finer: its rim must not fall on whole pixels
    std::vector<cv::Point> fine;
    for (const auto& corner : out) {
      const Point<ScanFrame> at = scanner.scan_from_glass(pose(tile) * corner);
      fine.emplace_back(cvRound(at.x.count() * kTimes), cvRound(at.y.count() * kTimes));
    }
    const cv::Rect box = cv::boundingRect(fine);
    const cv::Rect pixels(box.x / kTimes - 2, box.y / kTimes - 2, box.width / kTimes + 5, box.height / kTimes + 5);
    cv::Mat cover(pixels.height * kTimes, pixels.width * kTimes, CV_8UC1, cv::Scalar(0));
    for (auto& p : fine) p -= pixels.tl() * kTimes;
    cv::fillConvexPoly(cover, fine, cv::Scalar(255));
    cv::GaussianBlur(cover, cover, {}, 0.6 * kTimes);
    cv::resize(cover, cover, pixels.size(), 0, 0, cv::INTER_AREA);
    for (int r = 0; r < pixels.height; ++r)
      for (int c = 0; c < pixels.width; ++c) {
        auto& pixel = picture.at<cv::Vec3b>(pixels.y + r, pixels.x + c);
        const double a = cover.at<unsigned char>(r, c) / 255.0;
        for (int k = 0; k < 3; ++k) pixel[k] = cv::saturate_cast<unsigned char>(pixel[k] * (1 - a) + 30 * a);
      }
    return picture;
  }

  // How far apart the two tiles' maps put what lies at one place of the sheet, at worst.
  double seam(const calib::Registration& found) const {
    double worst = 0;
    for (double y = 5; y < panel.height; y += 20)
      for (double x = 5; x < panel.width; x += 20) {
        const auto at = [&](std::size_t tile) {
          return found.tiles[tile] * scanner.scan_from_glass(pose(tile) * point<PanelFrame>(x, y));
        };
        worst = std::max(worst, distance(at(0), at(1)).count());
      }
    return worst;
  }
};

const TwoTiles& two_tiles() {
  static const TwoTiles tiles;
  return tiles;
}

std::vector<int> tags_of(const calib::Registration& found) {
  std::vector<int> ids;
  for (const auto& tag : found.fiducials.tags) ids.push_back(tag.id);
  return ids;
}
std::vector<int> spoiled_in(const calib::Registration& found) {
  std::vector<int> ids;
  for (const auto& spoiled : found.spoiled) ids.push_back(spoiled.tag.id);
  return ids;
}

TEST(TileJoin, LeavesNothingOutOfASoundSheet) {
  const auto found = register_first_scan(two_tiles().views(), calib::ScannerModel());
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_THAT(found->spoiled, IsEmpty());
  EXPECT_THAT(tags_of(*found), ::testing::IsSupersetOf({210, 211, 212, 213, 214}));
  EXPECT_LT(two_tiles().seam(*found), 0.01);
}

TEST(TileJoin, LeavesOutAndNamesATagThatOneTileShowsSpoiled) {
  const TwoTiles& sheet = two_tiles();
  for (const std::size_t tile : {0U, 1U}) {
    cv::Mat pictures[] = {sheet.pictures[0], sheet.pictures[1]};
    pictures[tile] = sheet.with_line(tile, 211, 0.22);
    const auto found = register_first_scan(sheet.views(pictures[0], pictures[1]), calib::ScannerModel());
    ASSERT_TRUE(found.ok()) << found.error().message;
    ASSERT_THAT(spoiled_in(*found), ElementsAre(211));
    ASSERT_TRUE(found->spoiled[0].apart.has_value()) << "its size is as printed, to 1 %";
    EXPECT_GT(*found->spoiled[0].apart, Millimetres(0.1));
    EXPECT_THAT(tags_of(*found), ::testing::Not(::testing::Contains(211)));
    const auto is = found->tiles[1] * sheet.scanner.scan_from_glass(sheet.right * sheet.tag(211).corners()[0]);
    EXPECT_LT(distance(found->spoiled[0].tag.corners[0], is).count(), 0.3) << "no wood";
    EXPECT_LT(sheet.seam(*found), 0.01) << "as good as without it";
    EXPECT_LT(found->max->count(), 0.02);
  }
}

// The tag shows where it was, whatever a spark left of its corner: nothing needs to be left out.
TEST(TileJoin, TakesATagWithAScorchedCornerForWhatItIs) {
  TwoTiles sheet = two_tiles();
  const Point<PanelFrame> corner = sheet.tag(211).corners()[2];
  for (const std::size_t tile : {0U, 1U}) {
    const Point<ScanFrame> at = sheet.scanner.scan_from_glass(sheet.pose(tile) * corner);
    sheet.pictures[tile] = sheet.pictures[tile].clone();
    cv::circle(sheet.pictures[tile], {cvRound(at.x.count() + 2), cvRound(at.y.count() - 3)}, 6, cv::Scalar(20, 26, 34),
               cv::FILLED);
  }
  const auto found = register_first_scan(sheet.views(), calib::ScannerModel());
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_THAT(found->spoiled, IsEmpty());
  EXPECT_LT(found->max->count(), 0.02);
  EXPECT_LT(sheet.seam(*found), 0.01);
}

// ---- What a robust fit must not swallow: the tile is displaced, not a tag spoiled ----------------------------------

// The scanner's carriage slips between tags, and all that it sees behind that place lies elsewhere.
TileView slipped(TileView view, double from_px, double by_mm) {
  const Pixels by(by_mm * view.nominal.px_per_mm);
  for (auto& tag : view.tags)
    if (tag.centre.x.count() > from_px)
      for (auto& corner : tag.corners) corner.y += by;
  for (auto& hole : view.holes)
    if (hole.centre.x.count() > from_px) hole.centre.y += by;
  return view;
}

TEST(TileJoin, RefusesATileWhoseCarriageSlippedHoweverFewTagsTellOfIt) {
  const TwoTiles& sheet = two_tiles();
  const double px = sheet.scanner.nominal().px_per_mm;
  const std::vector<TileView> sound = sheet.views();
  const auto before = [&](int id) {
    const auto& tags = sound[0].tags;
    return std::ranges::find(tags, id, [](const auto& tag) { return tag.id; })->centre.x.count() - 2 * px;
  };
  // Behind it are two tags and a hole, all of one end; or one tag and a hole; or one tag alone.
  for (const int first : {214, 212})
    for (const bool hole : {true, false})
      for (const double by : {0.25, 0.6, -2.0}) {
        std::vector<TileView> views = sound;
        if (!hole) std::erase_if(views[0].holes, [&](const auto& h) { return h.centre.x.count() > before(first); });
        views[0] = slipped(views[0], before(first), by);
        const auto found = register_first_scan(views, calib::ScannerModel());
        ASSERT_FALSE(found.ok()) << "from tag " << first << " by " << by;
        EXPECT_THAT(found.error().message, HasSubstr("the tiles disagree"));
      }
}

TEST(TileJoin, RefusesATagThatSlidBetweenTheScans) {
  for (const std::size_t tile : {0U, 1U}) {
    std::vector<TileView> views = two_tiles().views();
    auto& tags = views[tile].tags;
    const auto loose = std::ranges::find(tags, 212, [](const auto& tag) { return tag.id; });
    for (auto& corner : loose->corners) corner.x += Pixels(0.3 * views[tile].nominal.px_per_mm);
    const auto found = register_first_scan(views, calib::ScannerModel());
    ASSERT_FALSE(found.ok());
    EXPECT_THAT(found.error().message, HasSubstr("the tiles disagree, most at tag 212"));
  }
}

TEST(TileJoin, BlamesNoTagForAScannerThatRunsLonger) {
  for (const double drift : {0.002, 0.004}) {
    std::vector<TileView> views = two_tiles().views();
    for (auto& tag : views[1].tags)
      for (auto& corner : tag.corners) corner.x = corner.x * (1 + drift);
    for (auto& hole : views[1].holes) hole.centre.x = hole.centre.x * (1 + drift);
    const auto found = register_first_scan(views, calib::ScannerModel());
    if (found.ok())
      EXPECT_THAT(found->spoiled, IsEmpty()) << drift;
    else
      EXPECT_THAT(found.error().message, HasSubstr("the tiles disagree")) << drift;
  }
}

// Three spoiled tags of five leave two and a hole or two: too few beside them to tell who is right.
TEST(TileJoin, RefusesMoreSpoiledTagsThanTheOthersOutvote) {
  const TwoTiles& sheet = two_tiles();
  cv::Mat second = sheet.with_line(1, 211, 0.22);
  cv::Mat third = sheet.with_line(1, 214, 0.22);
  cv::min(second, third, second);
  third = sheet.with_line(1, 213, 0.22);
  cv::min(second, third, second);
  const auto found = register_first_scan(sheet.views(sheet.pictures[0], second), calib::ScannerModel());
  ASSERT_FALSE(found.ok());
  EXPECT_THAT(found.error().message, HasSubstr("the tiles disagree"));
}

}  // namespace
}  // namespace veneer
