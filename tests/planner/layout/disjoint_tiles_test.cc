// A mosaic's tiles with joints between them, each in its cell.
#include "planner/layout/disjoint_tiles.h"

#include <gtest/gtest.h>

#include <stop_token>
#include <vector>

namespace veneer::planner {
namespace {

TEST(DisjointTiles, ATileKeepsToItsCellAndBecomesNoSmallerThanThatTakes) {
  cv::Mat labels(40, 60, CV_32SC1, cv::Scalar(1));
  labels.colRange(0, 20).setTo(0);
  VoronoiField field{
      cv::Mat(labels.size(), CV_32FC1, cv::Scalar(0)), cv::Mat(labels.size(), CV_32FC1, cv::Scalar(28)), {}};
  const std::vector<DisjointTile> tiles = disjoint_tiles(labels, field, 1);
  ASSERT_EQ(tiles.size(), 2U);
  EXPECT_NEAR(tiles[0].middle.x, 10, 0.5);
  EXPECT_NEAR(tiles[0].width, 0.9 * kTileShare * 28, 1e-9) << "its cell is 20 wide";
  EXPECT_NEAR(tiles[1].middle.x, 40, 1e-9);
  EXPECT_NEAR(tiles[1].width, kTileShare * 28, 1e-9);
  // A cell with a corner cut off: the tile moves away from it rather than becoming smaller.
  labels.setTo(1);
  for (int r = 0; r < 40; ++r)
    for (int c = 0; c < 60; ++c)
      if (r < 32 && c < 32 && r + c >= 18) labels.at<int>(r, c) = 0;
  const DisjointTile moved = disjoint_tiles(labels, field, 1)[0];
  EXPECT_GT(moved.middle.x + moved.middle.y, 33);
  EXPECT_GE(moved.width, 0.8 * kTileShare * 28);
}

// However a tile's sides fall between the middles of pixels.
TEST(DisjointTiles, ATileThatLiesInItsCellStaysAsItIs) {
  constexpr int kSide = 60;
  for (const double wanted : {14.4, 17.0, 17.6, 18.0}) {
    for (int dx = 0; dx < 10; ++dx)
      for (int dy = 0; dy < 10; ++dy) {
        // The cell's columns and rows end aslant, so that its middle lies at tenths of a pixel.
        cv::Mat labels(kSide, kSide, CV_32SC1, cv::Scalar(0));
        labels(cv::Rect(10, 10, 40, 40)).setTo(1);
        labels(cv::Rect(50, 10, 1, 4 * dx)).setTo(1), labels(cv::Rect(10, 50, 4 * dy, 1)).setTo(1);
        const VoronoiField field{cv::Mat(labels.size(), CV_32FC1, cv::Scalar(0)),
                                 cv::Mat(labels.size(), CV_32FC1, cv::Scalar(wanted / kTileShare)),
                                 {}};
        double x = 0, y = 0, area = 0;
        for (int r = 0; r < kSide; ++r)
          for (int c = 0; c < kSide; ++c)
            if (labels.at<int>(r, c) == 1) x += c + 0.5, y += r + 0.5, ++area;
        const DisjointTile tile = disjoint_tiles(labels, field, 1)[1];
        EXPECT_NEAR(tile.middle.x, x / area, 1e-9) << wanted;
        EXPECT_NEAR(tile.middle.y, y / area, 1e-9) << wanted;
        EXPECT_NEAR(tile.width, wanted, 1e-5);
      }
  }
}

// What of a tile lies beyond the raster lies beyond its cell.
TEST(DisjointTiles, ATileKeepsToThePicture) {
  const cv::Mat labels(12, 60, CV_32SC1, cv::Scalar(0));
  const VoronoiField field{
      cv::Mat(labels.size(), CV_32FC1, cv::Scalar(0)), cv::Mat(labels.size(), CV_32FC1, cv::Scalar(20)), {}};
  const DisjointTile tile = disjoint_tiles(labels, field, 1)[0];
  EXPECT_NEAR(tile.length, 0.7 * kTileShare * 20, 1e-9) << "a twentieth at most beyond 12 pixels";
  EXPECT_NEAR(tile.middle.y, 6, 1e-9);
}

TEST(DisjointTiles, TheFiguresOfTilesAreThoseOfTheTiles) {
  const cv::Mat angle(100, 100, CV_32FC1, cv::Scalar(0));
  cv::Mat edges(100, 100, CV_8UC1, cv::Scalar(0));
  const DisjointTile level{{30, 30}, 0, 20, 10}, beside{{45, 30}, 0, 20, 10}, turned{{70, 70}, 0.35, 20, 10};
  TileFigures figures = *tile_figures({level, beside, turned}, angle, edges);
  EXPECT_NEAR(figures.overlap, 50.0 / 600, 0.01);
  EXPECT_NEAR(figures.coverage, 550.0 / 10000, 0.001);
  EXPECT_EQ(figures.deviation_deg, 0) << "the median";
  EXPECT_NEAR(tile_figures({turned}, angle, edges)->deviation_deg, 20.05, 0.1);
  EXPECT_EQ(figures.straddling, 0);
  edges.row(30).setTo(255);
  EXPECT_NEAR(tile_figures({level, beside, turned}, angle, edges)->straddling, 2.0 / 3, 1e-9);
  edges.setTo(0);
  edges.row(34).setTo(255);  // on the rim
  EXPECT_EQ(tile_figures({level, beside, turned}, angle, edges)->straddling, 0);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(tile_figures({turned}, angle, edges, stop.get_token()).error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace veneer::planner
