#include "planner/pictures/histogram.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "planner/cancelled.h"

namespace veneer::planner {
namespace {

using GreyShares = std::array<double, 256>;

// Share of pixels at or below each value.
GreyShares cumulated(const GreyHistogram& histogram) {
  GreyShares shares{};
  std::partial_sum(histogram.counts.begin(), histogram.counts.end(), shares.begin());
  const double all = shares.back();
  for (double& s : shares) s /= all;
  return shares;
}

// The value at which the source's share reaches `share`, linear between the values that occur.
float value_at(const GreyShares& source, const GreyHistogram& histogram, double share) {
  int below = -1;
  for (int i = 0; i < 256; ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (histogram.counts[at] <= 0) continue;
    if (source[at] >= share) {
      if (below < 0) return static_cast<float>(i) / 255.0F;
      const double low = source[static_cast<std::size_t>(below)];
      const double part = (share - low) / (source[at] - low);
      return static_cast<float>((below + part * (i - below)) / 255.0);
    }
    below = i;
  }
  return static_cast<float>(std::max(below, 0)) / 255.0F;
}

}  // namespace

Status GreyHistogram::add(const cv::Mat& grey, const cv::Mat& mask, double weight, const std::stop_token& stop) {
  std::array<std::int64_t, 256> pixels{};
  for (int r = 0; r < grey.rows; ++r) {
    if (stop.stop_requested()) return cancelled();
    const auto* from = grey.ptr<float>(r);
    const auto* usable = mask.empty() ? nullptr : mask.ptr<std::uint8_t>(r);
    for (int c = 0; c < grey.cols; ++c) {
      if (usable != nullptr && usable[c] == 0) continue;
      // Rounded as lround does, which is a call. NOLINTNEXTLINE(bugprone-incorrect-roundings)
      const int bin = static_cast<int>(static_cast<double>(from[c] * 255.0F) + 0.5);
      ++pixels[static_cast<std::size_t>(std::clamp(bin, 0, 255))];
    }
  }
  for (std::size_t i = 0; i < counts.size(); ++i) counts[i] += weight * static_cast<double>(pixels[i]);
  return Ok();
}

void GreyHistogram::add(const cv::Mat& grey, const cv::Mat& mask, double weight) {
  (void)add(grey, mask, weight, std::stop_token());  // which never stops
}

double GreyHistogram::total() const { return std::accumulate(counts.begin(), counts.end(), 0.0); }

std::array<float, 256> rank_matching(const GreyHistogram& target, const GreyHistogram& source) {
  const GreyShares target_shares = cumulated(target);
  const GreyShares source_shares = cumulated(source);
  std::array<float, 256> table{};
  for (std::size_t i = 0; i < table.size(); ++i) table[i] = value_at(source_shares, source, target_shares[i]);
  return table;
}

Result<cv::Mat> match_tones(const cv::Mat& target_grey, const GreyHistogram& source, double w_hist,
                            const std::stop_token& stop) {
  if (w_hist <= 0 || source.total() <= 0) return target_grey;
  GreyHistogram target;
  if (const Status added = target.add(target_grey, {}, 1, stop); !added.ok()) return added.error();
  const auto table = rank_matching(target, source);
  const auto w = static_cast<float>(w_hist);
  cv::Mat out(target_grey.size(), CV_32FC1);
  for (int r = 0; r < out.rows; ++r) {
    if (stop.stop_requested()) return cancelled();
    const auto* from = target_grey.ptr<float>(r);
    auto* to = out.ptr<float>(r);
    for (int c = 0; c < out.cols; ++c) {
      const float at = std::clamp(from[c] * 255.0F, 0.0F, 255.0F);
      const int low = std::min(static_cast<int>(at), 254);
      const float part = at - static_cast<float>(low);
      const auto i = static_cast<std::size_t>(low);
      const float equalized = table[i] + part * (table[i + 1] - table[i]);
      to[c] = (1 - w) * from[c] + w * equalized;
    }
  }
  return out;
}

cv::Mat match_tones(const cv::Mat& target_grey, const GreyHistogram& source, double w_hist) {
  return *match_tones(target_grey, source, w_hist, std::stop_token());
}

}  // namespace veneer::planner
