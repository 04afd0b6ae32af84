#include "planner/morph/fitted_lines.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "planner/cancelled.h"
#include "planner/parallel.h"

namespace veneer::planner {
namespace {

constexpr int kToneRounds = 4;        // of tones and cuts
constexpr int kSmoothRounds = 2;      // of columns and rows
constexpr double kControlStride = 3;  // pixels between the controls of smooth lines
// How much tones vary within a patch of the straight grid is the unit of what else a line costs: a turn of a smooth
// line, over a stride as wide as the whole reach, and a pixel that a patch has `reach` beyond its straight cell.
constexpr double kTurnCost = 0.03;
constexpr double kFarCost = 0.3;

// Straight through vertices with slopes that change continuously (natural spline), as second derivatives at the knots.
class Spline {
 public:
  // `knots`: along and across, along growing.
  explicit Spline(std::vector<std::pair<double, double>> knots) : knots_(std::move(knots)), bend_(knots_.size(), 0) {
    const std::size_t n = knots_.size();
    std::vector<double> upper(n, 0);
    for (std::size_t i = 1; i + 1 < n; ++i) {
      const double before = width(i - 1), after = width(i);
      const double right = 6 * (slope(i) - slope(i - 1)), pivot = 2 * (before + after) - before * upper[i - 1];
      upper[i] = after / pivot, bend_[i] = (right - before * bend_[i - 1]) / pivot;
    }
    for (std::size_t i = n - 1; i-- > 1;) bend_[i] -= upper[i] * bend_[i + 1];
  }

  double operator()(double along) const {
    std::size_t i = 0;
    while (i + 2 < knots_.size() && along > knots_[i + 1].first) ++i;
    const double h = width(i), s = (knots_[i + 1].first - along) / h, t = (along - knots_[i].first) / h;
    const double straight = knots_[i].second + t * (knots_[i + 1].second - knots_[i].second);
    return straight + ((s * s * s - s) * bend_[i] + (t * t * t - t) * bend_[i + 1]) * h * h / 6;
  }

 private:
  double width(std::size_t i) const { return knots_[i + 1].first - knots_[i].first; }
  double slope(std::size_t i) const { return (knots_[i + 1].second - knots_[i].second) / width(i); }

  std::vector<std::pair<double, double>> knots_;
  std::vector<double> bend_;
};

// Pixels whose middle lies in a face, and those that may come to: the straight cell and `reach` around it.
class FaceTones {
 public:
  FaceTones(const CutLines& straight, const CutLines& lines, const cv::Mat& tones, const cv::Mat& counts, double reach)
      : straight_(straight), lines_(lines), tones_(tones), counts_(counts), reach_(reach) {}

  // The tone that the face is to show: its median, so that one which an edge cuts takes the side of its larger part.
  double tone(std::size_t f) const {
    const cv::Rect window = window_of(f);
    std::vector<float> all;
    for (int r = window.y; r < window.y + window.height; ++r) {
      const double left = lines_.left(f, r + 0.5), right = lines_.right(f, r + 0.5);
      for (int c = window.x; c < window.x + window.width; ++c) {
        if (c + 0.5 < left || c + 0.5 >= right) continue;
        if (r + 0.5 < lines_.top(f, c + 0.5) || r + 0.5 >= lines_.bottom(f, c + 0.5)) continue;
        if (!counts_.empty() && counts_.at<std::uint8_t>(r, c) == 0) continue;
        all.push_back(tones_.at<float>(r, c));
      }
    }
    if (all.empty()) return 0;
    const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
    std::nth_element(all.begin(), middle, all.end());
    return static_cast<double>(*middle);
  }

  // What it costs that the face shows one of these tones, the nearest. `far`: at `reach` beyond the straight cell, on
  // top of that.
  FaceCost cost(std::size_t f, const std::array<double, 2>& shown, double far) const {
    FaceCost out{window_of(f), {}};
    out.cost.create(out.window.size(), CV_32FC1);
    const double left = straight_.left(f, 0), right = straight_.right(f, 0);
    const double top = straight_.top(f, 0), bottom = straight_.bottom(f, 0);
    for (int r = 0; r < out.window.height; ++r)
      for (int c = 0; c < out.window.width; ++c) {
        const double x = out.window.x + c + 0.5, y = out.window.y + r + 0.5;
        const double beyond = std::max({left - x, x - right, top - y, y - bottom, 0.0}) / reach_;
        const bool here = counts_.empty() || counts_.at<std::uint8_t>(out.window.y + r, out.window.x + c) != 0;
        const auto tone = static_cast<double>(tones_.at<float>(out.window.y + r, out.window.x + c));
        const double off = here ? std::min(std::abs(tone - shown[0]), std::abs(tone - shown[1])) : 0;
        out.cost.at<float>(r, c) = static_cast<float>(off * off + far * beyond * beyond);
      }
    return out;
  }

