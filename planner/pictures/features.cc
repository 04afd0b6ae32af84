#include "planner/pictures/features.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "planner/parallel.h"
#include "planner/pictures/wood_colours.h"

namespace veneer::planner {
namespace {

constexpr double kLargestEdge = 1.4143;

// Pictures are filtered in bands of so many pixels: what lies between two filters stays in the cache, and a stop is
// answered within a band.
constexpr int kBandPixels = 1 << 18;

std::vector<cv::Mat> intensity(const FilterInput& input, const PlanOptions& /*options*/) { return {input.intensity}; }

std::vector<cv::Mat> edge(const FilterInput& input, const PlanOptions& options) {
  return {edges_at_scale(input.grey, input.resolution.to_px(options.edge))};
}

// CIELAB without its lightness, which intensity stands for. 1 = 100 units, where black and white are 100 units apart;
// shifted because responses are not negative.
constexpr double kLabUnits = 100, kLabShift = 110, kLargestColour = 2.2;

std::vector<cv::Mat> colour(const FilterInput& input, const PlanOptions& /*options*/) {
  std::vector<cv::Mat> planes, out;
  cv::split(input.chroma.empty() ? chroma_of(input.bgr) : input.chroma, planes);
  for (const cv::Mat& plane : planes) {
    cv::Mat shifted = (plane + kLabShift) / kLabUnits;
    out.emplace_back(cv::min(cv::max(shifted, 0.0), kLargestColour));
  }
  return out;
}

// Leung and Malik's bank, reduced to what does not turn with the wood: the strongest answer of bars in six directions
// (dark or light alike) and the round spot filter, whose sign tells dark lines from light ones.
constexpr int kDirections = 6;
constexpr Millimetres kBarWavelength{1.0};
constexpr double kShortestWavelength = 4;  // pixels
constexpr double kBarGain = 2, kSpotGain = 2;

// A zero-mean cosine bar under a Gaussian; answers lie within +-1/2 for pictures within [0, 1].
cv::Mat bar_kernel(double wavelength, double direction) {
  const double sigma = wavelength / 2;
  const int reach = static_cast<int>(std::ceil(2.5 * sigma));
  cv::Mat kernel(2 * reach + 1, 2 * reach + 1, CV_32FC1), window(kernel.size(), CV_32FC1);
  for (int y = -reach; y <= reach; ++y) {
    for (int x = -reach; x <= reach; ++x) {
      const double across = x * std::cos(direction) + y * std::sin(direction);
      const double fall = std::exp(-(x * x + y * y) / (2 * sigma * sigma));
      window.at<float>(y + reach, x + reach) = static_cast<float>(fall);
      kernel.at<float>(y + reach, x + reach) =
          static_cast<float>(fall * std::cos(2 * std::numbers::pi * across / wavelength));
    }
  }
  kernel -= window * (cv::sum(kernel)[0] / cv::sum(window)[0]);
  return kernel / cv::norm(kernel, cv::NORM_L1);
}

std::vector<cv::Mat> texture(const FilterInput& input, const PlanOptions& /*options*/) {
  const double wavelength = std::max(kShortestWavelength, input.resolution.to_px(kBarWavelength).count());
  cv::Mat strongest(input.grey.size(), CV_32FC1, cv::Scalar(0)), answer;
  for (int i = 0; i < kDirections; ++i) {
    cv::filter2D(input.grey, answer, CV_32F, bar_kernel(wavelength, std::numbers::pi * i / kDirections), {-1, -1}, 0,
                 cv::BORDER_REFLECT_101);
    cv::max(strongest, cv::abs(answer), strongest);
  }
  cv::Mat narrow, wide;
  cv::GaussianBlur(input.grey, narrow, {}, wavelength / 5, 0, cv::BORDER_REFLECT_101);
  cv::GaussianBlur(input.grey, wide, {}, wavelength / 2.5, 0, cv::BORDER_REFLECT_101);
  const cv::Mat spot = 0.5 + kSpotGain / 2 * (narrow - wide);
  return {cv::min(kBarGain * strongest, 1.0), cv::min(cv::max(spot, 0.0), 1.0)};
}

struct Filter {
  const char* name;  // in error messages
  double PlanOptions::*weight;
  double largest;                                                            // value of a channel before its weight
  std::vector<cv::Mat> (*channels)(const FilterInput&, const PlanOptions&);  // CV_32FC1 each
};

constexpr std::array<Filter, 4> kFilters{{
    {"intensity", &PlanOptions::w_intensity, 1.0, intensity},
    {"edge", &PlanOptions::w_edge, kLargestEdge, edge},
    {"colour", &PlanOptions::w_colour, kLargestColour, colour},
    {"texture", &PlanOptions::w_texture, 1.0, texture},
}};

}  // namespace

Result<cv::Mat> filter_bank(const FilterInput& input, const PlanOptions& options, const std::stop_token& stop) {
  const int rows = input.bgr.rows, band = std::max(1, kBandPixels / std::max(1, input.bgr.cols));
  const auto weighted = [&](int first, int last) {
    // OpenCV's filters look beyond a range of rows into the picture it is part of. What they answer has no rows beyond:
    // one more on each side is for filters of filtered pictures.
    const cv::Range around(std::max(0, first - 1), std::min(rows, last + 1));
    const FilterInput part{input.bgr.rowRange(around), input.grey.rowRange(around), input.intensity.rowRange(around),
                           input.resolution, input.chroma.empty() ? input.chroma : input.chroma.rowRange(around)};
    std::vector<cv::Mat> out;
    for (const Filter& filter : kFilters) {
      const double weight = options.*filter.weight;
      if (weight <= 0) continue;
      for (const cv::Mat& channel : filter.channels(part, options))
        out.emplace_back(channel.rowRange(first - around.start, last - around.start) * weight);
    }
    return out;
  };
  if (rows == 0) return cv::Mat();
  const auto channels = static_cast<int>(weighted(0, 1).size());  // of one row as of all
  cv::Mat responses(input.bgr.size(), CV_32FC(channels));
  const Status done = run_parallel(static_cast<std::size_t>((rows + band - 1) / band), threads_meant(options.threads),
                                   stop, [&](std::size_t i) {
                                     const int first = static_cast<int>(i) * band, last = std::min(rows, first + band);
                                     cv::Mat to = responses.rowRange(first, last);
                                     cv::merge(weighted(first, last), to);
                                   });
  if (!done.ok()) return done.error();
  return responses;
}

cv::Mat filter_bank(const FilterInput& input, const PlanOptions& options) {
  return *filter_bank(input, options, std::stop_token());
}

double largest_response(const PlanOptions& options) {
  double largest = 0;
  for (const Filter& filter : kFilters) largest = std::max(largest, options.*filter.weight * filter.largest);
  return largest;
}

Status check_weights(const PlanOptions& options) {
  double sum = 0;
  for (const Filter& filter : kFilters) {
    const double weight = options.*filter.weight;
    if (!(weight >= 0 && weight <= 1))
      return Error{ErrorCode::kInvalidArgument, fmt::format("the {} weight must lie between 0 and 1", filter.name)};
    sum += weight;
  }
  if (sum > 0) return Ok();
  return Error{ErrorCode::kInvalidArgument, "the weights of all filters are 0: raise the intensity or the edge weight"};
}

Result<cv::Mat> grey_of(const cv::Mat& bgr, const std::stop_token& stop) {
  cv::Mat grey(bgr.size(), CV_32FC1);
  for (int r = 0; r < bgr.rows; ++r) {
    if (stop.stop_requested()) return cancelled();
    const auto* from = bgr.ptr<cv::Vec3b>(r);
    auto* to = grey.ptr<float>(r);
    for (int c = 0; c < bgr.cols; ++c)
      to[c] = (0.114F * static_cast<float>(from[c][0]) + 0.587F * static_cast<float>(from[c][1]) +
               0.299F * static_cast<float>(from[c][2])) /
              255.0F;
  }
  return grey;
}

cv::Mat grey_of(const cv::Mat& bgr) { return *grey_of(bgr, std::stop_token()); }

cv::Mat edges_of(const cv::Mat& grey) {
  cv::Mat across, down, magnitude;
  cv::Sobel(grey, across, CV_32F, 1, 0, 3, 0.25);
  cv::Sobel(grey, down, CV_32F, 0, 1, 3, 0.25);
  cv::magnitude(across, down, magnitude);
  return magnitude;
}

cv::Mat edges_at_scale(const cv::Mat& grey, Pixels sigma) {
  if (!(sigma.count() > 0)) return edges_of(grey);
  cv::Mat smooth;
  cv::GaussianBlur(grey, smooth, {}, sigma.count(), 0, cv::BORDER_REFLECT_101);
  // What the filter answers at a pixel beside a step that has become a Gaussian's integral.
  const auto within = [&](double pixels) { return std::erf(pixels / (sigma.count() * std::numbers::sqrt2)) / 2; };
  const double gain = 1 / (within(1.5) + within(0.5));
  return cv::min(edges_of(smooth) * gain, kLargestEdge);
}

}  // namespace veneer::planner
