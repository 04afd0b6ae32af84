// Sites that come to rest in the middle of their cells.
#include "planner/layout/centroidal_voronoi.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace veneer::planner {
namespace {

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

}  // namespace
}  // namespace veneer::planner