 private:
  cv::Rect window_of(std::size_t f) const {
    const cv::Point first(static_cast<int>(std::floor(straight_.left(f, 0) - reach_)) - 1,
                          static_cast<int>(std::floor(straight_.top(f, 0) - reach_)) - 1);
    const cv::Point last(static_cast<int>(std::ceil(straight_.right(f, 0) + reach_)) + 1,
                         static_cast<int>(std::ceil(straight_.bottom(f, 0) + reach_)) + 1);
    return cv::Rect(first, last) & cv::Rect({0, 0}, tones_.size());
  }

  const CutLines &straight_, &lines_;
  const cv::Mat &tones_, &counts_;
  double reach_;
};

}  // namespace

CutLines grid_lines(const GridSize& size, cv::Size raster) {
  std::vector<PixelRectangle> cells;
  const auto x = [&](int column) { return raster.width * (static_cast<double>(column) / size.columns); };
  const auto y = [&](int row) { return raster.height * (static_cast<double>(row) / size.rows); };
  for (int r = 0; r < size.rows; ++r)
    for (int c = 0; c < size.columns; ++c) cells.push_back({x(c), y(r), x(c + 1), y(r + 1)});
  return cut_lines(cells, raster.width, raster.height, raster, 0);
}

CutLines lines_through(const SpringGrid& grid, CutLines straight) {
  int column = 0, row = 0;
  for (CutLine& line : straight.lines) {
    std::vector<std::pair<double, double>> knots;
    if (line.upright) {
      ++column;
      for (int r = 0; r <= grid.size.rows; ++r) knots.emplace_back(grid.at(r, column).y, grid.at(r, column).x);
    } else {
      ++row;
      for (int c = 0; c <= grid.size.columns; ++c) knots.emplace_back(grid.at(row, c).x, grid.at(row, c).y);
    }
    const Spline spline(std::move(knots));
    for (std::size_t i = 0; i < line.at.size(); ++i) line.at[i] = spline(line.first + static_cast<double>(i) + 0.5);
  }
  return straight;
}

void lead_through(std::span<const PlanePin> pins, const GridSize& size, CutLines& lines) {
  struct Passing {
    double along, across;
  };
  std::vector<std::vector<Passing>> passing(lines.lines.size());
  for (const PlanePin& pin : pins) {
    if (pin.column > 0 && pin.column < size.columns)
      passing[static_cast<std::size_t>(pin.column - 1)].push_back({pin.at.y, pin.at.x});
    if (pin.row > 0 && pin.row < size.rows)
      passing[static_cast<std::size_t>(size.columns - 1 + pin.row - 1)].push_back({pin.at.x, pin.at.y});
  }
  for (std::size_t l = 0; l < lines.lines.size(); ++l) {
    CutLine& line = lines.lines[l];
    const double spacing = line.upright ? lines.height / size.rows : lines.width / size.columns;
    for (const Passing& pass : passing[l]) {
      // No farther than the next vertex that is pinned, which stays.
      constexpr double kNear = 0.75, kClear = 1.5;  // of a spacing, pixels
      double reach = kNear * spacing;
      for (const Passing& other : passing[l])
        if (&other != &pass) reach = std::min(reach, std::abs(other.along - pass.along) - kClear);
      CutLine aside = line;
      for (std::size_t i = 0; i < line.at.size(); ++i) {
        const double t = (line.first + static_cast<double>(i) + 0.5 - pass.along) / reach;
        aside.at[i] = std::abs(t) < 1 ? (1 - t * t) * (1 - t * t) : 0;
      }
      const double here = aside(pass.along);
      if (here <= 0) continue;
      const double by = (pass.across - line(pass.along)) / here;
      for (std::size_t i = 0; i < line.at.size(); ++i) line.at[i] += by * aside.at[i];
    }
  }
}

Result<CutLines> fitted_to_tones(CutLines lines, const cv::Mat& tones, const FitOptions& options,
                                 const std::stop_token& stop) {
  CutLines straight = lines;
  for (CutLine& line : straight.lines) std::fill(line.at.begin(), line.at.end(), line.straight);
  const CutOptions cut{options.reach, options.gap, options.gap / 4, 0};
  std::vector<FaceCost> costs(lines.faces.size());
  double scale = 0;  // mean cost of a pixel that a patch may come to have
  for (int round = 0; round <= kToneRounds; ++round) {
    const FaceTones faces(straight, lines, tones, options.counts, options.reach);
    std::vector<double> own(costs.size());
    const Status done = run_parallel(costs.size(), options.threads, stop, [&](std::size_t f) {
      const bool is_cut = !options.halves.empty() && options.halves[f];
      const double tone = is_cut ? 0 : faces.tone(f);
      costs[f] = faces.cost(f, is_cut ? *options.halves[f] : std::array{tone, tone}, kFarCost * scale);
      own[f] = cv::mean(costs[f].cost)[0];
    });
    if (!done.ok()) return done.error();
    if (round == 0) {
      for (const double cost : own) scale += cost / static_cast<double>(own.size());
      if (scale == 0) return lines;
      continue;
    }
    reroute_all(lines, costs, cut, 1);
  }
  if (stop.stop_requested()) return cancelled();
  smooth_all(lines, costs, cut, kControlStride, kTurnCost * scale * kControlStride * options.reach * 2, kSmoothRounds);
  return lines;
}

}  // namespace veneer::planner
