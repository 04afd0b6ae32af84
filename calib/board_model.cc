#include "calib/board_model.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace veneer::calib {
namespace {

constexpr double kNothing = 20;                 // grey levels of the brightest channel where nothing is seen
constexpr double kRimFrom = 1.2, kRimTo = 6.5;  // mm from the sheet's edge
constexpr int kFeatures = 5;

using Feature = Eigen::Matrix<double, kFeatures, 1>;

double nth(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

void to_logarithms(const cv::Mat& bgr, std::array<cv::Mat, 3>& planes) {
  std::array<float, 256> logarithm{};
  for (std::size_t i = 0; i < 256; ++i)
    logarithm[i] = static_cast<float>(std::log(static_cast<double>(i) + kScannerBlack));
  for (auto& plane : planes) plane.create(bgr.size(), CV_32FC1);
  for (int r = 0; r < bgr.rows; ++r) {
    const auto* from = bgr.ptr<cv::Vec3b>(r);
    for (int c = 0; c < bgr.cols; ++c) {
      const float b = logarithm[from[c][0]], g = logarithm[from[c][1]], red = logarithm[from[c][2]];
      planes[0].at<float>(r, c) = (b + g + red) / 3;
      planes[1].at<float>(r, c) = red - g;
      planes[2].at<float>(r, c) = g - b;
    }
  }
}

struct RimSample {
  int c = 0, r = 0;
  std::array<double, 3> value{};
  bool board = true;
};

std::vector<RimSample> sample_rim(const std::array<cv::Mat, 3>& planes, const cv::Mat& fiducials, double px) {
  std::vector<RimSample> out;
  const cv::Size size = planes[0].size();
  const int from = static_cast<int>(kRimFrom * px), to = static_cast<int>(kRimTo * px);
  for (int r = from; r < size.height - from; r += 2)
    for (int c = from; c < size.width - from; c += 2) {
      if (std::min({r, c, size.height - 1 - r, size.width - 1 - c}) > to) {
        c = std::max(c, size.width - 1 - to - 2);
        continue;
      }
      if (fiducials.at<std::uint8_t>(r, c) != 0) continue;
      out.push_back({c, r, {planes[0].at<float>(r, c), planes[1].at<float>(r, c), planes[2].at<float>(r, c)}});
    }
  return out;
}

// Light falls off smoothly: a quadratic over the map, in logarithms.
Eigen::Matrix<double, 6, 1> terms(double c, double r, const cv::Size& size) {
  const double u = 2 * c / size.width - 1, v = 2 * r / size.height - 1;
  Eigen::Matrix<double, 6, 1> t;
  t << 1, u, v, u * u, u * v, v * v;
  return t;
}

Eigen::Matrix<double, 6, 1> fit_light(const std::vector<RimSample>& rim, std::size_t plane, const cv::Size& size) {
  Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Identity() * 1e-6;
  Eigen::Matrix<double, 6, 1> right = Eigen::Matrix<double, 6, 1>::Zero();
  for (const RimSample& s : rim) {
    if (!s.board) continue;
    const auto t = terms(s.c, s.r, size);
    normal += t * t.transpose(), right += t * s.value[plane];
  }
  return normal.ldlt().solve(right);
}

// The commonest value, by the shortest stretch that holds half of them.
double half_sample_mode(std::vector<double> values) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  std::size_t from = 0, count = values.size();
  while (count > 3) {
    const std::size_t half = (count + 1) / 2;
    std::size_t best = from;
    for (std::size_t i = from; i + half <= from + count; ++i)
      if (values[i + half - 1] - values[i] < values[best + half - 1] - values[best]) best = i;
    from = best, count = half;
  }
  return values[from + count / 2];
}

// Marks what belongs to the commonest material, and evens out its light; `board` becomes what is then zero.
double even_out(std::array<cv::Mat, 3>& planes, std::vector<RimSample>& rim, std::array<double, 3>& board) {
  const cv::Size size = planes[0].size();
  constexpr std::array<double, 3> kWide = {0.30, 0.10, 0.10}, kTight = {0.12, 0.06, 0.06};
  for (std::size_t k = 0; k < 3; ++k) {
    std::vector<double> values;
    for (const auto& s : rim)
      if (s.board) values.push_back(s.value[k]);
    const double mode = half_sample_mode(std::move(values));
    for (auto& s : rim) s.board = s.board && std::abs(s.value[k] - mode) < kWide[k];
  }
  std::array<Eigen::Matrix<double, 6, 1>, 3> light;
  for (int pass = 0; pass < 3; ++pass) {
    for (std::size_t k = 0; k < 3; ++k) light[k] = fit_light(rim, k, size);
    std::array<double, 3> reach{};
    for (std::size_t k = 0; k < 3; ++k) {
      std::vector<double> off;
      for (const auto& s : rim)
        if (s.board) off.push_back(std::abs(s.value[k] - light[k].dot(terms(s.c, s.r, size))));
      reach[k] = std::max(kTight[k], 4 * 1.4826 * nth(std::move(off), 0.5));
    }
    for (auto& s : rim) {
      const auto t = terms(s.c, s.r, size);
      s.board = true;
      for (std::size_t k = 0; k < 3; ++k) s.board = s.board && std::abs(s.value[k] - light[k].dot(t)) < reach[k];
    }
  }
  for (std::size_t k = 0; k < 3; ++k)
    for (int r = 0; r < size.height; ++r)
      for (int c = 0; c < size.width; ++c)
        planes[k].at<float>(r, c) -= static_cast<float>(light[k].dot(terms(c, r, size)));
  for (std::size_t k = 0; k < 3; ++k) board[k] = light[k].dot(terms(0.5 * size.width, 0.5 * size.height, size));
  double seen = 0;
  for (auto& s : rim) seen += s.board ? 1 : 0;
  return rim.empty() ? 0 : seen / static_cast<double>(rim.size());
}

// Colour and texture of square millimetres: means of the planes, and how lively lightness is along either axis.
std::vector<cv::Mat> block_features(const std::array<cv::Mat, 3>& planes, double px) {
  const cv::Size blocks(std::max(1, static_cast<int>(planes[0].cols / px)),
                        std::max(1, static_cast<int>(planes[0].rows / px)));
  std::vector<cv::Mat> out(kFeatures);
  for (std::size_t k = 0; k < 3; ++k) cv::resize(planes[k], out[k], blocks, 0, 0, cv::INTER_AREA);
  cv::Mat slope;
  for (int axis = 0; axis < 2; ++axis) {
    cv::Sobel(planes[0], slope, CV_32F, axis == 0 ? 1 : 0, axis == 0 ? 0 : 1, 3, 0.125);
    slope = cv::abs(slope) + 0.004;
    cv::log(slope, slope);
    cv::resize(slope, out[static_cast<std::size_t>(3 + axis)], blocks, 0, 0, cv::INTER_AREA);
  }
  return out;
}

}  // namespace

