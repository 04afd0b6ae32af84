#include "planner/files/tile_picture.h"

#include <gmock/gmock.h>

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <pugixml.hpp>

#include "planner/files/preview.h"

namespace veneer::planner {
namespace {

// Two tiles on 40 x 20 mm: a level one on the left, half dark and half pale, and one at 30 degrees on the right.
const PlanArtwork kArtwork{"face.png", "A", Millimetres(40), Millimetres(20)};
MosaicTiling two_tiles() {
  return {0,
          {{point<ArtworkFrame>(10, 10), Radians(0), Millimetres(12), Millimetres(6)},
           {point<ArtworkFrame>(30, 10), degrees(30), Millimetres(10), Millimetres(4)}}};
}
cv::Mat picture() {
  cv::Mat out(100, 200, CV_8UC3, cv::Scalar(10, 20, 200));
  out.colRange(0, 50).setTo(cv::Scalar(0, 0, 0));
  out.colRange(50, 100).setTo(cv::Scalar(100, 200, 50));
  return out;
}

TEST(TilePicture, ATileIsOfOneColourAndJointsAreGrout) {
  const cv::Mat drawn = draw_tiles(two_tiles(), kArtwork, picture(), {}, ScanResolution::from_dpi(254));
  ASSERT_EQ(drawn.size(), cv::Size(400, 200));
  const auto at = [&](double x, double y) {  // mm from the lower left
    return drawn.at<cv::Vec3b>(static_cast<int>((20 - y) * 10), static_cast<int>(x * 10));
  };
  const cv::Vec3b mean(50, 100, 25);
  for (const auto& [x, y] : {std::pair(4.3, 7.3), std::pair(15.7, 12.7), std::pair(10.0, 10.0)})
    EXPECT_LE(cv::norm(at(x, y), mean, cv::NORM_INF), 1) << x;
  EXPECT_EQ(at(20, 10), cv::Vec3b(118, 130, 140));
  EXPECT_EQ(at(10, 13.5), cv::Vec3b(118, 130, 140));
  // Its length runs up to the right.
  EXPECT_EQ(at(30 + 4.5 * std::cos(kPi / 6), 10 + 4.5 * std::sin(kPi / 6)), cv::Vec3b(10, 20, 200));
  EXPECT_EQ(at(30 + 4.5 * std::cos(kPi / 6), 10 - 4.5 * std::sin(kPi / 6)), cv::Vec3b(118, 130, 140));
}

TEST(TilePicture, APointSampleIsTheColourInTheMiddle) {
  MosaicTiling tiling = two_tiles();
  tiling.tiles[0].middle.x = Millimetres(11);
  const auto colours = tile_colours(tiling, kArtwork, picture(), TileColour::kPoint);
  EXPECT_EQ(colours, (std::vector<cv::Vec3b>{{100, 200, 50}, {10, 20, 200}}));
  const cv::Vec3b area = tile_colours(tiling, kArtwork, picture(), TileColour::kArea)[0];
  EXPECT_LE(cv::norm(area, cv::Vec3b(58, 117, 29), cv::NORM_INF), 1) << "five twelfths of it are black";
  tiling.tiles[0].length = tiling.tiles[0].width = Millimetres(0.01);  // less than a pixel
  EXPECT_EQ(tile_colours(tiling, kArtwork, picture(), TileColour::kArea)[0], cv::Vec3b(100, 200, 50));
}

TEST(TilePicture, TheDrawingHasTheSameTiles) {
  TileLook look;
  look.grout = cv::Vec3b(1, 2, 255);
  pugi::xml_document document;
  ASSERT_TRUE(document.load_string(tiles_svg(two_tiles(), kArtwork, picture(), look).c_str()));
  const pugi::xml_node svg = document.child("svg");
  EXPECT_STREQ(svg.attribute("width").value(), "40.000mm");
  EXPECT_STREQ(svg.attribute("viewBox").value(), "0 0 40.000 20.000");
  EXPECT_STREQ(svg.child("rect").attribute("fill").value(), "#ff0201");
  const pugi::xml_node level = svg.child("polygon");
  EXPECT_STREQ(level.attribute("points").value(), "4.000,13.000 16.000,13.000 16.000,7.000 4.000,7.000");
  EXPECT_STREQ(level.attribute("fill").value(), "#196432");
  EXPECT_STREQ(level.next_sibling("polygon").attribute("fill").value(), "#c8140a");
}

TEST(MeanColours, AreThoseOfEachPieceWithWood) {
  Plan plan;
  plan.artworks = {kArtwork};
  for (const double x : {0.0, 20.0}) {
    Piece piece;
    piece.artwork_outline = {point<ArtworkFrame>(x, 0), point<ArtworkFrame>(x + 20, 0), point<ArtworkFrame>(x + 20, 20),
                             point<ArtworkFrame>(x, 20)};
    if (x == 0) piece.placement = Placement{{"P"}, {}};
    plan.pieces.push_back(piece);
  }
  const Raster<ArtworkFrame> preview{picture(), ScanResolution::from_dpi(127)};
  const auto means = in_mean_colours(plan, 0, preview);
  ASSERT_TRUE(means.ok()) << means.error().message;
  const cv::Mat left = means->colRange(0, 100), right = means->colRange(100, 200);
  EXPECT_EQ(cv::norm(left, cv::Mat(left.size(), CV_8UC3, cv::Scalar(50, 100, 25)), cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(right, picture().colRange(100, 200), cv::NORM_INF), 0) << "it has no wood";
  EXPECT_EQ(in_mean_colours(plan, 1, preview).error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace veneer::planner
