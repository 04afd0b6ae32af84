#include "drivers/sim/proof/picture_proof.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace veneer::proof {
namespace {

constexpr double kBlock = 2;                 // mm
constexpr double kComparable = 0.6;          // of a piece's blocks, that another place has too
constexpr double kNoise = 0.5;               // grey levels, of a scan: few blocks of plain wood differ by no more
constexpr double kLightness = 20;            // grey levels: twice what the light over a scanner's glass differs by
const cv::Vec3d kGrey(0.114, 0.587, 0.299);  // of BGR, ITU-R BT.601
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

cv::Mat grey_of(const cv::Mat& picture) {
  cv::Mat grey;
  cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
  grey.convertTo(grey, CV_32F);
  return grey;
}

cv::Mat at_75_dpi(const cv::Mat& picture, double width_mm, double height_mm) {
  const cv::Size size(std::max(11, static_cast<int>(std::lround(width_mm * 75 / 25.4))),
                      std::max(11, static_cast<int>(std::lround(height_mm * 75 / 25.4))));
  cv::Mat out;
  cv::resize(picture, out, size, 0, 0, cv::INTER_AREA);
  return out;
}

cv::Mat blurred(const cv::Mat& picture) {
  cv::Mat out;
  cv::GaussianBlur(picture, out, {11, 11}, 1.5);
  return out;
}

// The mean of SSIM, `a` under the gain and offset that bring it nearest to `b`.
double ssim(cv::Mat a, const cv::Mat& b) {
  cv::Scalar mean_a;
  cv::Scalar mean_b;
  cv::Scalar deviation_a;
  cv::meanStdDev(a, mean_a, deviation_a);
  mean_b = cv::mean(b);
  const double variance = deviation_a[0] * deviation_a[0];
  const double covariance = cv::mean((a - mean_a[0]).mul(b - mean_b[0]))[0];
  const double gain = variance > 0 ? covariance / variance : 1;
  a = (a - mean_a[0]) * gain + mean_b[0];
  const cv::Mat ma = blurred(a);
  const cv::Mat mb = blurred(b);
  const cv::Mat va = blurred(a.mul(a)) - ma.mul(ma);
  const cv::Mat vb = blurred(b.mul(b)) - mb.mul(mb);
  const cv::Mat cab = blurred(a.mul(b)) - ma.mul(mb);
  const double c1 = 0.01 * 255 * 0.01 * 255;
  const double c2 = 0.03 * 255 * 0.03 * 255;
  const cv::Mat above = (2 * ma.mul(mb) + c1).mul(2 * cab + c2);
  const cv::Mat below = (ma.mul(ma) + mb.mul(mb) + c1).mul(va + vb + c2);
  return cv::mean(above / below)[0];
}

// Of pairs of numbers.
struct Moments {
  double n = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;

  void add(double x, double y) { n += 1, a += x, b += y, aa += x * x, bb += y * y, ab += x * y; }
  double variance_of_a() const { return std::max(0.0, aa / n - a / n * a / n); }
  double variance_of_b() const { return std::max(0.0, bb / n - b / n * b / n); }
  double covariance() const { return ab / n - a / n * b / n; }
  double correlation() const {
    const double variances = variance_of_a() * variance_of_b();
    return variances > 0 ? covariance() / std::sqrt(variances) : 0;
  }
  double difference() const { return std::sqrt(std::max(0.0, variance_of_a() + variance_of_b() - 2 * covariance())); }
  double lightness() const { return std::abs(a - b) / n; }
};

}  // namespace

double picture_ssim(const cv::Mat& assembled, const cv::Mat& preview, double width_mm, double height_mm) {
  return ssim(at_75_dpi(grey_of(assembled), width_mm, height_mm), at_75_dpi(grey_of(preview), width_mm, height_mm));
}

double picture_ssim_joints_filled(const Assembled& assembled, const cv::Scalar& table, const cv::Mat& preview,
                                  double width_mm, double height_mm) {
  cv::Mat a = at_75_dpi(grey_of(assembled.picture), width_mm, height_mm);
  cv::Mat wood;  // share of each pixel
  assembled.cover.convertTo(wood, CV_32F, 1 / 255.0);
  wood = at_75_dpi(wood, width_mm, height_mm);
  const double table_grey = grey_of(cv::Mat(1, 1, CV_8UC3, table)).at<float>(0, 0);
  const cv::Mat of_wood = (a - (1 - wood) * table_grey) / wood;
  of_wood.copyTo(a, wood > 0.5);
  return ssim(a, at_75_dpi(grey_of(preview), width_mm, height_mm));
}

