#include "planner/pictures/wood_colours.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <opencv2/imgproc.hpp>

#include "planner/cancelled.h"

namespace veneer::planner {
namespace {

constexpr int kTones = ColourCounts::kTones, kSide = ColourCounts::kSide, kColourCells = ColourCounts::kCells;
constexpr float kLeastA = -16, kLeastB = -8, kCellUnits = 4;  // of the cells of colours; wood lies well within
constexpr int kCountedStep = 2;                               // one row and column in so many is counted

// Which colour a tone has is told by the wood of about this tone and colour.
constexpr double kToneBlur = 1.5, kCellBlur = 1.0;
// What a turn of the line costs: (units of CIELAB from tone to tone)^2, in shares of the wood.
constexpr double kHueTurnCost = 0.0006;
constexpr double kNearLine = 12;  // units of CIELAB within which wood belongs to the line

int cell_of(const cv::Vec2f& colour) {
  const auto index = [](float at, float least) {
    return std::clamp(static_cast<int>((at - least) / kCellUnits), 0, kSide - 1);
  };
  return index(colour[0], kLeastA) * kSide + index(colour[1], kLeastB);
}

double squared_length(const cv::Vec2f& v) { return static_cast<double>(v.dot(v)); }

using ColourLine = std::array<cv::Vec2f, kTones>;

// Tones without any weight take the line between their neighbours; then all is smoothed.
ColourLine smooth_line(const ColourLine& sums, const std::array<double, kTones>& weights) {
  constexpr int kReach = 12;
  constexpr double kSigma = 2.5;
  ColourLine out{};
  for (int t = 0; t < kTones; ++t) {
    cv::Vec2d sum(0, 0);
    double weight = 0;
    // The farther away, the less; where nothing is near, as far as it takes.
    for (int reach = kReach; weight <= 0 && reach < 2 * kTones; reach *= 2) {
      const double sigma = kSigma * reach / kReach;
      for (int k = std::max(0, t - reach); k <= std::min(kTones - 1, t + reach); ++k) {
        const double w = std::exp(-0.5 * (k - t) * (k - t) / (sigma * sigma));
        sum += w * cv::Vec2d(sums[static_cast<std::size_t>(k)]);
        weight += w * weights[static_cast<std::size_t>(k)];
      }
    }
    if (weight > 0) out[static_cast<std::size_t>(t)] = cv::Vec2f(sum / weight);
  }
  return out;
}

double spread_around(const ColourCounts& counts, const ColourLine& line) {
  double sum = 0, weight = 0;
  for (int t = 0; t < kTones; ++t)
    for (int c = 0; c < kColourCells; ++c) {
      const double there = counts.at(t, c);
      if (there <= 0) continue;
      sum += there * squared_length(ColourCounts::colour_of(c) - line[static_cast<std::size_t>(t)]), weight += there;
    }
  return weight > 0 ? std::sqrt(sum / weight) : 0;
}

// The means of colours within `reach` of a line.
ColourLine means_near(const ColourCounts& counts, const ColourLine& line, double reach) {
  ColourLine sums{};
  std::array<double, kTones> weights{};
  for (int t = 0; t < kTones; ++t) {
    const auto at = static_cast<std::size_t>(t);
    cv::Vec2d sum(0, 0);
    for (int c = 0; c < kColourCells; ++c) {
      const cv::Vec2f colour = ColourCounts::colour_of(c);
      if (counts.at(t, c) <= 0 || squared_length(colour - line[at]) > reach * reach) continue;
      sum += counts.at(t, c) * cv::Vec2d(colour), weights[at] += counts.at(t, c);
    }
    sums[at] = cv::Vec2f(sum);
  }
  return smooth_line(sums, weights);
}

// Shares of the wood, blurred over tones and colours: [tone] a kSide x kSide map.
std::vector<cv::Mat> blurred_shares(const ColourCounts& wood) {
  cv::Mat all(kTones, kColourCells, CV_64FC1);
  for (int t = 0; t < kTones; ++t)
    for (int c = 0; c < kColourCells; ++c) all.at<double>(t, c) = wood.at(t, c) / wood.total();
  cv::GaussianBlur(all, all, {1, 11}, kToneBlur, kToneBlur, cv::BORDER_CONSTANT);
  std::vector<cv::Mat> out;
  for (int t = 0; t < kTones; ++t) {
    cv::Mat map = all.row(t).reshape(1, kSide).clone();
    cv::GaussianBlur(map, map, {7, 7}, kCellBlur, kCellBlur, cv::BORDER_CONSTANT);
    out.push_back(map);
  }
  return out;
}

// By dynamic programming over tones: the line with most wood on it, less its turns.
ColourLine likeliest_line(const ColourCounts& wood) {
  const std::vector<cv::Mat> shares = blurred_shares(wood);
  std::vector<double> best(kColourCells, 0), next(kColourCells);
  std::vector<std::array<int, kColourCells>> from(kTones);
  for (int t = 0; t < kTones; ++t) {
    const auto at = static_cast<std::size_t>(t);
    const auto* share = shares[at].ptr<double>();
    for (int c = 0; c < kColourCells; ++c) {
      double most = -std::numeric_limits<double>::infinity();
      for (int before = 0; before < kColourCells; ++before) {
        const int down = c / kSide - before / kSide, across = c % kSide - before % kSide;
        const double turn = kHueTurnCost * kCellUnits * kCellUnits * (down * down + across * across);
        const double score = best[static_cast<std::size_t>(before)] - (t > 0 ? turn : 0);
        if (score > most) most = score, from[at][static_cast<std::size_t>(c)] = before;
      }
      next[static_cast<std::size_t>(c)] = most + share[c];
    }
    std::swap(best, next);
  }
  ColourLine out{};
  auto cell = static_cast<int>(std::max_element(best.begin(), best.end()) - best.begin());
  for (int t = kTones - 1; t >= 0; --t) {
    const auto at = static_cast<std::size_t>(t);
    out[at] = ColourCounts::colour_of(cell);
    cell = from[at][static_cast<std::size_t>(cell)];
  }
  return out;
}

}  // namespace

cv::Mat chroma_of(const cv::Mat& bgr) {
  cv::Mat scaled, lab, chroma(bgr.size(), CV_32FC2);
  bgr.convertTo(scaled, CV_32FC3, 1.0 / 255);
  cv::cvtColor(scaled, lab, cv::COLOR_BGR2Lab);
  constexpr std::array<int, 4> kFromTo{1, 0, 2, 1};
  cv::mixChannels(&lab, 1, &chroma, 1, kFromTo.data(), 2);
  return chroma;
}

ColourCounts::ColourCounts() : counts_(static_cast<std::size_t>(kTones) * kColourCells) {}

int ColourCounts::tone_of(float grey) {
  return std::clamp(static_cast<int>(grey * static_cast<float>(kTones)), 0, kTones - 1);
}

cv::Vec2f ColourCounts::colour_of(int cell) {
  const auto a = cell / kSide, b = cell % kSide;
  return {kLeastA + kCellUnits * (static_cast<float>(a) + 0.5F), kLeastB + kCellUnits * (static_cast<float>(b) + 0.5F)};
}

double ColourCounts::total() const { return std::accumulate(counts_.begin(), counts_.end(), 0.0); }

Status ColourCounts::add(const cv::Mat& bgr, const cv::Mat& grey, const cv::Mat& mask, double weight,
                         const std::stop_token& stop) {
  for (int r = 0; r < bgr.rows; r += kCountedStep) {
    if (stop.stop_requested()) return cancelled();
    const cv::Mat row = chroma_of(bgr.row(r));
    const auto* colours = row.ptr<cv::Vec2f>();
    const auto* tones = grey.ptr<float>(r);
    const auto* usable = mask.empty() ? nullptr : mask.ptr<std::uint8_t>(r);
    for (int c = 0; c < bgr.cols; c += kCountedStep)
      if (usable == nullptr || usable[c] != 0)
        counts_[static_cast<std::size_t>(tone_of(tones[c]) * kColourCells + cell_of(colours[c]))] += weight;
  }
  return Ok();
}

cv::Vec2f ToneLine::at(float grey) const {
  const float along = std::clamp(grey * static_cast<float>(kTones) - 0.5F, 0.0F, static_cast<float>(kTones - 1));
  const auto low = static_cast<std::size_t>(along);
  const std::size_t high = std::min<std::size_t>(low + 1, kTones - 1);
  const float part = along - static_cast<float>(low);
  return colours[low] * (1 - part) + colours[high] * part;
}

ToneLine tone_line(const ColourCounts& wood) {
  ToneLine line;
  if (wood.total() <= 0) return line;
  line.colours = means_near(wood, likeliest_line(wood), kNearLine);
  line.spread = spread_around(wood, line.colours);
  return line;
}

ToneLine mean_line(const ColourCounts& picture) {
  ToneLine line;
  line.colours = means_near(picture, line.colours, 1e3);
  line.spread = spread_around(picture, line.colours);
  return line;
}

GreyHistogram tones_near(const ColourCounts& wood, const ToneLine& line, double w_gamut) {
  GreyHistogram out;
  for (int t = 0; t < kTones; ++t) {
    double sum = 0;
    for (int c = 0; c < kColourCells; ++c) {
      const double there = wood.at(t, c);
      if (there <= 0) continue;
      const double far = squared_length(ColourCounts::colour_of(c) - line.colours[static_cast<std::size_t>(t)]);
      sum += there * (1 - w_gamut + w_gamut * std::exp(-far / (2 * kNearLine * kNearLine)));
    }
    // A tone of this histogram is some grey values of that one.
    constexpr int kGreys = 256 / kTones;
    for (int k = 0; k < kGreys; ++k) out.counts[static_cast<std::size_t>(t * kGreys + k)] = sum / kGreys;
  }
  return out;
}

cv::Mat match_colours(const cv::Mat& chroma, const cv::Mat& grey, const cv::Mat& intensity, const ToneLine& own,
                      const ToneLine& wood, double w_gamut) {
  const auto w = static_cast<float>(w_gamut);
  const auto shrink = static_cast<float>(own.spread > 0 ? std::min(1.0, wood.spread / own.spread) : 1.0);
  cv::Mat out(chroma.size(), CV_32FC2);
  for (int r = 0; r < chroma.rows; ++r) {
    const auto* colours = chroma.ptr<cv::Vec2f>(r);
    const auto *tones = grey.ptr<float>(r), *wanted = intensity.ptr<float>(r);
    auto* to = out.ptr<cv::Vec2f>(r);
    for (int c = 0; c < chroma.cols; ++c) {
      const cv::Vec2f mapped = wood.at(wanted[c]) + shrink * (colours[c] - own.at(tones[c]));
      to[c] = (1 - w) * colours[c] + w * mapped;
    }
  }
  return out;
}

}  // namespace veneer::planner
