#include "planner/problem/shortage.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "planner/cancelled.h"

namespace veneer::planner {
namespace {

// Smaller patches that are offered, as shares of the wished side.
constexpr std::array<double, 7> kShares{0.85, 0.7, 0.6, 0.5, 0.4, 0.3, 0.25};
constexpr double kPixelsInTheSmallest = 8;

// Free wood minus what the plan takes, coarser than the stock and never too generous.
struct Leftover {
  cv::Mat free;  // CV_8UC1, 1 = free
  double px_per_mm = 1;
};

Result<Leftover> leftover_of(const MatchPanel& panel, int index, const Problem& problem, const PatchPlacements& patches,
                             Millimetres smallest, const std::stop_token& stop) {
  const Raster<PanelFrame>& stock = panel.wood.raster();
  const double wanted = kPixelsInTheSmallest / smallest.count();
  const int step = std::max(1, static_cast<int>(stock.resolution.px_per_mm / wanted));
  Leftover out;
  out.px_per_mm = stock.resolution.px_per_mm / step;
  out.free = cv::Mat(stock.pixels.rows / step, stock.pixels.cols / step, CV_8UC1, cv::Scalar(1));
  for (int r = 0; r < out.free.rows * step; ++r) {
    if (stop.stop_requested()) return cancelled();
    for (int c = 0; c < out.free.cols * step; ++c)
      if (stock.pixels.at<std::uint8_t>(r, c) == 0) out.free.at<std::uint8_t>(r / step, c / step) = 0;
  }
  for (std::size_t i = 0; i < patches.size(); ++i) {
    if (stop.stop_requested()) return cancelled();
    if (!patches[i] || patches[i]->panel != index) continue;
    std::vector<std::vector<cv::Point>> rings;
    for (const Ring<PanelFrame>& ring :
         grown_rings(patches[i]->panel_from_artwork * problem.queue[i].match.outline, panel.wood.kerf())) {
      std::vector<cv::Point>& corners = rings.emplace_back();
      for (const auto& p : ring) {
        double column = 0, row = 0;
        stock.to_pixels(p, column, row);
        corners.emplace_back(cvFloor(column / step), cvFloor(row / step));
      }
    }
    cv::fillPoly(out.free, rings, cv::Scalar(0));
    cv::polylines(out.free, rings, true, cv::Scalar(0), 2);  // pixels that a border only touches
  }
  return out;
}

// What of `leftover` limits close, which is taken from it.
Leftover behind_limits(Leftover& leftover, int index, const MatchPanel& panel, const MaterialLimits& limits,
                       LimitSet closed) {
  const Raster<PanelFrame>& stock = panel.wood.raster();
  Leftover out{cv::Mat::zeros(leftover.free.size(), CV_8UC1), leftover.px_per_mm};
  const double scale = leftover.px_per_mm / stock.resolution.px_per_mm;
  for (std::size_t i = 0; i < limits.size(); ++i) {
    if (!closed.has(i)) continue;
    for (const MaterialLimits::Wood& wood : limits.wood_under(i)) {
      if (wood.panel != index) continue;
      std::vector<cv::Point> corners;
      for (const auto& p : wood.outline) {
        double column = 0, row = 0;
        stock.to_pixels(p, column, row);
        corners.emplace_back(cvFloor(column * scale), cvFloor(row * scale));
      }
      cv::fillPoly(out.free, std::vector{corners}, cv::Scalar(1));
    }
  }
  const cv::Mat wood = out.free.clone();
  cv::bitwise_and(wood, leftover.free, out.free);
  leftover.free.setTo(0, wood);
  return out;
}

// Upright squares side by side, row by row: fewer than would fit with turning and care.
Result<std::size_t> squares_that_fit(const Leftover& leftover, Millimetres side, const std::stop_token& stop) {
  const int pixels = static_cast<int>(std::ceil(side.count() * leftover.px_per_mm));
  // Free pixels on end in each column, up to the present row.
  std::vector<int> height(static_cast<std::size_t>(leftover.free.cols), 0);
  std::size_t count = 0;
  for (int r = 0; r < leftover.free.rows; ++r) {
    if (stop.stop_requested()) return cancelled();
    int width = 0;
    for (int c = 0; c < leftover.free.cols; ++c) {
      int& here = height[static_cast<std::size_t>(c)];
      here = leftover.free.at<std::uint8_t>(r, c) == 0 ? 0 : here + 1;
      width = here >= pixels ? width + 1 : 0;
      if (width < pixels) continue;
      std::fill_n(&here - (pixels - 1), pixels, 0);
      ++count;
      width = 0;
    }
  }
  return count;
}

}  // namespace

std::optional<Shortage> missing_wood(const Problem& problem, const PatchPlacements& patches, LimitSet closed) {
  Shortage out;
  out.limited = !closed.empty();
  for (std::size_t i = 0; i < patches.size(); ++i) {
    if (patches[i]) continue;
    const MatchPatch& match = problem.queue[i].match;
    const cv::Mat& tones = problem.artworks[problem.queue[i].artwork].tones;
    const double mm2 = 1 / (match.grid.resolution.px_per_mm * match.grid.resolution.px_per_mm);
    ++out.unfilled;
    for (const auto& [row, begin, end] : match.pixels.spans) {
      for (int c = begin; c < end; ++c)
        out.missing[tones.at<std::uint8_t>(row, c) * out.missing.size() / 256] += SquareMillimetres(mm2);
    }
  }
  if (out.unfilled == 0) return std::nullopt;
  for (const SquareMillimetres& band : out.missing) out.area += band;
  return out;
}

Result<std::optional<Shortage>> shortage_of(const Problem& problem, const Matcher& matcher,
                                            const PatchPlacements& patches, Millimetres patch, LimitSet closed,
                                            const std::stop_token& stop) {
  std::optional<Shortage> missing = missing_wood(problem, patches, closed);
  if (!missing) return missing;
  Shortage& out = *missing;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    if (patches[i]) continue;
    const Box<ArtworkFrame> box = bounds(problem.queue[i].match.outline);
    patch = std::min({patch, box.width(), box.height()});  // a small picture may be a single one
  }
  SquareMillimetres left{};
  std::vector<Leftover> leftovers;
  for (std::size_t p = 0; p < matcher.panels().size(); ++p) {
    Result<Leftover> free =
        leftover_of(matcher.panels()[p], static_cast<int>(p), problem, patches, patch * kShares.back(), stop);
    if (!free.ok()) return free.error();
    leftovers.push_back(*std::move(free));
    if (!closed.empty()) {
      const MatchPanel& panel = matcher.panels()[p];
      const Leftover behind = behind_limits(leftovers.back(), static_cast<int>(p), panel, problem.limits, closed);
      const Result<std::size_t> fitting = squares_that_fit(behind, patch + 2 * panel.wood.border(), stop);
      if (!fitting.ok()) return fitting.error();
      out.behind_limits += *fitting;
    }
    left += SquareMillimetres(cv::countNonZero(leftovers.back().free) /
                              (leftovers.back().px_per_mm * leftovers.back().px_per_mm));
  }
  out.left = left;
  for (const double share : kShares) {
    const Millimetres side = patch * share;
    std::size_t count = 0;
    for (std::size_t p = 0; p < leftovers.size(); ++p) {
      const Result<std::size_t> fitting =
          squares_that_fit(leftovers[p], side + 2 * matcher.panels()[p].wood.border(), stop);
      if (!fitting.ok()) return fitting.error();
      count += *fitting;
    }
    if (count == 0) continue;
    out.smaller = Shortage::Smaller{side, count};
    if (static_cast<double>(count) * (side * side).count() >= out.area.count()) break;
  }
  return missing;
}