BlockMeans::BlockMeans(const cv::Mat& integral, const cv::Mat& mask_integral, sim::Vec2 centre_px, sim::Vec2 half_px,
                       double px_per_mm) {
  const double block = kBlock * px_per_mm;
  columns_ = static_cast<int>(std::ceil(half_px.x / block));
  rows_ = static_cast<int>(std::ceil(half_px.y / block));
  const auto sum = [&]<class Value>(const cv::Mat& table, const cv::Rect& r, Value) {
    return table.at<Value>(r.y, r.x) + table.at<Value>(r.br().y, r.br().x) - table.at<Value>(r.y, r.br().x) -
           table.at<Value>(r.br().y, r.x);
  };
  for (int row = -rows_; row < rows_; ++row)
    for (int column = -columns_; column < columns_; ++column) {
      // Never beyond the piece itself: a row of pixels of a neighbour of another wood outweighs a plain piece's grain.
      const int x0 =
          static_cast<int>(std::max(std::ceil(centre_px.x - half_px.x), std::round(centre_px.x + column * block)));
      const int x1 = static_cast<int>(
          std::min(std::floor(centre_px.x + half_px.x), std::round(centre_px.x + (column + 1) * block)));
      const int y0 =
          static_cast<int>(std::max(std::ceil(centre_px.y - half_px.y), std::round(centre_px.y + row * block)));
      const int y1 =
          static_cast<int>(std::min(std::floor(centre_px.y + half_px.y), std::round(centre_px.y + (row + 1) * block)));
      const bool within = x0 >= 0 && y0 >= 0 && x1 < integral.cols && y1 < integral.rows && x1 > x0 && y1 > y0;
      Block mean{{}, kNone};
      if (within) {
        const cv::Rect box(x0, y0, x1 - x0, y1 - y0);
        const double weight = sum(mask_integral, box, double());
        if (weight >= 0.6 * block * block) {
          const cv::Vec3d colour = sum(integral, box, cv::Vec3d()) / weight;
          mean = {{colour[0], colour[1], colour[2]}, colour.dot(kGrey)};
        }
      }
      blocks_.push_back(mean);
    }
}

const BlockMeans::Block& BlockMeans::at(int column, int row) const {
  const auto width = static_cast<std::ptrdiff_t>(columns_), height = static_cast<std::ptrdiff_t>(rows_);
  return blocks_[static_cast<std::size_t>((row + height) * 2 * width + column + width)];
}

BlockMeans BlockMeans::mirrored() const {
  BlockMeans out = *this;
  for (int row = 0; row < 2 * rows_; ++row) {
    const auto begin = out.blocks_.begin() + static_cast<std::ptrdiff_t>(row) * 2 * columns_;
    std::reverse(begin, begin + 2 * static_cast<std::ptrdiff_t>(columns_));
  }
  return out;
}

double BlockMeans::shared_with(const BlockMeans& other) const {
  double own = 0, shared = 0;
  for (int row = -rows_; row < rows_; ++row)
    for (int column = -columns_; column < columns_; ++column) {
      if (std::isnan(at(column, row).grey)) continue;
      own += 1;
      const bool reaches =
          row >= -other.rows_ && row < other.rows_ && column >= -other.columns_ && column < other.columns_;
      if (reaches && !std::isnan(other.at(column, row).grey)) shared += 1;
    }
  return own > 0 ? shared / own : 0;
}

BlockMeans::Agreement BlockMeans::with(const BlockMeans& other, const BlockMeans& where) const {
  const int columns = std::min({columns_, other.columns_, where.columns_});
  const int rows = std::min({rows_, other.rows_, where.rows_});
  Moments grey;
  Moments colour;
  for (int row = -rows; row < rows; ++row)
    for (int column = -columns; column < columns; ++column) {
      const Block& a = at(column, row);
      const Block& b = other.at(column, row);
      if (std::isnan(a.grey) || std::isnan(b.grey) || std::isnan(where.at(column, row).grey)) continue;
      grey.add(a.grey, b.grey);
      for (std::size_t k = 0; k < 3; ++k) colour.add(a.colour[k], b.colour[k]);
    }
  if (grey.n < 4) return {0, 0, std::numeric_limits<double>::infinity(), 0, 0};
  return {colour.correlation(), grey.correlation(), grey.difference(), grey.lightness(), static_cast<int>(grey.n)};
}

bool BlockMeans::Rivals::other_is_nearer_than_by_chance() const {
  constexpr double kNearlyOne = 1 - 1e-9;
  const auto z = [&](const Agreement& agreement) {
    return std::atanh(std::clamp(agreement.correlation, -kNearlyOne, kNearlyOne));
  };
  const int blocks = std::min(own.blocks, other.blocks);
  return other_is_nearer() && z(other) - z(own) > std::sqrt(2.0 / std::max(1, blocks - 3));
}

std::optional<BlockMeans::Rivals> BlockMeans::rivals(const BlockMeans& other, const BlockMeans& own,
                                                     const BlockMeans& seen) const {
  if (shared_with(other) < kComparable) return std::nullopt;
  const Rivals rivals{seen.with(own, other), with(other, own)};
  if (std::isinf(rivals.own.difference) || std::isinf(rivals.other.difference)) return std::nullopt;
  return rivals;
}

std::optional<BlockMeans::Rivals> BlockMeans::rather(const BlockMeans& other, const BlockMeans& own,
                                                     const BlockMeans& seen) const {
  const auto both = rivals(other, own, seen);
  if (!both || both->other.lightness > kLightness) return std::nullopt;
  if (both->other.correlation <= both->own.correlation) return std::nullopt;
  const double clearly = shared_with(other) < 1 || other.shared_with(*this) < 1 ? kNoise : 0;
  if (both->other.difference >= both->own.difference - clearly) return std::nullopt;
  return both;
}

}  // namespace veneer::proof
