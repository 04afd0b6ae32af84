// A job for the Lihuiyu tests, and whether a piece of it was burnt: everywhere, and nowhere else.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "drivers/laser_job.h"
#include "drivers/sim/grbl_controller/burn_sink.h"

namespace veneer::tests {

inline constexpr double kLihuiyuTravelX = 300, kLihuiyuTravelY = 200;

// Pieces with an engraved line and an odd outline with a round side, two strokes each.
inline LaserJob odd_job(int pieces, double power = 1, double size_mm = 4, double cut_mm_s = 20) {
  LaserJob job;
  for (int i = 0; i < pieces; ++i) {
    const int column = i % 20, row = i / 20;
    const double x = 50 + (size_mm + 3) * column, y = 80 + (size_mm + 3) * row;
    const PieceId piece{i + 1};
    job.strokes.push_back({piece,
                           StrokeRole::kEngrave,
                           {point<MachineFrame>(x + 1, y + 1.0333), point<MachineFrame>(x + 2.12345, y + 1.4321)},
                           MmPerSecond(80),
                           PowerFraction(power),
                           1});
    Polyline<MachineFrame> outline{point<MachineFrame>(x, y), point<MachineFrame>(x + size_mm, y + 0.37)};
    for (int k = 0; k <= 24; ++k)
      outline.push_back(point<MachineFrame>(x + size_mm / 2 * (1 + std::cos(k * kPi / 24)),
                                            y + size_mm * 0.6 + size_mm * 0.4 * std::sin(k * kPi / 24)));
    outline.push_back(outline.front());
    job.strokes.push_back({piece, StrokeRole::kCut, outline, MmPerSecond(cut_mm_s), PowerFraction(power), 1});
  }
  return job;
}

// Half a mil in x and in y for the steps, and 0.02 mm.
inline constexpr double kBurnTolerance = 0.02 + 0.5 * 0.0254 * 1.4142136;

struct MmLeg {
  double ax, ay, bx, by;
};

inline double distance_to(const MmLeg& leg, double x, double y) {
  const double dx = leg.bx - leg.ax, dy = leg.by - leg.ay, l2 = dx * dx + dy * dy;
  const double t = l2 > 0 ? std::clamp(((x - leg.ax) * dx + (y - leg.ay) * dy) / l2, 0.0, 1.0) : 0.0;
  return std::hypot(x - leg.ax - t * dx, y - leg.ay - t * dy);
}

// The farthest place of `from` from `to`, looked at every 0.01 mm.
inline double one_sided_hausdorff(const std::vector<MmLeg>& from, const std::vector<MmLeg>& to) {
  double worst = 0;
  for (const MmLeg& leg : from) {
    const int n = 1 + static_cast<int>(std::hypot(leg.bx - leg.ax, leg.by - leg.ay) / 0.01);
    for (int i = 0; i <= n; ++i) {
      const double x = leg.ax + (leg.bx - leg.ax) * i / n, y = leg.ay + (leg.by - leg.ay) * i / n;
      double best = 1e9;
      for (const MmLeg& other : to) {
        if (std::min(other.ax, other.bx) - x > best || x - std::max(other.ax, other.bx) > best ||
            std::min(other.ay, other.by) - y > best || y - std::max(other.ay, other.by) > best)
          continue;
        best = std::min(best, distance_to(other, x, y));
      }
      worst = std::max(worst, best);
    }
  }
  return worst;
}

inline std::vector<MmLeg> planned_legs(const LaserJob& job, PieceId piece) {
  std::vector<MmLeg> legs;
  for (const Stroke& stroke : job.strokes) {
    if (stroke.piece != piece) continue;
    for (std::size_t i = 1; i < stroke.path.size(); ++i)
      legs.push_back({stroke.path[i - 1].x.count(), stroke.path[i - 1].y.count(), stroke.path[i].x.count(),
                      stroke.path[i].y.count()});
  }
  return legs;
}

// Runs of equal direction joined, as they are hundreds of single steps.
inline std::vector<MmLeg> burnt_legs(std::span<const sim::BurnSegment> burns) {
  std::vector<MmLeg> legs;
  for (const sim::BurnSegment& burn : burns) {
    if (burn.length_mm() <= 0) continue;
    legs.push_back({burn.from.x_mm + kLihuiyuTravelX, burn.from.y_mm + kLihuiyuTravelY, burn.to.x_mm + kLihuiyuTravelX,
                    burn.to.y_mm + kLihuiyuTravelY});
  }
  return legs;
}

// Empty when these burns are the piece, the whole piece and nothing but the piece. `hausdorff_mm`, when given, grows to
// what was found.
inline std::string wrong_piece(const LaserJob& job, PieceId piece, std::span<const sim::BurnSegment> burns,
                               double* hausdorff_mm = nullptr) {
  const auto planned = planned_legs(job, piece), burnt = burnt_legs(burns);
  if (burnt.empty()) return "nothing was burnt";
  const double outside = one_sided_hausdorff(burnt, planned), missing = one_sided_hausdorff(planned, burnt);
  if (hausdorff_mm != nullptr) *hausdorff_mm = std::max({*hausdorff_mm, outside, missing});
  if (outside > kBurnTolerance) return "burnt " + std::to_string(outside) + " mm beside the path";
  if (missing > kBurnTolerance) return "a place " + std::to_string(missing) + " mm from the next burn is not burnt";
  double wanted = 0, found = 0;
  for (const MmLeg& leg : planned) wanted += std::max(std::abs(leg.bx - leg.ax), std::abs(leg.by - leg.ay));
  for (const MmLeg& leg : burnt) found += std::max(std::abs(leg.bx - leg.ax), std::abs(leg.by - leg.ay));
  // Twice over the same place would be within the tolerance.
  if (std::abs(found - wanted) > 0.04 * static_cast<double>(planned.size()) + 0.05)
    return "burnt " + std::to_string(found) + " of " + std::to_string(wanted) + " mm";
  return {};
}

}  // namespace veneer::tests
