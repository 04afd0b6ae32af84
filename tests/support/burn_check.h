// Compares what the simulated controller burnt with what a job asked for. For a travel of 520 x 380 mm.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "drivers/laser_job.h"
#include "drivers/sim/grbl_controller/burn_sink.h"

namespace veneer::tests {

struct Leg {
  double ax, ay, bx, by, energy;
};

inline std::vector<Leg> legs_of(const LaserJob& job, PieceId piece) {
  std::vector<Leg> legs;
  for (const Stroke& stroke : job.strokes) {
    if (stroke.piece != piece) continue;
    for (std::size_t i = 1; i < stroke.path.size(); ++i)
      legs.push_back({stroke.path[i - 1].x.count(), stroke.path[i - 1].y.count(), stroke.path[i].x.count(),
                      stroke.path[i].y.count(), stroke.power.count() / stroke.speed.count()});
  }
  return legs;
}

inline double length(const Leg& leg) { return std::hypot(leg.bx - leg.ax, leg.by - leg.ay); }

inline bool on_leg(const Leg& leg, double x, double y) {
  const double l = length(leg), t = ((x - leg.ax) * (leg.bx - leg.ax) + (y - leg.ay) * (leg.by - leg.ay)) / (l * l);
  const double u = std::clamp(t, 0.0, 1.0);
  return std::hypot(x - leg.ax - u * (leg.bx - leg.ax), y - leg.ay - u * (leg.by - leg.ay)) < 0.03;
}

// Empty when these burns are the piece, the whole piece and nothing but the piece.
inline std::string wrong_burn(const LaserJob& job, PieceId piece, std::span<const sim::BurnSegment> burns) {
  const auto legs = legs_of(job, piece);
  double planned = 0, burnt = 0;
  for (const Leg& leg : legs) planned += length(leg);
  for (const sim::BurnSegment& burn : burns) {
    const double x0 = burn.from.x_mm + 520, y0 = burn.from.y_mm + 380, x1 = burn.to.x_mm + 520, y1 = burn.to.y_mm + 380;
    burnt += burn.length_mm();
    // Both ends and the middle lie on legs of the right energy; an arc's chord may begin on one leg and end on the
    // next.
    const auto fits_at = [&](double x, double y) {
      return std::any_of(legs.begin(), legs.end(), [&](const Leg& leg) {
        // A touch of energy more or less is the controller's rounding of S and speed.
        const bool energy = burn.length_mm() < 0.02 || std::abs(burn.energy_per_mm() / leg.energy - 1) < 0.05;
        return energy && on_leg(leg, x, y);
      });
    };
    const bool fits = fits_at(x0, y0) && fits_at(x1, y1) && fits_at((x0 + x1) / 2, (y0 + y1) / 2);
    if (!fits)
      return "burnt (" + std::to_string(x0) + ", " + std::to_string(y0) + ") to (" + std::to_string(x1) + ", " +
             std::to_string(y1) + ") with " + std::to_string(burn.energy_per_mm());
  }
  if (std::abs(burnt - planned) > 0.1)
    return "burnt " + std::to_string(burnt) + " of " + std::to_string(planned) + " mm";
  return {};
}

}  // namespace veneer::tests
