#include "base/arc_fit.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace veneer {
namespace {

constexpr double kPi2 = 2 * std::numbers::pi;

std::vector<MicroPoint> arc_points(double cx, double cy, double radius, double from, double turn, int lines) {
  std::vector<MicroPoint> path;
  for (int i = 0; i <= lines; ++i) {
    const double a = from + turn * i / lines;
    path.push_back({std::llround(cx + radius * std::cos(a)), std::llround(cy + radius * std::sin(a))});
  }
  return path;
}

// The farthest that the moves, walked finely, lie from the path's lines.
double farthest_um(const std::vector<MicroPoint>& path, const std::vector<PathMove>& moves) {
  const auto to_path = [&](double x, double y) {
    double nearest = 1e18;
    for (std::size_t i = 1; i < path.size(); ++i) {
      const double ax = static_cast<double>(path[i - 1].x_um), ay = static_cast<double>(path[i - 1].y_um);
      const double ux = static_cast<double>(path[i].x_um) - ax, uy = static_cast<double>(path[i].y_um) - ay;
      const double squared = ux * ux + uy * uy;
      const double t = squared > 0 ? std::clamp(((x - ax) * ux + (y - ay) * uy) / squared, 0.0, 1.0) : 0;
      nearest = std::min(nearest, std::hypot(x - ax - t * ux, y - ay - t * uy));
    }
    return nearest;
  };
  double farthest = 0;
  MicroPoint at = path.front();
  for (const PathMove& move : moves) {
    if (move.arc) {
      const double turn = arc_turn_rad(at, move.to, *move.arc) * (move.arc->clockwise ? -1 : 1);
      const double sx = static_cast<double>(at.x_um - move.arc->centre.x_um);
      const double sy = static_cast<double>(at.y_um - move.arc->centre.y_um);
      for (int k = 0; k <= 100; ++k) {
        const double c = std::cos(turn * k / 100), s = std::sin(turn * k / 100);
        farthest = std::max(farthest, to_path(static_cast<double>(move.arc->centre.x_um) + c * sx - s * sy,
                                              static_cast<double>(move.arc->centre.y_um) + s * sx + c * sy));
      }
    }
    at = move.to;
  }
  return farthest;
}

TEST(ArcFit, MakesTwoArcsAndABitOfACircle) {
  const auto circle = arc_points(50000, 40000, 8000, 0.3, kPi2, 90);
  const auto moves = fit_arcs(circle);
  EXPECT_LE(moves.size(), 4U);
  EXPECT_EQ(moves.back().to, circle.back());
  for (const auto& move : moves) EXPECT_FALSE(move.arc && move.arc->clockwise);
  EXPECT_LE(farthest_um(circle, moves), 10);
}

TEST(ArcFit, LeavesCornersAndStraightLinesAlone) {
  const std::vector<MicroPoint> square = {{0, 0}, {10000, 0}, {10000, 10000}, {0, 10000}, {0, 0}};
  const auto moves = fit_arcs(square);
  ASSERT_EQ(moves.size(), 4U);
  for (const auto& move : moves) EXPECT_FALSE(move.arc);
  std::vector<MicroPoint> straight;
  for (int i = 0; i < 30; ++i) straight.push_back({i * 1000, i * 333});
  for (const auto& move : fit_arcs(straight)) EXPECT_FALSE(move.arc);
  // A regular octagon has its corners on a circle, and is none.
  for (const auto& move : fit_arcs(arc_points(0, 0, 5000, 0, kPi2, 8))) EXPECT_FALSE(move.arc);
}

TEST(ArcFit, KnowsWhichWayRoundItGoes) {
  const auto moves = fit_arcs(arc_points(0, 0, 5000, 1, -2.5, 60));
  ASSERT_EQ(moves.size(), 1U);
  ASSERT_TRUE(moves[0].arc);
  EXPECT_TRUE(moves[0].arc->clockwise);
  EXPECT_NEAR(arc_turn_rad(arc_points(0, 0, 5000, 1, -2.5, 60)[0], moves[0].to, *moves[0].arc), 2.5, 1e-3);
}

TEST(ArcFit, MakesNoArcsOfWideCurves) {
  for (const auto& move : fit_arcs(arc_points(0, 0, 60000, 0, 1, 60))) EXPECT_FALSE(move.arc);
}

RC_GTEST_PROP(ArcFit, StaysWithinAHundredthOfAMillimetreOfAnyPath, ()) {
  // Curves of changing bend, with corners between them.
  std::vector<MicroPoint> path = {{100000, 100000}};
  double x = 100000, y = 100000, heading = 0;
  const int pieces = *rc::gen::inRange(1, 6);
  for (int p = 0; p < pieces; ++p) {
    heading += *rc::gen::inRange(-300, 300) / 100.0;
    const double step = *rc::gen::inRange(50, 1500);
    double bend = *rc::gen::inRange(-200, 200) / 1000.0;
    const double change = *rc::gen::inRange(-10, 10) / 10000.0;
    for (int i = 0, n = *rc::gen::inRange(1, 40); i < n; ++i) {
      x += step * std::cos(heading), y += step * std::sin(heading);
      heading += bend, bend += change;
      path.push_back({std::llround(x), std::llround(y)});
    }
  }
  const auto moves = fit_arcs(path);
  RC_ASSERT(moves.back().to == path.back());
  RC_ASSERT(farthest_um(path, moves) <= 10);
  MicroPoint at = path.front();
  for (const auto& move : moves) {
    if (move.arc) {
      const auto r = [&](MicroPoint q) {
        return std::hypot(static_cast<double>(q.x_um - move.arc->centre.x_um),
                          static_cast<double>(q.y_um - move.arc->centre.y_um));
      };
      // What GRBL demands: 5 um between the two radii.
      RC_ASSERT(std::abs(r(at) - r(move.to)) <= 3);
      RC_ASSERT(arc_turn_rad(at, move.to, *move.arc) < 3);
    }
    at = move.to;
  }
}

// There and back, and around a square: no circle goes through the ends, which are one point.
TEST(ArcFit, LeavesPathsThatReturnToTheirBeginningAlone) {
  const std::vector<MicroPoint> back{{1000, 2000}, {3000, 2000}, {5000, 2000}, {3000, 2000}, {1000, 2000}};
  const std::vector<MicroPoint> square{{0, 0}, {4000, 0}, {4000, 4000}, {0, 4000}, {0, 0}};
  for (const auto& path : {back, square}) {
    EXPECT_FALSE(fit_arc(path));
    for (const PathMove& move : fit_arcs(path)) EXPECT_FALSE(move.arc);
  }
}

}  // namespace
}  // namespace veneer