BoardView view_board(const WorkMap& work, const cv::Mat& fiducials) {
  BoardView view;
  view.px_per_mm = work.px_per_mm;
  to_logarithms(work.bgr, view.planes);
  cv::inRange(work.bgr, cv::Scalar::all(0), cv::Scalar::all(kNothing), view.black);
  std::vector<RimSample> rim = sample_rim(view.planes, fiducials, work.px_per_mm);
  view.rim_share = even_out(view.planes, rim, view.board);
  double levels = 0, count = 0;
  for (const auto& s : rim)
    if (s.board) levels += s.value[0], count += 1;
  if (count > 0) view.level = std::exp(levels / count);
  for (std::size_t k = 0; k < 3; ++k) {
    std::vector<double> off;
    for (const auto& s : rim)
      if (s.board) off.push_back(std::abs(view.planes[k].at<float>(s.r, s.c)));
    view.spread[k] = std::max(0.004, 1.4826 * nth(std::move(off), 0.5));
  }

  const std::vector<cv::Mat> features = block_features(view.planes, work.px_per_mm);
  const cv::Size blocks = features[0].size();
  const auto at = [&](int r, int c) {
    Feature f;
    for (int k = 0; k < kFeatures; ++k) f[k] = features[static_cast<std::size_t>(k)].at<float>(r, c);
    return f;
  };
  cv::Mat marked;
  cv::resize(fiducials, marked, blocks, 0, 0, cv::INTER_AREA);
  std::vector<Feature> board;
  for (int r = 0; r < blocks.height; ++r)
    for (int c = 0; c < blocks.width; ++c) {
      const double rim_mm = std::min({r, c, blocks.height - 1 - r, blocks.width - 1 - c});
      if (rim_mm < kRimFrom || rim_mm > kRimTo || marked.at<std::uint8_t>(r, c) != 0) continue;
      const Feature f = at(r, c);
      if (std::abs(f[0]) < 0.12 && std::abs(f[1]) < 0.06 && std::abs(f[2]) < 0.06) board.push_back(f);
    }
  Feature mean = Feature::Zero();
  Eigen::Matrix<double, kFeatures, kFeatures> covariance = Eigen::Matrix<double, kFeatures, kFeatures>::Zero();
  for (int pass = 0; pass < 3 && board.size() > 50; ++pass) {
    Feature sum = Feature::Zero();
    for (const auto& f : board) sum += f;
    mean = sum / static_cast<double>(board.size());
    covariance.setZero();
    for (const auto& f : board) covariance += (f - mean) * (f - mean).transpose() / static_cast<double>(board.size());
    Feature floor;
    floor << 0.01, 0.006, 0.006, 0.08, 0.08;
    covariance += floor.cwiseAbs2().asDiagonal();
    const auto inverse = covariance.inverse().eval();
    std::erase_if(board, [&](const Feature& f) { return (f - mean).dot(inverse * (f - mean)) > 25; });
  }
  view.unlike = cv::Mat::zeros(blocks, CV_32FC1);
  if (board.size() <= 50) return view;
  const auto inverse = covariance.inverse().eval();
  for (int r = 0; r < blocks.height; ++r)
    for (int c = 0; c < blocks.width; ++c) {
      const Feature off = at(r, c) - mean;
      view.unlike.at<float>(r, c) = static_cast<float>(std::sqrt(off.dot(inverse * off)));
    }
  return view;
}

}  // namespace veneer::calib