namespace {

// As many patches of the same size as have wood now; nothing where that is no picture any more.
std::string smaller_picture_for(const Shortage& shortage, std::size_t pieces) {
  constexpr double kMost = 60;  // percent
  const double filled = static_cast<double>(pieces - shortage.unfilled) / static_cast<double>(pieces);
  const double percent = std::ceil(100 * (1 - std::sqrt(filled)));
  return percent > kMost ? "" : fmt::format("make the picture about {:.0f} % smaller, ", percent);
}

}  // namespace

std::string what_is_missing(const Shortage& shortage, std::size_t pieces) {
  constexpr std::array<const char*, 4> kNames{"dark", "rather dark", "rather pale", "pale"};
  std::vector<std::string> tones;
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    const double area = (shortage.missing[2 * i] + shortage.missing[2 * i + 1]).count();
    if (area >= 0.01 * shortage.area.count()) tones.push_back(fmt::format("{:.0f} mm2 {}", area, kNames[i]));
  }
  const bool limited = shortage.behind_limits > 0 || (shortage.limited && !shortage.left);
  return fmt::format("no free wood was left{} for {} of {} patches ({})", limited ? " within the limits" : "",
                     shortage.unfilled, pieces, fmt::join(tones, ", "));
}

std::string sentence_of(const Shortage& shortage, std::size_t pieces) {
  std::string out = what_is_missing(shortage, pieces);
  std::string smaller_picture = smaller_picture_for(shortage, pieces);
  if (shortage.behind_limits > 0) {
    out += fmt::format("; {} would fit in wood that has reached its limit",
                       shortage.behind_limits >= shortage.unfilled
                           ? std::string("all of them")
                           : fmt::format("at least {} of them", shortage.behind_limits));
    smaller_picture = "raise that limit (--material-limit), " + smaller_picture;
  }
  if (!shortage.left)
    return out + fmt::format(": {}{}add a panel or choose smaller patches",
                             shortage.limited ? "raise a limit (--material-limit), " : "", smaller_picture);
  if (!shortage.smaller)
    return out + fmt::format("; on the {:.0f} mm2 that are left not even small patches fit: {}add a panel",
                             shortage.left->count(), smaller_picture);
  const double covered = static_cast<double>(shortage.smaller->count) *
                         (shortage.smaller->side * shortage.smaller->side).count() / shortage.area.count();
  return out + fmt::format("; {} {} patches of {:.1f} mm would still fit, {}: {}add a panel or choose smaller patches",
                           covered >= 1 ? "at least" : "only about", shortage.smaller->count,
                           shortage.smaller->side.count(),
                           covered >= 1 ? "enough for them" : fmt::format("{:.0f} % of their area", 100 * covered),
                           smaller_picture);
}

}  // namespace veneer::planner
