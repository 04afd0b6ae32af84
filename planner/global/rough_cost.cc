#include "planner/global/rough_cost.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "planner/cancelled.h"
#include "planner/matching/clones.h"

namespace veneer::planner {
namespace {

constexpr int kMostBlocks = 6;     // along a side
constexpr int kSmallestBlock = 2;  // pixels
constexpr int kMapPixelsABlock = 3;

int blocks_along(int pixels) { return std::clamp(pixels / kSmallestBlock, 1, kMostBlocks); }

// Averages over step x step pixels; what is left at the right and lower border is averaged over what there is.
Result<cv::Mat> averaged(const cv::Mat& features, int step, bool squares, const std::stop_token& stop) {
  const int channels = features.channels();
  const int columns = (features.cols + step - 1) / step, rows = (features.rows + step - 1) / step;
  cv::Mat out(rows, columns, CV_32FC(channels), cv::Scalar::all(0));
  for (int r = 0; r < rows; ++r) {
    if (stop.stop_requested()) return cancelled();
    auto* to = out.ptr<float>(r);
    const int last = std::min(features.rows, (r + 1) * step);
    for (int y = r * step; y < last; ++y) {
      const auto* from = features.ptr<float>(y);
      for (int x = 0; x < features.cols; ++x)
        for (int ch = 0; ch < channels; ++ch) {
          const float value = from[x * channels + ch];
          to[x / step * channels + ch] += squares ? value * value : value;
        }
    }
    for (int c = 0; c < columns; ++c) {
      const int pixels = (last - r * step) * (std::min(features.cols, (c + 1) * step) - c * step);
      for (int ch = 0; ch < channels; ++ch) to[c * channels + ch] /= static_cast<float>(pixels);
    }
  }
  return out;
}

// Over reach x reach pixels; band by band, so that a stop is heeded.
Result<cv::Mat> blurred(const cv::Mat& map, int reach, const std::stop_token& stop) {
  constexpr int kBand = 64;
  cv::Mat out(map.size(), map.type());
  for (int top = 0; top < map.rows; top += kBand) {
    if (stop.stop_requested()) return cancelled();
    const cv::Range band(top, std::min(map.rows, top + kBand));
    // The filter looks beyond a part of a picture, into the whole.
    cv::Mat part = out.rowRange(band);
    cv::blur(map.rowRange(band), part, {reach, reach}, {-1, -1}, cv::BORDER_REPLICATE);
  }
  return out;
}

}  // namespace

RoughBlocks::RoughBlocks(const PatchPixels& window)
    : columns(blocks_along(window.width)),
      rows(blocks_along(window.height)),
      width(static_cast<double>(window.width) / columns),
      height(static_cast<double>(window.height) / rows) {}

RoughPanel::RoughPanel(int channels, const RoughBlocks& blocks)
    : blocks_(blocks),
      channels_(channels),
      step_(std::max(1, static_cast<int>(std::lround(std::min(blocks.width, blocks.height) / kMapPixelsABlock)))) {}

Result<RoughPanel> RoughPanel::make(const cv::Mat& features, const RoughBlocks& blocks, const std::stop_token& stop) {
  RoughPanel out(features.channels(), blocks);
  // The map's pixels are smaller than a block and then blurred to its size, so that places between them are met too.
  const int reach = std::max(1, static_cast<int>(std::lround(std::min(blocks.width, blocks.height) / out.step_)));
  const auto map_of = [&](bool squared) -> Result<cv::Mat> {
    const Result<cv::Mat> coarse = averaged(features, out.step_, squared, stop);
    return coarse.ok() ? blurred(*coarse, reach, stop) : coarse.error();
  };
  const Result<cv::Mat> means = map_of(false), squares = map_of(true);
  if (!means.ok()) return means.error();
  if (!squares.ok()) return squares.error();
  const int channels = out.channels_;
  out.map_.create(means->size(), CV_32FC(channels + 1));
  for (int r = 0; r < out.map_.rows; ++r) {
    if (stop.stop_requested()) return cancelled();
    const auto *mean = means->ptr<float>(r), *square = squares->ptr<float>(r);
    auto* to = out.map_.ptr<float>(r);
    for (int c = 0; c < out.map_.cols; ++c) {
      float deviation = 0;
      for (int ch = 0; ch < channels; ++ch) {
        const float value = mean[c * channels + ch];
        *to++ = value;
        deviation += square[c * channels + ch] - value * value;
      }
      *to++ = std::max(deviation, 0.0F);
    }
  }
  return out;
}

float RoughPanel::describe(double column, double row, double cos, double sin, float* to, std::size_t stride) const {
  const int width = channels_ + 1;
  const double across = blocks_.width / step_, down = blocks_.height / step_;
  float squares = 0;
  for (int j = 0; j < blocks_.rows; ++j) {
    const double v = (j - (blocks_.rows - 1) * 0.5) * down;
    for (int i = 0; i < blocks_.columns; ++i) {
      const double u = (i - (blocks_.columns - 1) * 0.5) * across;
      const double x = std::clamp(column / step_ + cos * u + sin * v - 0.5, 0.0, map_.cols - 1.0);
      const double y = std::clamp(row / step_ + cos * v - sin * u - 0.5, 0.0, map_.rows - 1.0);
      const int c = static_cast<int>(x), r = static_cast<int>(y);
      const auto fx = static_cast<float>(x - c), fy = static_cast<float>(y - r);
      const auto* upper = map_.ptr<float>(r) + static_cast<std::ptrdiff_t>(c) * width;
      const auto* lower = map_.ptr<float>(std::min(r + 1, map_.rows - 1)) + static_cast<std::ptrdiff_t>(c) * width;
      const int right = c + 1 < map_.cols ? width : 0;
      for (int ch = 0; ch < width; ++ch) {
        const float above = upper[ch] + fx * (upper[ch + right] - upper[ch]);
        const float below = lower[ch] + fx * (lower[ch + right] - lower[ch]);
        const float value = above + fy * (below - above);
        if (ch == channels_) {
          squares += value;
        } else {
          squares += value * value;
          *to = value;
          to += stride;
        }
      }
    }
  }
  return squares;
}

RoughPatch::RoughPatch(const MatchPatch& patch, const RoughBlocks& blocks) {
  const PatchPixels& window = patch.pixels;
  const cv::Mat& features = *patch.features;
  const auto channels = static_cast<std::size_t>(features.channels());
  std::vector<double> sums(blocks.count() * channels), counts(blocks.count());
  double energy = 0;
  for (const PatchPixels::Span& span : window.spans) {
    const auto* row = features.ptr<float>(span.row);
    for (int x = span.begin; x < span.end; ++x) {
      const auto block =
          static_cast<std::size_t>((span.row - window.top) * blocks.rows / window.height * blocks.columns +
                                   (x - window.left) * blocks.columns / window.width);
      counts[block] += 1;
      for (std::size_t ch = 0; ch < channels; ++ch) {
        const double value = row[static_cast<std::size_t>(x) * channels + ch];
        sums[block * channels + ch] += value, energy += value * value;
      }
    }
  }
  pixels = static_cast<double>(window.count) / static_cast<double>(blocks.count());
  fixed = energy;
  // Blocks that the outline cuts off count like the others, with the patch's mean: the estimate gets rough there.
  std::vector<double> overall(channels);
  for (std::size_t k = 0; k < sums.size(); ++k) overall[k % channels] += sums[k] / static_cast<double>(window.count);
  for (std::size_t k = 0; k < sums.size(); ++k) {
    const double count = counts[k / channels], mean = count > 0 ? sums[k] / count : overall[k % channels];
    fixed += (pixels - count) * mean * mean;
    weights.push_back(static_cast<float>(-2 * mean));
  }
}

VENEER_CLONES void score_candidates(const RoughPatch& patch, const float* numbers, const float* squares,
                                    std::size_t stride, std::size_t count, float* scores) {
  const std::size_t terms = patch.weights.size();
  const float* weights = patch.weights.data();
  for (std::size_t first = 0; first < count; first += kCandidatesAtOnce) {
    float sums[kCandidatesAtOnce];
    for (std::size_t i = 0; i < kCandidatesAtOnce; ++i) sums[i] = squares[first + i];
    for (std::size_t k = 0; k < terms; ++k) {
      const float* row = numbers + k * stride + first;
      const float weight = weights[k];
      for (std::size_t i = 0; i < kCandidatesAtOnce; ++i) sums[i] += weight * row[i];
    }
    for (std::size_t i = 0; i < kCandidatesAtOnce; ++i) scores[first + i] = sums[i];
  }
}

}  // namespace veneer::planner
