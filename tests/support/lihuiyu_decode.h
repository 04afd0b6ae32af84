// Reads a program back with the simulator's own interpreter and compares it with the path that was asked for.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/laser_job.h"
#include "drivers/sim/lihuiyu_board/gl_interpreter.h"

namespace veneer::tests {

struct MilSegment {
  double ax, ay, bx, by;  // mils on the board
  bool beam;
};

struct Decoded {
  std::vector<MilSegment> moves;  // in compact mode and default mode
  std::vector<sim::GlAction> actions;
  std::vector<std::string> complaints;
  double x = 0, y = 0;  // where it ended
  bool finished = false;
};

inline Decoded decode(std::string_view text, double x = 0, double y = 0) {
  sim::GlInterpreter interpreter;
  interpreter.feed(text);
  Decoded out;
  out.x = x;
  out.y = y;
  out.actions = interpreter.take_actions();
  for (const sim::GlAction& action : out.actions) {
    if (action.kind == sim::GlAction::Kind::kFinish) out.finished = true;
    if (action.kind != sim::GlAction::Kind::kMove) continue;
    const MilSegment segment{out.x, out.y, out.x + static_cast<double>(action.dx),
                             out.y + static_cast<double>(action.dy), action.beam};
    out.moves.push_back(segment);
    out.x = segment.bx;
    out.y = segment.by;
  }
  out.complaints = interpreter.complaints();
  return out;
}

// Where a path lies on a board with this travel, in mils.
inline std::vector<MilSegment> on_board(const Polyline<MachineFrame>& path, double travel_y_mm) {
  std::vector<MilSegment> segments;
  for (std::size_t i = 1; i < path.size(); ++i)
    segments.push_back({path[i - 1].x.count() / 0.0254, (travel_y_mm - path[i - 1].y.count()) / 0.0254,
                        path[i].x.count() / 0.0254, (travel_y_mm - path[i].y.count()) / 0.0254, true});
  return segments;
}

// The larger of the distances in x and in y from a place to the nearest place of a segment.
inline double axis_distance(double x, double y, const MilSegment& s) {
  const double dx = s.ax - x, dy = s.ay - y, ux = s.bx - s.ax, uy = s.by - s.ay;
  const auto at = [&](double t) { return std::max(std::abs(dx + t * ux), std::abs(dy + t * uy)); };
  // Along the segment it is convex and made of straight pieces, which meet where one distance is none or both are
  // equal.
  double least = std::min(at(0), at(1));
  const auto meet = [&](double value, double slope) {  // where value + t * slope is 0
    if (value * slope < 0 && std::abs(value) < std::abs(slope)) least = std::min(least, at(-value / slope));
  };
  meet(dx, ux), meet(dy, uy), meet(dx - dy, ux - uy), meet(dx + dy, ux + uy);
  return least;
}

// Places along these segments, at most half a mil apart.
inline std::vector<std::pair<double, double>> places_on(const std::vector<MilSegment>& segments) {
  std::vector<std::pair<double, double>> places;
  for (const MilSegment& s : segments) {
    const int n = 1 + static_cast<int>(2 * std::hypot(s.bx - s.ax, s.by - s.ay));
    for (int i = 0; i <= n; ++i) places.emplace_back(s.ax + (s.bx - s.ax) * i / n, s.ay + (s.by - s.ay) * i / n);
  }
  return places;
}

// How far the farthest place of `segments` is from `others`.
inline double farthest(const std::vector<MilSegment>& segments, const std::vector<MilSegment>& others) {
  double worst = 0;
  for (const auto& [x, y] : places_on(segments)) {
    double best = 1e9;
    for (const MilSegment& s : others) {
      if (std::min(s.ax, s.bx) - x > best || x - std::max(s.ax, s.bx) > best || std::min(s.ay, s.by) - y > best ||
          y - std::max(s.ay, s.by) > best)
        continue;
      best = std::min(best, axis_distance(x, y, s));
    }
    worst = std::max(worst, best);
  }
  return worst;
}

}  // namespace veneer::tests
