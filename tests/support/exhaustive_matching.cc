#include "tests/support/exhaustive_matching.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "planner/parallel.h"

namespace veneer::planner::test {
namespace {

// Bilinear, at the centres of the lattice's pixels; the panel's border pixels are repeated beyond it.
cv::Mat turned_features(const cv::Mat& map, const Lattice& lattice) {
  const int channels = map.channels();
  cv::Mat out(lattice.height(), lattice.width(), map.type());
  for (int y = 0; y < out.rows; ++y) {
    auto* to = out.ptr<float>(y);
    for (int x = 0; x < out.cols; ++x) {
      double column = 0, row = 0;
      lattice.to_panel(x + 0.5, y + 0.5, column, row);
      column = std::clamp(column - 0.5, 0.0, map.cols - 1.0), row = std::clamp(row - 0.5, 0.0, map.rows - 1.0);
      const int c = static_cast<int>(column), r = static_cast<int>(row);
      const int right = std::min(c + 1, map.cols - 1), down = std::min(r + 1, map.rows - 1);
      const double fx = column - c, fy = row - r;
      for (int k = 0; k < channels; ++k) {
        const auto at = [&](int v, int u) { return static_cast<double>(map.ptr<float>(v)[u * channels + k]); };
        const double above = at(r, c) + fx * (at(r, right) - at(r, c));
        const double below = at(down, c) + fx * (at(down, right) - at(down, c));
        *to++ = static_cast<float>(above + fy * (below - above));
      }
    }
  }
  return out;
}

cv::Mat turned_free(const MatchPanel& panel, const Lattice& lattice) {
  const Raster<PanelFrame>& free = panel.wood.raster();
  cv::Mat out(lattice.height(), lattice.width(), CV_8UC1, cv::Scalar(0));
  for (int y = 0; y < out.rows; ++y) {
    for (int x = 0; x < out.cols; ++x) {
      double column = 0, row = 0, free_column = 0, free_row = 0;
      lattice.to_panel(x + 0.5, y + 0.5, column, row);
      if (column < 0 || row < 0 || column > panel.features.pixels.cols || row > panel.features.pixels.rows) continue;
      free.to_pixels(panel.features.from_pixels(column, row), free_column, free_row);
      if (free_column < 0 || free_row < 0 || free_column >= free.pixels.cols || free_row >= free.pixels.rows) continue;
      out.at<std::uint8_t>(y, x) =
          free.pixels.at<std::uint8_t>(static_cast<int>(free_row), static_cast<int>(free_column)) != 0 ? 255 : 0;
    }
  }
  return out;
}

// 1 where a pixel of the window belongs to the patch; empty when all do.
cv::Mat counted_pixels(const PatchPixels& pixels) {
  if (pixels.count == static_cast<std::int64_t>(pixels.width) * pixels.height) return {};
  cv::Mat counts(pixels.height, pixels.width, CV_32FC1, cv::Scalar(0));
  for (const PatchPixels::Span& span : pixels.spans)
    counts.row(span.row - pixels.top).colRange(span.begin - pixels.left, span.end - pixels.left).setTo(1);
  return counts;
}

double process_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

}  // namespace

ExhaustiveMatching::ExhaustiveMatching(std::span<const MatchPanel> panels, const std::vector<Radians>& turns,
                                       int threads)
    : panels_(panels), threads_(threads) {
  for (std::size_t p = 0; p < panels.size(); ++p)
    for (std::size_t r = 0; r < turns.size(); ++r)
      turned_.push_back({static_cast<int>(p),
                         static_cast<int>(r),
                         Lattice(panels[p].features.pixels.cols, panels[p].features.pixels.rows, turns[r]),
                         {},
                         {},
                         {},
                         {}});
  (void)run_parallel(turned_.size(), threads_, {}, [&](std::size_t i) {
    Turned& it = turned_[i];
    const MatchPanel& panel = panels_[static_cast<std::size_t>(it.panel)];
    cv::split(turned_features(panel.features.pixels, it.lattice), it.channels);
    it.free = turned_free(panel, it.lattice);
  });
}

void ExhaustiveMatching::erode(cv::Size window) {
  if (window == window_) return;
  window_ = window;
  for (Turned& it : turned_) {
    it.allowed = cv::Mat();
    if (it.free.cols < window.width || it.free.rows < window.height) continue;
    const cv::Mat all = cv::Mat::ones(window, CV_8UC1);
    cv::Mat eroded;
    cv::erode(it.free, eroded, all, {0, 0});
    it.allowed = eroded(cv::Rect(0, 0, it.free.cols - window.width + 1, it.free.rows - window.height + 1)).clone();
  }
}

void ExhaustiveMatching::allow(const cv::Mat& counts) {
  window_ = {};
  (void)run_parallel(turned_.size(), threads_, {}, [&](std::size_t i) {
    Turned& it = turned_[i];
    it.allowed = cv::Mat();
    if (it.free.cols < counts.cols || it.free.rows < counts.rows) return;
    cv::Mat blocked, covered;
    cv::Mat(it.free == 0).convertTo(blocked, CV_32FC1, 1.0 / 255);
    cv::matchTemplate(blocked, counts, covered, cv::TM_CCORR);
    it.allowed = covered < 0.5;
  });
}

void ExhaustiveMatching::match(Turned& turned, const std::vector<cv::Mat>& target, const cv::Mat& counts) const {
  turned.costs = cv::Mat();
  if (turned.allowed.empty()) return;
  cv::Mat one;
  for (std::size_t c = 0; c < target.size(); ++c) {
    cv::matchTemplate(turned.channels[c], target[c], c == 0 ? turned.costs : one, cv::TM_SQDIFF, counts);
    if (c > 0) turned.costs += one;
  }
  double least = 0;
  cv::minMaxLoc(turned.costs, &least, nullptr, nullptr, nullptr, turned.allowed);
}

ExhaustiveMatching::Answer ExhaustiveMatching::best(const MatchPatch& patch) {
  const PatchPixels& pixels = patch.pixels;
  const cv::Mat counts = counted_pixels(pixels);
  if (counts.empty())
    erode({pixels.width, pixels.height});
  else
    allow(counts);
  std::vector<cv::Mat> target;
  cv::split((*patch.features)(cv::Rect(pixels.left, pixels.top, pixels.width, pixels.height)), target);

  // One rotation a thread keeps every core busy; OpenCV's own threads would wait for each other.
  const int before = cv::getNumThreads();
  cv::setNumThreads(1);
  const auto start = std::chrono::steady_clock::now();
  const double cpu_start = process_seconds();
  (void)run_parallel(turned_.size(), threads_, {}, [&](std::size_t i) { match(turned_[i], target, counts); });
  Answer answer;
  answer.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  answer.cpu_seconds = process_seconds() - cpu_start;
  cv::setNumThreads(before);

  double energy = 0;
  for (const cv::Mat& channel : target) energy += channel.dot(channel);
  // What the spectrum and 32 bits can be wrong by, several times over.
  answer.best = cheapest_that_may_be_taken(patch, 1e-5 * (energy + 1e-3 * static_cast<double>(pixels.count)));
  return answer;
}

std::optional<LatticeCandidate> ExhaustiveMatching::cheapest_that_may_be_taken(const MatchPatch& patch,
                                                                               double slack) const {
  struct Place {
    float cost;
    const Turned* turned;
    int y, x;
  };
  // Rising costs, until nothing that is left can be cheaper than what was found.
  double least = 1e300, limit = 0;
  for (const Turned& it : turned_) {
    double value = 0;
    if (it.allowed.empty() || cv::countNonZero(it.allowed) == 0) continue;
    cv::minMaxLoc(it.costs, &value, nullptr, nullptr, nullptr, it.allowed);
    least = std::min(least, value);
  }
  if (least == 1e300) return std::nullopt;
  LatticeCandidate best;
  double done = -1e300;
  for (limit = 1.01 * std::max(least, 0.0) + slack; done < best.cost + slack; limit = 2 * limit + slack) {
    std::vector<Place> places;
    bool more = false;
    for (const Turned& it : turned_) {
      for (int y = 0; y < it.allowed.rows; ++y) {
        for (int x = 0; x < it.allowed.cols; ++x) {
          if (it.allowed.at<std::uint8_t>(y, x) == 0) continue;
          const float cost = it.costs.at<float>(y, x);
          more = more || cost > limit;
          if (cost > done && cost <= limit) places.push_back({cost, &it, y, x});
        }
      }
    }
    std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) { return a.cost < b.cost; });
    for (const Place& place : places) {
      if (place.cost > best.cost + slack) break;
      const MatchPanel& panel = panels_[static_cast<std::size_t>(place.turned->panel)];
      const auto pose = planner::panel_from_artwork(place.turned->lattice, panel.features, patch.grid,
                                                    patch.pixels.left, patch.pixels.top, place.x, place.y);
      if (!panel.wood.admits(pose * patch.outline)) continue;
      const LatticeCandidate candidate{placement_cost(*patch.features, patch.grid, patch.pixels, panel.features, pose),
                                       place.turned->panel, place.turned->rotation, place.y, place.x};
      best = std::min(best, candidate);
    }
    if (!more) break;
    done = limit;
  }
  if (best.cost == std::numeric_limits<double>::infinity()) return std::nullopt;
  return best;
}

}  // namespace veneer::planner::test
