#include "drivers/sim/proof/picture_proof.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

namespace veneer::proof {
namespace {

cv::Mat table_of(const cv::Mat& grey) {
  cv::Mat table;
  cv::integral(grey, table, CV_64F);
  return table;
}

// Two patches of 12 x 11.84 mm at 150 dpi: a plain one, and above it one of a far darker wood.
TEST(BlockMeans, OfAPlainPieceAreNotDisturbedByItsNeighbours) {
  constexpr double kPxPerMm = 150 / 25.4;
  const sim::Vec2 half{6 * kPxPerMm, 5.92 * kPxPerMm};
  cv::Mat preview(140, 71, CV_32F, cv::Scalar(20));
  const sim::Vec2 centre{half.x, 140 - half.y};
  for (int r = static_cast<int>(centre.y - half.y + 0.5); r < preview.rows; ++r)
    for (int c = 0; c < preview.cols; ++c) preview.at<float>(r, c) = 150 + 0.03F * static_cast<float>(r + c);
  cv::Mat mask(preview.size(), CV_32F, cv::Scalar(0));
  mask(cv::Range(71, 139), cv::Range(1, 70)).setTo(1);
  cv::Mat piece = preview.mul(mask);
  const BlockMeans place(table_of(preview), centre, half, kPxPerMm);
  const BlockMeans mine(table_of(piece), table_of(mask), centre, half, kPxPerMm);
  EXPECT_GT(mine.with(place).correlation, 0.97);
  EXPECT_LT(mine.with(place).difference, 0.2);
}

}  // namespace
}  // namespace veneer::proof
