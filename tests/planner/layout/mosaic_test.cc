// Mosaics: sizes of cells, cells along edges and lines, and how they come out.
#include "planner/layout/mosaic.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "planner/cutting/marks.h"
#include "planner/layout/fabricable_partition.h"
#include "tests/planner/layout/partition_checks.h"

namespace veneer::planner {
namespace {

cv::Mat portrait(cv::Size size) {
  cv::Mat out(size, CV_8UC3, cv::Scalar(200, 190, 180));
  cv::ellipse(out, {size.width / 2, size.height / 2}, {size.width / 4, size.height / 3}, 20, 0, 360,
              cv::Scalar(90, 120, 170), cv::FILLED);
  cv::circle(out, {size.width * 2 / 5, size.height * 2 / 5}, size.width / 18, cv::Scalar(30, 30, 40), cv::FILLED);
  return out;
}

TEST(TileSizes, FillTheRasterAndAreSmallWhereDetailIs) {
  cv::Mat detail(200, 300, CV_32FC1, cv::Scalar(0));
  detail.colRange(0, 100).setTo(1);
  const cv::Mat size = tile_sizes(detail, 80, 2);
  double tiles = 0;
  for (int r = 0; r < size.rows; ++r)
    for (int c = 0; c < size.cols; ++c) tiles += 1 / std::pow(static_cast<double>(size.at<float>(r, c)), 2);
  EXPECT_NEAR(tiles, 80, 0.1);
  EXPECT_GT(size.at<float>(100, 290), 1.3F * size.at<float>(100, 10));
}

// Squares of 20 pixels, side by side along lines that are turned by so many degrees.
cv::Mat turned_squares(cv::Size size, double degrees) {
  const double cos = std::cos(degrees * std::numbers::pi / 180), sin = std::sin(degrees * std::numbers::pi / 180);
  cv::Mat out(size, CV_32SC1);
  for (int r = 0; r < size.height; ++r)
    for (int c = 0; c < size.width; ++c) {
      const int u = static_cast<int>(std::floor((c * cos + r * sin) / 20)) + 100,
                v = static_cast<int>(std::floor((r * cos - c * sin) / 20)) + 100;
      out.at<int>(r, c) = u * 1000 + v;
    }
  return out;
}

TEST(Mosaic, SaysHowFarCellsAreTurnedFromTheField) {
  const cv::Size size(400, 400);
  const auto field = [&](double degrees) {
    return cv::Mat(size, CV_32FC1, cv::Scalar(degrees * std::numbers::pi / 180));
  };
  for (const double turned : {0.0, 10.0, 30.0, 45.0}) {
    EXPECT_NEAR(cell_deviation(turned_squares(size, turned), field(turned)), 0, 2) << turned;
    EXPECT_NEAR(cell_deviation(turned_squares(size, turned), field(turned + 90)), 0, 2) << turned;
    EXPECT_NEAR(cell_deviation(turned_squares(size, turned), field(turned - 20)), 20, 2) << turned;
    EXPECT_NEAR(cell_deviation(turned_squares(size, turned), field(turned + 50)), 40, 2) << turned;
  }
}

TEST(Mosaic, ComesToRestAlongTheEdgesAndIsTheSameForEachSeed) {
  const cv::Mat picture = portrait({360, 300});
  const cv::Mat size = tile_sizes(cv::Mat(picture.size(), CV_32FC1, cv::Scalar(0)), 150, 2);
  const auto mosaic = decorative_mosaic(picture, size, {150, 1, 4, 2});
  ASSERT_TRUE(mosaic.ok());
  EXPECT_EQ(mosaic->figures.tiles, 150);
  EXPECT_LT(mosaic->figures.mean_move_px, 0.1);
  EXPECT_LE(mosaic->figures.deviation_deg, 5);
  EXPECT_LE(mosaic->figures.cell_deviation_deg, 5);
  EXPECT_LE(mosaic->figures.straddling, 0.02);  // none was measured
  const auto again = decorative_mosaic(picture, size, {150, 1, 4, 1});
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(cv::countNonZero(mosaic->labels != again->labels), 0);
  EXPECT_EQ(mosaic->figures, again->figures);
  const auto other = decorative_mosaic(picture, size, {150, 1, 5, 1});
  EXPECT_GT(cv::countNonZero(mosaic->labels != other->labels), 0);
}

// How often as long as wide a cell is, and which way its long side runs: degrees from +x, in [0, 180).
struct CellShape {
  double aspect = 0, degrees = 0;
  cv::Point2d middle;
};
std::vector<CellShape> shapes_of(const cv::Mat& labels) {
  std::map<int, std::vector<cv::Point>> pixels;
  for (int r = 0; r < labels.rows; ++r)
    for (int c = 0; c < labels.cols; ++c) pixels[labels.at<int>(r, c)].emplace_back(c, r);
  std::vector<CellShape> out;
  for (const auto& [label, of] : pixels) {
    cv::Mat covariance, mean, values, vectors;
    cv::Mat points(static_cast<int>(of.size()), 2, CV_64F);
    for (std::size_t i = 0; i < of.size(); ++i)
      points.at<double>(static_cast<int>(i), 0) = of[i].x, points.at<double>(static_cast<int>(i), 1) = of[i].y;
    cv::calcCovarMatrix(points, covariance, mean, cv::COVAR_NORMAL | cv::COVAR_ROWS | cv::COVAR_SCALE);
    cv::eigen(covariance, values, vectors);
    const double turn = std::atan2(vectors.at<double>(0, 1), vectors.at<double>(0, 0)) * 180 / std::numbers::pi;
    out.push_back({std::sqrt(values.at<double>(0) / std::max(1e-9, values.at<double>(1))),
                   std::fmod(turn + 180, 180),
                   {mean.at<double>(0), mean.at<double>(1)}});
  }
  return out;
}

// Along edges that are level as along those that are upright, and on both sides of where they are as near.
TEST(Mosaic, LongCellsLieAlongTheNearestEdge) {
  const cv::Mat picture(300, 300, CV_8UC3, cv::Scalar::all(128));  // its border is its only edge
  const cv::Mat size = tile_sizes(cv::Mat(picture.size(), CV_32FC1, cv::Scalar(0)), 150, 2);
  const auto mosaic = decorative_mosaic(picture, size, {150, 3, 4, 2});
  ASSERT_TRUE(mosaic.ok());
  std::vector<double> aspects;
  int level = 0, upright = 0, astray = 0;
  for (const CellShape& it : shapes_of(mosaic->labels)) {
    aspects.push_back(it.aspect);
    const double across = std::abs(it.middle.x - 150), down = std::abs(it.middle.y - 150);
    if (std::abs(across - down) < 40) continue;  // where the two edges are about as near
    const bool is_level = it.degrees < 20 || it.degrees > 160, is_upright = std::abs(it.degrees - 90) < 20;
    (down > across ? level : upright) += 1;
    if (down > across ? !is_level : !is_upright) ++astray;
  }
  EXPECT_GT(level, 25);
  EXPECT_GT(upright, 25);
  EXPECT_LE(astray, 5) << "of " << level + upright;
  std::nth_element(aspects.begin(), aspects.begin() + 75, aspects.end());
  EXPECT_NEAR(aspects[75], 3, 0.5);
  EXPECT_LE(mosaic->figures.cell_deviation_deg, 5);
}

TEST(TileSizes, FollowWhatIsPaintedEvenlyByFactors) {
  cv::Mat painted(200, 300, CV_8UC1, cv::Scalar(0));
  painted.colRange(0, 100).setTo(255);
  painted.colRange(100, 200).setTo(128);
  const cv::Mat size = painted_tile_sizes(smooth_painted(painted, 300), 300, 4);
  const auto at = [&](int c) { return static_cast<double>(size.at<float>(100, c)); };
  EXPECT_NEAR(at(150) / at(20), 2, 0.1);
  EXPECT_NEAR(at(280) / at(150), 2, 0.1);
  double tiles = 0;
  for (int r = 0; r < size.rows; ++r)
    for (int c = 0; c < size.cols; ++c) tiles += 1 / std::pow(static_cast<double>(size.at<float>(r, c)), 2);
  EXPECT_NEAR(tiles, 300, 0.5);
  // From one to the other within a few tiles, never at once.
  for (int c = 1; c < 300; ++c) EXPECT_LT(at(c) / at(c - 1), 1.06) << c;
}

// A line through a plain picture, aslant: cells on it lie along it, and none lies across it.
TEST(Mosaic, CellsLieAlongLinesThatSomebodyDrew) {
  const cv::Mat plain(300, 300, CV_8UC3, cv::Scalar::all(128));
  const cv::Mat size = tile_sizes(cv::Mat(plain.size(), CV_32FC1, cv::Scalar(0)), 150, 2);
  MosaicOptions options{150, 1, 4, 2};
  options.with_joints = true;
  const auto askew = [&] {  // of cells beside the line, on the mean, from its direction
    const auto mosaic = decorative_mosaic(plain, size, options);
    EXPECT_TRUE(mosaic.ok());
    double sum = 0;
    int count = 0;
    for (const DisjointTile& tile : mosaic->tiles) {
      const double off = std::abs((tile.middle.y - 150) * std::cos(0.4) - (tile.middle.x - 150) * std::sin(0.4));
      if (off > 20 || std::abs(tile.middle.x - 150) > 80) continue;
      sum += std::abs(std::remainder(tile.angle - 0.4, std::numbers::pi / 2)) * 180 / std::numbers::pi;
      ++count;
    }
    EXPECT_GT(count, 8);
    return sum / std::max(1, count);
  };
  EXPECT_GT(askew(), 15);
  options.lines = cv::Mat(plain.size(), CV_8UC1, cv::Scalar(0));
  cv::line(options.lines, {10, 150 - cvRound(140 * std::tan(0.4))}, {290, 150 + cvRound(140 * std::tan(0.4))},
           cv::Scalar(255));
  EXPECT_LT(askew(), 3);
}

TEST(Mosaic, LinesCountBesideThePicturesEdgesOrInsteadOfThem) {
  cv::Mat picture(300, 300, CV_8UC3, cv::Scalar::all(200));
  cv::circle(picture, {150, 150}, 90, cv::Scalar::all(60), cv::FILLED);
  const cv::Mat size = tile_sizes(cv::Mat(picture.size(), CV_32FC1, cv::Scalar(0)), 150, 2);
  MosaicOptions options{150, 1, 4, 2};
  options.lines = cv::Mat(picture.size(), CV_8UC1, cv::Scalar(0));
  cv::line(options.lines, {20, 20}, {280, 20}, cv::Scalar(255));
  // Cells with as much of the disc as of what is around it.
  const auto torn = [&] {
    const auto mosaic = decorative_mosaic(picture, size, options);
    EXPECT_TRUE(mosaic.ok());
    std::map<int, std::array<int, 2>> pixels;
    for (int r = 0; r < 300; ++r)
      for (int c = 0; c < 300; ++c)
        ++pixels[mosaic->labels.at<int>(r, c)][picture.at<cv::Vec3b>(r, c)[0] < 130 ? 0 : 1];
    return std::ranges::count_if(pixels, [](const auto& it) {
      const auto& [dark, pale] = it.second;
      return std::min(dark, pale) > 0.2 * (dark + pale);
    });
  };
  EXPECT_LE(torn(), 2);
  options.lines_only = true;
  EXPECT_GT(torn(), 10);
}

TEST(Mosaic, SaysWithinWhichCellsTheFieldTurnsTooFast) {
  const cv::Size size(240, 240);
  const cv::Mat cells = turned_squares(size, 0);
  cv::Mat angle(size, CV_32FC1);
  const auto turning = [&](double degrees_a_pixel) {
    for (int r = 0; r < size.height; ++r)
      for (int c = 0; c < size.width; ++c)  // on the right only
        angle.at<float>(r, c) = static_cast<float>(std::max(0, c - 160) * degrees_a_pixel * std::numbers::pi / 180);
    return turning_cells(cells, angle);
  };
  EXPECT_TRUE(turning(0).empty());
  EXPECT_TRUE(turning(40.0 / 20).empty()) << "by 40 degrees within each cell";
  const std::vector<PlanePoint> fast = turning(50.0 / 20);
  EXPECT_EQ(fast.size(), 4U * 12U);
  for (const PlanePoint& it : fast) EXPECT_GT(it.x, 160.0 / 240);
}

// Hausner's tiles, by the figures that they are to reach.
TEST(Mosaic, TilesWithJointsKeepApartAndOffTheEdges) {
  const cv::Mat picture = portrait({450, 450});
  const cv::Mat size = tile_sizes(cv::Mat(picture.size(), CV_32FC1, cv::Scalar(0)), 500, 2);
  for (const std::uint64_t seed : {4U, 5U, 6U}) {
    MosaicOptions options{500, 1, seed, 2};
    EXPECT_FALSE(decorative_mosaic(picture, size, options)->tile_figures);
    options.with_joints = true;
    const auto mosaic = decorative_mosaic(picture, size, options);
    ASSERT_TRUE(mosaic.ok());
    ASSERT_EQ(mosaic->tiles.size(), 500U);
    const TileFigures& figures = *mosaic->tile_figures;
    EXPECT_LE(figures.overlap, 0.01) << seed;
    EXPECT_LE(figures.deviation_deg, 5) << seed;
    EXPECT_LE(figures.straddling, 0.02) << seed;  // none was measured
    EXPECT_GE(figures.coverage, 0.58) << seed;
    EXPECT_LE(figures.coverage, 0.64) << seed;
  }
}

// Faint and fading strokes: edges that end in the midst of the picture, and others close beside them.
cv::Mat strokes(cv::Size size) {
  cv::Mat out(size, CV_8UC3, cv::Scalar::all(120));
  cv::RNG random(11);
  for (int i = 0; i < 90; ++i) {
    const int row = random.uniform(0, size.height), column = random.uniform(0, size.width);
    const cv::Point2d from(column, row);
    const double turn = random.uniform(0.0, 6.28), length = random.uniform(40.0, 140.0);
    const int dark = random.uniform(0, 2), width = random.uniform(8, 24);
    for (int k = 0; k < 40; ++k) {  // from full contrast to none
      const cv::Point2d way(std::cos(turn) * length / 40, std::sin(turn) * length / 40);
      const int tone = 120 + (dark != 0 ? -1 : 1) * 80 * (40 - k) / 40;
      cv::line(out, from + way * k, from + way * (k + 1), cv::Scalar::all(tone), width);
    }
  }
  return out;
}

// Hausner's figure, on a picture that is full of what makes tiles straddle.
TEST(Mosaic, TilesAndCellsKeepOffEdgesThatEndOrLieSideBySide) {
  const cv::Mat picture = strokes({600, 450});
  const cv::Mat size = tile_sizes(cv::Mat(picture.size(), CV_32FC1, cv::Scalar(0)), 450, 2);
  double tiles = 0, cells = 0;
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    MosaicOptions options{450, 1, seed, 2};
    options.with_joints = true;
    const auto mosaic = decorative_mosaic(picture, size, options);
    ASSERT_TRUE(mosaic.ok());
    tiles += mosaic->tile_figures->straddling / 3, cells += mosaic->figures.straddling / 3;
    EXPECT_LE(mosaic->tile_figures->overlap, 0.01);
  }
  EXPECT_LE(tiles, 0.02);  // 0.0170 was measured
  EXPECT_LE(cells, 0.02);  // 0.0141 was measured
}

// 80 cells, smaller ones in the left half as far as `detail` says.
cv::Mat cells_of_portrait(std::uint64_t seed, float detail = 0) {
  const cv::Mat picture = portrait({240, 210});
  cv::Mat details(picture.size(), CV_32FC1, cv::Scalar(0));
  details.colRange(0, 120).setTo(detail);
  const cv::Mat size = tile_sizes(details, 80, 2);
  const auto mosaic = decorative_mosaic(picture, size, {80, 1, seed, 2});
  return mosaic.ok() ? mosaic->labels : cv::Mat();
}

RC_GTEST_PROP(Mosaic, CellsAreFabricable, ()) {
  const cv::Mat labels = cells_of_portrait(*rc::gen::arbitrary<std::uint64_t>());
  RC_ASSERT(!labels.empty());
  const FabricableOptions options{{1.5_mm, SquareMillimetres(12)}, 7_mm, Smoothness::kG0, 2};
  const Result<Partition> partition = fabricable_partition(labels, 60_mm, 52.5_mm, options);
  RC_ASSERT(partition.ok());
  expect_exact_cover(*partition);
  expect_fabricable(*partition, options.limits);
  RC_ASSERT(partition->faces.size() >= 68U && partition->faces.size() <= 92U);
}

// A piece's back as it may lie on the bed: turned over about the artwork's horizontal, then turned by `angle`.
Result<Mark> mark_on_back(const std::string& mark, const Ring<ArtworkFrame>& outline, Radians angle) {
  const double c = std::cos(angle.count()), s = std::sin(angle.count());
  Ring<BedFrame> back;
  for (const auto& p : outline) {
    const double x = p.x.count(), y = -p.y.count();
    back.push_back(point<BedFrame>(c * x - s * y, s * x + c * y));
  }
  return lay_out_mark(mark, back, angle - degrees(90));
}

// Without being asked, one in fourteen would have none.
TEST(Mosaic, CellsHaveRoomForTheirMarks) {
  const FabricableOptions options{{1.5_mm, SquareMillimetres(8)}, 7_mm, Smoothness::kG0, 2, "A"};
  for (const std::uint64_t seed : {11U, 12U, 13U, 14U}) {
    const Result<Partition> partition = fabricable_partition(cells_of_portrait(seed, 1), 52_mm, 45.5_mm, options);
    ASSERT_TRUE(partition.ok());
    expect_exact_cover(*partition);
    expect_fabricable(*partition, options.limits);
    for (std::size_t f = 0; f < partition->faces.size(); ++f) {
      const std::string mark = "A" + std::to_string(f + 1);
      const Ring<ArtworkFrame> outline = outline_of(*partition, f);
      EXPECT_TRUE(has_room_for_mark(mark, outline)) << mark << " of seed " << seed;
      EXPECT_TRUE(mark_on_back(mark, outline, degrees(37.0 * static_cast<double>(f))).ok())
          << mark << " of seed " << seed;
    }
    EXPECT_GE(partition->faces.size(), 65U) << seed;
  }
}

}  // namespace
}  // namespace veneer::planner
