// Layouts without rows: labels cleaned and traced, direction fields, centroidal Voronoi diagrams, mosaics.
#include "planner/layout/mosaic.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <set>
#include <string>

#include "planner/cutting/marks.h"
#include "planner/layout/centroidal_voronoi.h"
#include "planner/layout/direction_field.h"
#include "planner/layout/edge_ends.h"
#include "planner/layout/fabricable_partition.h"
#include "planner/layout/label_regions.h"
#include "planner/layout/tone_areas.h"
#include "tests/planner/layout/partition_checks.h"

namespace veneer::planner {
namespace {

TEST(ToneGroups, LieWhereThePicturesTonesDo) {
  std::array<double, 256> histogram{};
  for (const int tone : {20, 22, 120, 124, 230}) histogram[static_cast<std::size_t>(tone)] = 100;
  const std::vector<int> ends = tone_groups(histogram, 3);
  ASSERT_EQ(ends.size(), 3U);
  EXPECT_TRUE(ends[0] >= 22 && ends[0] < 120) << ends[0];
  EXPECT_TRUE(ends[1] >= 124 && ends[1] < 230) << ends[1];
  EXPECT_EQ(ends[2], 255);
  histogram.fill(0);
  histogram[20] = histogram[120] = 250, histogram[200] = 9500;  // a ground that is nearly all of the picture
  const std::vector<int> parted = tone_groups(histogram, 6);
  ASSERT_EQ(parted.size(), 3U);
  EXPECT_TRUE(parted[0] >= 20 && parted[0] < 120 && parted[1] >= 120 && parted[1] < 200) << parted[0];
  histogram.fill(0);
  histogram[90] = 7;  // a plain picture
  EXPECT_EQ(tone_groups(histogram, 6), std::vector<int>{255});
}

TEST(ToneAreas, AreWhatIsNotMuchSmallerThanAPatch) {
  cv::Mat picture(120, 120, CV_8UC3, cv::Scalar::all(200));
  cv::circle(picture, {60, 60}, 30, cv::Scalar::all(60), cv::FILLED);
  cv::circle(picture, {20, 20}, 2, cv::Scalar::all(60), cv::FILLED);  // a speck
  const cv::Mat areas = tone_areas(picture, 20, 2);
  EXPECT_EQ(areas.at<int>(60, 60), 0);
  EXPECT_EQ(areas.at<int>(20, 20), 1);
  EXPECT_EQ(areas.at<int>(60, 100), 1);
  EXPECT_NEAR(static_cast<double>(areas.total()) - cv::countNonZero(areas), 3.1416 * 30 * 30, 150);
}

constexpr FabricationLimits kLimits{1.5_mm, SquareMillimetres(4)};

// A cell of random sites: regions of all sizes, and specks.
cv::Mat random_labels(cv::Size size, int sites, int specks, std::uint64_t seed) {
  cv::RNG random(seed);
  cv::Mat seeds(size, CV_8UC1, cv::Scalar(255)), distance, labels;
  for (int i = 0; i < sites; ++i) {
    const cv::Point site{random.uniform(0, size.width), random.uniform(0, size.height)};
    seeds.at<std::uint8_t>(site) = 0;
  }
  cv::distanceTransform(seeds, distance, labels, cv::DIST_L2, cv::DIST_MASK_5, cv::DIST_LABEL_PIXEL);
  for (int i = 0; i < specks; ++i) {
    const cv::Point middle{random.uniform(0, size.width), random.uniform(0, size.height)};
    const cv::Size axes{random.uniform(0, 9), random.uniform(0, 9)};
    const int turn = random.uniform(0, 180), label = 1000 + random.uniform(0, 5), width = random.uniform(1, 3);
    cv::ellipse(labels, middle, axes, turn, 0, 360, cv::Scalar(label), width);
  }
  return labels;
}

RC_GTEST_PROP(FabricablePartition, OfAnyLabelsCoversTheArtworkInPiecesThatCanBeCut, ()) {
  const cv::Size size{*rc::gen::inRange(20, 200), *rc::gen::inRange(20, 200)};
  const int sites = *rc::gen::inRange(1, 60), specks = *rc::gen::inRange(0, 12);
  const cv::Mat labels = random_labels(size, sites, specks, *rc::gen::arbitrary<std::uint64_t>());
  const double mm_per_px = *rc::gen::inRange(20, 70) / 100.0;
  const Millimetres width(size.width * mm_per_px), height(size.height * mm_per_px * 1.01);
  const Smoothness smoothness = *rc::gen::element(Smoothness::kG0, Smoothness::kG1);
  const FabricableOptions options{kLimits, 10_mm, smoothness, 2};
  const Result<Partition> partition = fabricable_partition(labels.clone(), width, height, options);
  RC_ASSERT(partition.ok());
  expect_exact_cover(*partition);
  expect_fabricable(*partition, kLimits);
  const FabricableOptions alone{kLimits, 10_mm, smoothness, 1};
  RC_ASSERT(*fabricable_partition(labels.clone(), width, height, alone) == *partition);
}

RC_GTEST_PROP(LabelRegions, AreSimplyConnectedAndNumberedInReadingOrder, ()) {
  const cv::Size size{*rc::gen::inRange(1, 40), *rc::gen::inRange(1, 40)};
  cv::Mat labels(size, CV_32SC1);
  cv::RNG random(*rc::gen::arbitrary<std::uint64_t>());
  random.fill(labels, cv::RNG::UNIFORM, 0, *rc::gen::inRange(1, 6));
  const int count = clean_regions(labels, {3, 6});
  int next = 0;
  for (int r = 0; r < labels.rows; ++r)
    for (int c = 0; c < labels.cols; ++c) {
      RC_ASSERT(labels.at<int>(r, c) <= next);
      next = std::max(next, labels.at<int>(r, c) + 1);
    }
  RC_ASSERT(next == count);
  for (int region = 0; region < count; ++region) {
    cv::Mat mask, numbers;
    cv::copyMakeBorder(labels == region, mask, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
    RC_ASSERT(cv::connectedComponents(mask, numbers, 4) == 2);
    RC_ASSERT(cv::connectedComponents(~mask, numbers, 4) == 2);
  }
}

TEST(LabelRegions, SmallPartsGoToTheNeighbourWithTheLongestBorder) {
  cv::Mat labels(30, 30, CV_32SC1, cv::Scalar(0));
  labels.colRange(20, 30).setTo(1);
  labels(cv::Rect(18, 10, 5, 3)).setTo(2);  // 3 of its pixels look to the left, 3 to the right; above and below 2 to 3
  EXPECT_EQ(clean_regions(labels, {0, 20}), 2);
  EXPECT_EQ(labels.at<int>(11, 20), 1);
}

TEST(LabelRegions, WhatSurroundsAnotherIsCutInTwo) {
  cv::Mat labels(60, 60, CV_32SC1, cv::Scalar(0));
  labels(cv::Rect(20, 20, 20, 20)).setTo(1);
  EXPECT_EQ(clean_regions(labels, {4, 20}), 3);
  EXPECT_EQ(labels.at<int>(30, 30), labels.at<int>(22, 22));
}

TEST(LabelRegions, WhatTookInAnotherStays) {
  cv::Mat labels(10, 30, CV_32SC1, cv::Scalar(0));
  labels.colRange(10, 14).setTo(1);
  labels.colRange(14, 18).setTo(2);
  labels.colRange(18, 30).setTo(3);
  labels(cv::Rect(14, 0, 4, 1)).setTo(1);  // so that region 2 has its longest border with 1
  absorb_regions(labels, {2, 1});
  EXPECT_EQ(labels.at<int>(5, 12), 1) << "it is larger now, and asked about again";
  EXPECT_EQ(labels.at<int>(5, 16), 1);
}

TEST(LabelRegions, ANeckIsCutThrough) {
  cv::Mat labels(40, 80, CV_32SC1, cv::Scalar(0));
  labels(cv::Rect(5, 5, 30, 30)).setTo(1);
  labels(cv::Rect(45, 5, 30, 30)).setTo(1);
  labels(cv::Rect(35, 19, 10, 2)).setTo(1);
  clean_regions(labels, {5, 20});
  EXPECT_NE(labels.at<int>(20, 20), labels.at<int>(20, 60));
}

TEST(LabelRegions, StrayPartsDoNotComeBackOverABarrier) {
  cv::Mat labels(20, 30, CV_32SC1, cv::Scalar(0)), barrier(20, 30, CV_8UC1, cv::Scalar(0));
  labels.colRange(15, 30).setTo(1);
  barrier.col(12).setTo(255);  // cuts three columns off the left region
  absorb_stray_parts(labels, barrier);
  EXPECT_EQ(labels.at<int>(5, 5), labels.at<int>(5, 11));
  EXPECT_EQ(labels.at<int>(5, 13), labels.at<int>(5, 20));
  EXPECT_NE(labels.at<int>(5, 11), labels.at<int>(5, 13));
}

// A strip between two barriers, open at its lower end alone.
TEST(LabelRegions, StrayPartsGoOverABarrierOnlyWhereTheyMust) {
  cv::Mat labels(20, 40, CV_32SC1, cv::Scalar(0)), barrier(20, 40, CV_8UC1, cv::Scalar(0));
  labels.colRange(15, 40).setTo(1);
  labels.rowRange(17, 20).setTo(2);
  for (const int c : {12, 15}) barrier(cv::Rect(c, 0, 1, 18)).setTo(255);
  cv::Mat closed = labels.clone();
  absorb_stray_parts(labels, barrier);
  EXPECT_EQ(labels.at<int>(5, 13), labels.at<int>(19, 13)) << "not to the right, where its border is longer";
  barrier.row(17).setTo(255);
  absorb_stray_parts(closed, barrier);
  EXPECT_EQ(closed.at<int>(5, 13), closed.at<int>(5, 30)) << "there is no other way";
}

TEST(EdgeEnds, GoOnStraight) {
  cv::Mat edges(60, 80, CV_8UC1, cv::Scalar(0)), longer = edges.clone();
  cv::line(edges, {20, 30}, {50, 30}, cv::Scalar(255));
  cv::line(longer, {12, 30}, {58, 30}, cv::Scalar(255));
  EXPECT_EQ(cv::countNonZero(with_longer_ends(edges, 8) != longer), 0);
  cv::line(edges, {35, 30}, {35, 59}, cv::Scalar(255));  // from its middle to the border
  cv::line(longer, {35, 30}, {35, 59}, cv::Scalar(255));
  EXPECT_EQ(cv::countNonZero(with_longer_ends(edges, 8) != longer), 0);
  edges.setTo(0), longer.setTo(0);
  cv::line(edges, {30, 30}, {40, 20}, cv::Scalar(255));  // aslant
  cv::line(longer, {24, 36}, {46, 14}, cv::Scalar(255));
  EXPECT_EQ(cv::countNonZero(with_longer_ends(edges, 6 * std::sqrt(2.0)) != longer), 0);
  edges.setTo(0);
  cv::circle(edges, {40, 30}, 20, cv::Scalar(255));
  EXPECT_EQ(cv::countNonZero(with_longer_ends(edges, 8) != edges), 0) << "it has no end";
}

// A stem below a bar, as where the detector of edges lost their crossing: its end is led on to the bar, and not
// through.
TEST(EdgeEnds, AreLedOnAsFarAsTheNextEdge) {
  for (const int gap : {1, 2, 5}) {
    cv::Mat edges(80, 80, CV_8UC1, cv::Scalar(0));
    cv::line(edges, {0, 30}, {79, 30}, cv::Scalar(255));
    cv::Mat longer = edges.clone();
    cv::line(edges, {40, 31 + gap}, {40, 79}, cv::Scalar(255));
    cv::line(longer, {40, 30}, {40, 79}, cv::Scalar(255));
    EXPECT_EQ(cv::countNonZero(with_longer_ends(edges, 12) != longer), 0) << gap;
  }
  // Aslant, where the pixels of the two edges would pass between one another.
  for (const int shift : {0, 1}) {
    cv::Mat edges(80, 80, CV_8UC1, cv::Scalar(0));
    cv::line(edges, {10, 10}, {69, 69}, cv::Scalar(255));
    cv::line(edges, {37 + shift, 43}, {12 + shift, 68}, cv::Scalar(255));
    const cv::Mat longer = with_longer_ends(edges, 12);
    EXPECT_EQ(longer.at<std::uint8_t>(42, 38 + shift), 255) << shift;
    for (int r = 12; r < 70; ++r)
      for (int c = r + 1; c < 68; ++c) EXPECT_EQ(longer.at<std::uint8_t>(r, c), 0) << shift << ": " << c << ", " << r;
  }
}

TEST(DirectionField, PointsAcrossTheNearestEdgeUpToQuarterTurns) {
  cv::Mat edges(200, 200, CV_8UC1, cv::Scalar(0));
  cv::line(edges, {60, 160}, {140, 80}, cv::Scalar(255));  // up to the right, at 45 degrees
  const DirectionField field = direction_field(edges, 3);
  EXPECT_NEAR(std::abs(static_cast<double>(field.angle.at<float>(110, 90))), std::atan(1.0), 0.05);
  EXPECT_NEAR(static_cast<double>(field.angle.at<float>(100, 4)), 0, 0.05) << "the border is an edge too";
  EXPECT_EQ(field.distance.at<float>(160, 60), 0.0F);
}

TEST(DirectionField, FindsTheEdgeOfADiscAndNoneInNoise) {
  cv::Mat picture(300, 300, CV_8UC3, cv::Scalar(90, 90, 90));
  cv::circle(picture, {150, 150}, 80, cv::Scalar(180, 180, 180), cv::FILLED);
  cv::Mat noise(picture.size(), CV_8UC3);
  cv::RNG random(7);
  random.fill(noise, cv::RNG::UNIFORM, 0, 12);
  picture += noise;
  const cv::Mat edges = salient_edges(picture, 24);
  EXPECT_GT(cv::countNonZero(edges), 400);
  for (int r = 0; r < edges.rows; ++r)
    for (int c = 0; c < edges.cols; ++c) {
      if (edges.at<std::uint8_t>(r, c) == 0) continue;
      EXPECT_NEAR(std::hypot(r - 150, c - 150), 80, 4);
    }
}

// A field without edges: tiles of one size, axes upright.
VoronoiField level_field(cv::Size size, int count) {
  const auto side = static_cast<float>(std::sqrt(static_cast<double>(size.area()) / count));
  return {cv::Mat(size, CV_32FC1, cv::Scalar(0)), cv::Mat(size, CV_32FC1, cv::Scalar(side)), {}};
}

TEST(CentroidalVoronoi, EverySiteRestsInTheMiddleOfItsCell) {
  const cv::Size size(240, 180);
  const VoronoiField field = level_field(size, 48);
  VoronoiOptions options;
  options.count = 48;
  const auto diagram = centroidal_voronoi(sampled_sites(field.size, 48, 3), field, options);
  ASSERT_TRUE(diagram.ok());
  EXPECT_LT(diagram->mean_move, 0.1);
  std::vector<double> x(48), y(48), n(48);
  for (int r = 0; r < size.height; ++r)
    for (int c = 0; c < size.width; ++c) {
      const auto i = static_cast<std::size_t>(diagram->labels.at<int>(r, c));
      x[i] += c + 0.5, y[i] += r + 0.5, ++n[i];
    }
  double off = 0;
  for (std::size_t i = 0; i < 48; ++i)
    off += std::hypot(x[i] / n[i] - diagram->sites[i].x, y[i] / n[i] - diagram->sites[i].y) / 48;
  EXPECT_LT(off, 0.15);
}

TEST(CentroidalVoronoi, CellsAreTheSameWhateverTheThreads) {
  const cv::Size size(130, 97);
  VoronoiField field = level_field(size, 20);
  for (int r = 0; r < size.height; ++r)
    for (int c = 0; c < size.width; ++c) {
      field.angle.at<float>(r, c) = static_cast<float>(r) * 0.01F;
      field.size.at<float>(r, c) *= 0.7F + 0.005F * static_cast<float>(c);
    }
  VoronoiOptions options;
  options.count = 20, options.most_iterations = 5, options.rest = 0;
  const auto one = centroidal_voronoi(sampled_sites(field.size, 20, 5), field, options);
  options.threads = 3;
  const auto three = centroidal_voronoi(sampled_sites(field.size, 20, 5), field, options);
  ASSERT_TRUE(one.ok() && three.ok());
  EXPECT_EQ(one->sites, three->sites);
  EXPECT_EQ(cv::countNonZero(one->labels != three->labels), 0);
  EXPECT_EQ(one->iterations, 5);
}

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

TEST(Mosaic, ATileKeepsToItsCellAndBecomesNoSmallerThanThatTakes) {
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
TEST(Mosaic, ATileThatLiesInItsCellStaysAsItIs) {
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
TEST(Mosaic, ATileKeepsToThePicture) {
  const cv::Mat labels(12, 60, CV_32SC1, cv::Scalar(0));
  const VoronoiField field{
      cv::Mat(labels.size(), CV_32FC1, cv::Scalar(0)), cv::Mat(labels.size(), CV_32FC1, cv::Scalar(20)), {}};
  const DisjointTile tile = disjoint_tiles(labels, field, 1)[0];
  EXPECT_NEAR(tile.length, 0.7 * kTileShare * 20, 1e-9) << "a twentieth at most beyond 12 pixels";
  EXPECT_NEAR(tile.middle.y, 6, 1e-9);
}

TEST(Mosaic, TheFiguresOfTilesAreThoseOfTheTiles) {
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
