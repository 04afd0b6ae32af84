#include "base/arc_fit.h"

#include <cmath>
#include <numbers>

namespace veneer {
namespace {

constexpr std::size_t kLeastLines = 3, kMostLines = 96;
constexpr double kLongestLineTurn = std::numbers::pi / 4;

double dx(MicroPoint a, MicroPoint b) { return static_cast<double>(b.x_um - a.x_um); }
double dy(MicroPoint a, MicroPoint b) { return static_cast<double>(b.y_um - a.y_um); }
double length(MicroPoint a, MicroPoint b) { return std::hypot(dx(a, b), dy(a, b)); }

// From `from` to `to` around the centre, counter-clockwise positive, in (-pi, pi].
double turn_between(MicroPoint centre, MicroPoint from, MicroPoint to) {
  const double ax = dx(centre, from), ay = dy(centre, from), bx = dx(centre, to), by = dy(centre, to);
  return std::atan2(ax * by - ay * bx, ax * bx + ay * by);
}

// The circle through the ends and the middle point of the run; none when they are nearly in line.
std::optional<MicroPoint> centre_of(std::span<const MicroPoint> run, double largest_radius) {
  const MicroPoint a = run.front(), b = run[run.size() / 2], c = run.back();
  const double bx = dx(a, b), by = dy(a, b), cx = dx(a, c), cy = dy(a, c);
  const double twice_area = 2 * (bx * cy - by * cx);
  const double b2 = bx * bx + by * by, c2 = cx * cx + cy * cy;
  // A path that comes back to where it began has no such circle either: both sides are 0 then.
  if (std::abs(twice_area) * largest_radius <= std::sqrt(b2 * c2) * length(b, c)) return std::nullopt;
  return MicroPoint{a.x_um + std::llround((cy * b2 - by * c2) / twice_area),
                    a.y_um + std::llround((bx * c2 - cx * b2) / twice_area)};
}

std::optional<ArcShape> arc_through(std::span<const MicroPoint> run, const ArcFitOptions& options) {
  const auto centre = centre_of(run, options.largest_radius_um);
  if (!centre) return std::nullopt;
  const double radius = length(*centre, run.front());
  if (std::abs(length(*centre, run.back()) - radius) > options.end_tolerance_um) return std::nullopt;
  const bool clockwise = turn_between(*centre, run[0], run[1]) < 0;
  double turned = 0;
  for (std::size_t i = 1; i < run.size(); ++i) {
    const double turn = (clockwise ? -1 : 1) * turn_between(*centre, run[i - 1], run[i]);
    if (turn <= 0 || turn > kLongestLineTurn) return std::nullopt;
    turned += turn;
    if (std::abs(length(*centre, run[i]) - radius) > options.tolerance_um) return std::nullopt;
    // Between its ends the line lies inside the circle.
    const double middle_x = (dx(*centre, run[i - 1]) + dx(*centre, run[i])) / 2;
    const double middle_y = (dy(*centre, run[i - 1]) + dy(*centre, run[i])) / 2;
    if (std::abs(std::hypot(middle_x, middle_y) - radius) > options.tolerance_um) return std::nullopt;
  }
  if (turned > options.longest_turn_rad) return std::nullopt;
  return ArcShape{*centre, clockwise};
}

}  // namespace

std::vector<PathMove> fit_arcs(std::span<const MicroPoint> path, const ArcFitOptions& options) {
  std::vector<PathMove> moves;
  for (std::size_t at = 0; at + 1 < path.size();) {
    std::optional<ArcShape> best;
    std::size_t end = at + 1;
    for (std::size_t lines = kLeastLines; lines <= kMostLines && at + lines < path.size(); ++lines) {
      const auto arc = arc_through(path.subspan(at, lines + 1), options);
      if (!arc) break;
      best = arc;
      end = at + lines;
    }
    moves.push_back({path[end], best, end - at});
    at = end;
  }
  return moves;
}

std::optional<ArcShape> fit_arc(std::span<const MicroPoint> path, const ArcFitOptions& options) {
  return path.size() > kLeastLines ? arc_through(path, options) : std::nullopt;
}

double arc_turn_rad(MicroPoint from, MicroPoint to, const ArcShape& arc) {
  double turn = turn_between(arc.centre, from, to);
  if (arc.clockwise) turn = -turn;
  return turn > 0 ? turn : turn + 2 * std::numbers::pi;
}

}  // namespace veneer
