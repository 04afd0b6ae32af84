#include "daemon/unit/preflight.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

namespace veneer::daemon {
namespace {

Error refuse(const PieceBurn& burn, const std::string& what) {
  return {ErrorCode::kRefused, burn.mark.empty() ? what : fmt::format("piece {}: {}", burn.mark, what)};
}

// How far `p` lies beyond the travel, and where the panel must go to cure it.
std::string beyond(const Box<MachineFrame>& travel, const Point<MachineFrame>& p) {
  const std::array<std::pair<double, const char*>, 4> sides{
      {{(travel.min.x - p.x).count(), "left side: move the panel to the right"},
       {(p.x - travel.max.x).count(), "right side: move the panel to the left"},
       {(travel.min.y - p.y).count(), "front: move the panel back"},
       {(p.y - travel.max.y).count(), "back: move the panel forward"}}};
  const auto worst = std::max_element(sides.begin(), sides.end());
  return fmt::format("its cut would leave the machine's travel by {:.1f} mm at the {}", worst->first, worst->second);
}

Status check_recipe(const PieceBurn& burn, const Stroke& stroke, const LaserLimits& limits) {
  if (!(stroke.speed.count() > 0) || !(stroke.power.count() >= 0 && stroke.power.count() <= 1) || stroke.passes < 1)
    return refuse(burn, "its recipe has no possible speed, power or number of passes: correct the recipe");
  if (limits.fastest.count() > 0 && stroke.speed > limits.fastest)
    return refuse(burn, fmt::format("its recipe asks for {:.0f} mm/s, the machine can {:.0f}: lower the recipe's speed",
                                    stroke.speed.count(), limits.fastest.count()));
  return Ok();
}

// Of one pass only: more of them go back and forth over the path itself.
bool makes_run_ups(const Stroke& stroke) { return stroke.passes == 1 && stroke.overscan > Millimetres(0); }

// Where the head goes for a stroke: its path, with the run-up and the run-out of a fill's line where the machine makes
// them.
Polyline<MachineFrame> way_of(const Stroke& stroke, DarkWays ways) {
  Polyline<MachineFrame> way = stroke.path;
  if (ways == DarkWays::kWithinBox) return way;
  const auto lengthen = [&](const Point<MachineFrame>& from, Point<MachineFrame>& end) {
    const double length = distance(from, end).count();
    if (!(length > 0)) return;
    const double share = stroke.overscan.count() / length;
    end = {end.x + (end.x - from.x) * share, end.y + (end.y - from.y) * share};
  };
  if (makes_run_ups(stroke)) {
    lengthen(stroke.path[1], way.front());
    lengthen(stroke.path[stroke.path.size() - 2], way.back());
  }
  return way;
}

// Where it is at the end of all passes.
Point<MachineFrame> end_of(const Stroke& stroke, const Polyline<MachineFrame>& way, DarkWays ways) {
  const bool turned = ways == DarkWays::kStraight && stroke.passes % 2 == 0;
  return turned ? way.front() : way.back();
}

Error in_the_way(const PieceBurn& burn, const KeepOut& zone) {
  return refuse(burn,
                fmt::format("the head would cross the zone \"{}\" on its way: move the panel, or the thing and its "
                            "zone in the configuration",
                            zone.name));
}

double cross(const Point<MachineFrame>& o, const Point<MachineFrame>& a, const Point<MachineFrame>& b) {
  return (a.x - o.x).count() * (b.y - o.y).count() - (a.y - o.y).count() * (b.x - o.x).count();
}

}  // namespace

bool is_leaving_door(const LaserStatus& laser) { return laser.state == "Door:3"; }

bool lid_is_open(const LaserStatus& laser) {
  return laser.lid_open.value_or(false) ||
         (laser.state.starts_with("Door") && laser.state != "Door:0" && !is_leaving_door(laser));
}

Status check_lid(const LaserStatus& laser) {
  if (lid_is_open(laser)) return Error{ErrorCode::kRefused, "the lid is open: close it"};
  if (is_leaving_door(laser))
    return Error{ErrorCode::kRefused,
                 "the lid is closed again, and the controller is still coming out of its wait: wait a few seconds"};
  return Ok();
}

bool stands_still(const LaserStatus& laser) {
  if (!laser.connected) return true;
  constexpr std::string_view kMoving[] = {"Run", "Jog", "Home", "Hold", "Held", "Door:2", "Door:3"};
  return std::ranges::none_of(kMoving, [&](std::string_view word) { return laser.state.starts_with(word); });
}

Status check_machine(const LaserStatus& laser) {
  if (!laser.connected)
    return Error{ErrorCode::kRefused, "the laser is not connected: switch it on, then Stop and Reset"};
  if (Status closed = check_lid(laser); !closed) return closed;
  if (laser.state.rfind("Alarm", 0) == 0)
    return Error{ErrorCode::kRefused, "the laser is in alarm: clear what stopped it, then Stop and Reset"};
  if (!laser.homed) return Error{ErrorCode::kRefused, "the laser does not know where it is: Stop, then Reset homes it"};
  if (!laser.refusal.empty()) return Error{ErrorCode::kRefused, laser.refusal};
  return Ok();
}

Status check_before_homing(const LaserStatus& laser) {
  if (!laser.connected) return Ok();
  if (Status closed = check_lid(laser); !closed) return closed;
  if (!laser.refusal.empty()) return Error{ErrorCode::kRefused, laser.refusal};
  return Ok();
}

bool crosses(const Box<MachineFrame>& box, const Point<MachineFrame>& a, const Point<MachineFrame>& b) {
  if (box.empty()) return false;
  // Liang and Barsky: the part of the way that lies between the box's four lines.
  double begin = 0, end = 1;
  const auto clip = [&](double from, double step, double low, double high) {
    if (step == 0) return from >= low && from <= high;
    const double t0 = (low - from) / step, t1 = (high - from) / step;
    begin = std::max(begin, std::min(t0, t1));
    end = std::min(end, std::max(t0, t1));
    return begin <= end;
  };
  return clip(a.x.count(), (b.x - a.x).count(), box.min.x.count(), box.max.x.count()) &&
         clip(a.y.count(), (b.y - a.y).count(), box.min.y.count(), box.max.y.count());
}

const KeepOut* zone_on_way(std::span<const KeepOut> keep_out, DarkWays ways, const Point<MachineFrame>& a,
                           const Point<MachineFrame>& b) {
  Box<MachineFrame> box;
  box.add(a), box.add(b);
  const auto touched = [&](const KeepOut& zone) {
    if (ways == DarkWays::kStraight || zone.area.empty()) return crosses(zone.area, a, b);
    return box.min.x <= zone.area.max.x && box.max.x >= zone.area.min.x && box.min.y <= zone.area.max.y &&
           box.max.y >= zone.area.min.y;
  };
  const auto found = std::ranges::find_if(keep_out, touched);
  return found == keep_out.end() ? nullptr : &*found;
}

namespace {

// What the head stands in: the box about all zones that hold it, and which of its sides the head can reach straight on.
// A side beyond the travel, or behind another zone, is none.
struct Stand {
  Box<MachineFrame> box;
  std::string name;
  bool left = false, right = false, down = false, up = false;
};

Stand stand_of(std::span<const KeepOut> keep_out, const Box<MachineFrame>& travel, const Point<MachineFrame>& at) {
  Stand out;
  for (const auto& [name, area] : keep_out) {
    if (!area.contains(at)) continue;
    if (out.name.empty()) out.name = name;
    out.box.add(area.min), out.box.add(area.max);
  }
  const auto is_free = [&](const Point<MachineFrame>& side) {
    return std::ranges::none_of(
        keep_out, [&](const KeepOut& zone) { return !zone.area.contains(at) && crosses(zone.area, at, side); });
  };
  out.left = out.box.min.x > travel.min.x && is_free({out.box.min.x, at.y});
  out.right = out.box.max.x < travel.max.x && is_free({out.box.max.x, at.y});
  out.down = out.box.min.y > travel.min.y && is_free({at.x, out.box.min.y});
  out.up = out.box.max.y < travel.max.y && is_free({at.x, out.box.max.y});
  return out;
}

// Outside of all zones, or in some that it can leave straight on.
bool gets_out(std::span<const KeepOut> keep_out, const Box<MachineFrame>& travel, const Point<MachineFrame>& at) {
  const Stand in = stand_of(keep_out, travel, at);
  return in.box.empty() || in.left || in.right || in.down || in.up;
}

const KeepOut* zone_entered(std::span<const KeepOut> keep_out, const Point<MachineFrame>& from,
                            const Point<MachineFrame>& to) {
  const auto found = std::ranges::find_if(
      keep_out, [&](const KeepOut& zone) { return !zone.area.contains(from) && crosses(zone.area, from, to); });
  return found == keep_out.end() ? nullptr : &*found;
}

// Where nothing leads straight out: the shortest way along one axis to a place from which something does, past an edge
// of a zone. Never into a zone that the head does not stand in.
struct FirstLeg {
  Millimetres dx{0}, dy{0};
};
std::optional<FirstLeg> first_leg(std::span<const KeepOut> keep_out, const Box<MachineFrame>& travel,
                                  const Point<MachineFrame>& from) {
  constexpr Millimetres kPast{0.5};
  std::optional<FirstLeg> best;
  const auto length = [](const FirstLeg& leg) { return std::abs(leg.dx.count()) + std::abs(leg.dy.count()); };
  const auto consider = [&](const FirstLeg& leg) {
    const Point<MachineFrame> to{from.x + leg.dx, from.y + leg.dy};
    if (best && length(*best) <= length(leg)) return;
    if (travel.contains(to) && zone_entered(keep_out, from, to) == nullptr && gets_out(keep_out, travel, to))
      best = leg;
  };
  for (const auto& [name, area] : keep_out) {
    for (const Millimetres x : {area.min.x - kPast, area.max.x + kPast}) consider({x - from.x, Millimetres(0)});
    for (const Millimetres y : {area.min.y - kPast, area.max.y + kPast}) consider({Millimetres(0), y - from.y});
  }
  return best;
}

// "12.5 mm to the left".
std::string words_for(const FirstLeg& leg) {
  if (leg.dx != Millimetres(0))
    return fmt::format("{:.1f} mm to the {}", std::abs(leg.dx.count()), leg.dx < Millimetres(0) ? "left" : "right");
  return fmt::format("{:.1f} mm to the {}", std::abs(leg.dy.count()), leg.dy < Millimetres(0) ? "front" : "back");
}

// Is a jog this leg, the beginning of it, or, since steps of jogs seldom meet a leg's end, at most a step farther on
// where the head gets out as well? No more than that: all of it lies in zones.
bool is_on(const FirstLeg& leg, Millimetres dx, Millimetres dy, bool gets_out_there) {
  constexpr double kStep = 10;  // mm
  const bool along_x = leg.dx != Millimetres(0);
  const double wanted = (along_x ? leg.dx : leg.dy).count(), gone = (along_x ? dx : dy).count();
  if ((along_x ? dy : dx) != Millimetres(0) || wanted * gone < 0) return false;
  const double farther = std::abs(gone) - std::abs(wanted);
  return farther <= 0 || (farther <= kStep && gets_out_there);
}

// Does a step along one axis, `low` and `high` from its sides, lead out by the nearer of those that can be reached?
bool leads_out(Millimetres step, Millimetres low, Millimetres high, bool to_low, bool to_high) {
  if (step == Millimetres(0)) return true;
  if (step < Millimetres(0)) return to_low && (!to_high || low <= high);
  return to_high && (!to_low || high <= low);
}

}  // namespace

Status check_jog(std::span<const KeepOut> keep_out, const Box<MachineFrame>& travel, const Point<MachineFrame>& from,
                 Millimetres dx, Millimetres dy) {
  const Point<MachineFrame> to{from.x + dx, from.y + dy};
  if (const KeepOut* zone = zone_entered(keep_out, from, to))
    return Error{ErrorCode::kRefused, fmt::format("the zone \"{}\" lies in that way: go around it", zone->name)};
  const Stand in = stand_of(keep_out, travel, from);
  if (in.box.empty()) return Ok();
  if (!in.left && !in.right && !in.down && !in.up) {
    const auto leg = first_leg(keep_out, travel, from);
    if (!leg)
      return Error{
          ErrorCode::kRefused,
          fmt::format("the head stands in the zone \"{}\", and zones or the ends of its travel lie on all sides: "
                      "switch the machine off and move its head by hand, or correct [[keep_out]]",
                      in.name)};
    if (is_on(*leg, dx, dy, gets_out(keep_out, travel, to))) return Ok();
    return Error{ErrorCode::kRefused,
                 fmt::format("the head stands in the zone \"{}\", and nothing leads straight out: jog it {} first, and "
                             "out of the zone from there",
                             in.name, words_for(*leg))};
  }
  if (!leads_out(dx, from.x - in.box.min.x, in.box.max.x - from.x, in.left, in.right) ||
      !leads_out(dy, from.y - in.box.min.y, in.box.max.y - from.y, in.down, in.up))
    return Error{ErrorCode::kRefused,
                 fmt::format("the head stands in the zone \"{}\": leave it by the nearer side", in.name)};
  return Ok();
}

Status check_strokes(std::span<const PieceBurn> burns, const LaserLimits& limits, std::span<const KeepOut> keep_out,
                     const Point<MachineFrame>& from) {
  if (burns.empty()) return Error{ErrorCode::kRefused, "there is nothing to burn"};
  Point<MachineFrame> at = from;
  for (const PieceBurn& burn : burns) {
    if (burn.strokes.strokes.empty()) return refuse(burn, "it has no strokes: plan the job again");
    for (const Stroke& stroke : burn.strokes.strokes) {
      if (stroke.path.size() < 2) return refuse(burn, "it has a stroke without length: plan the job again");
      if (Status good = check_recipe(burn, stroke, limits); !good) return good;
      const auto way = way_of(stroke, limits.dark_ways);
      for (std::size_t i = 0; i < way.size(); ++i) {
        const auto& p = way[i];
        if (!std::isfinite(p.x.count()) || !std::isfinite(p.y.count()))
          return refuse(burn, "its place on the bed cannot be computed: calibrate the laser again");
        if (!limits.travel.contains(p)) return refuse(burn, beyond(limits.travel, p));
        if (const KeepOut* zone = zone_on_way(keep_out, i == 0 ? limits.dark_ways : DarkWays::kStraight, at, p))
          return in_the_way(burn, *zone);
        at = p;
      }
      if (limits.dark_ways == DarkWays::kWithinBox && stroke.passes > 1)
        if (const KeepOut* zone = zone_on_way(keep_out, limits.dark_ways, way.back(), way.front()))
          return in_the_way(burn, *zone);
      at = end_of(stroke, way, limits.dark_ways);
    }
  }
  return Ok();
}

std::vector<Point<MachineFrame>> convex_hull(std::vector<Point<MachineFrame>> points) {
  const auto left_first = [](const auto& a, const auto& b) { return a.x != b.x ? a.x < b.x : a.y < b.y; };
  std::sort(points.begin(), points.end(), left_first);
  points.erase(std::unique(points.begin(), points.end()), points.end());
  if (points.size() < 3) return points;
  // Andrew's monotone chain: the lower side, then the upper one.
  std::vector<Point<MachineFrame>> hull;
  const auto take = [&hull](const Point<MachineFrame>& p, std::size_t kept) {
    while (hull.size() > kept && cross(hull[hull.size() - 2], hull.back(), p) <= 0) hull.pop_back();
    hull.push_back(p);
  };
  for (const auto& p : points) take(p, 1);
  const std::size_t lower = hull.size();
  for (auto p = points.rbegin() + 1; p != points.rend(); ++p) take(*p, lower);
  hull.pop_back();
  return hull;
}

LaserJob frame_of(std::span<const PieceBurn> burns, MmPerSecond speed, PowerFraction power) {
  std::vector<Point<MachineFrame>> points;
  for (const auto& burn : burns)
    for (const auto& stroke : burn.strokes.strokes) points.insert(points.end(), stroke.path.begin(), stroke.path.end());
  LaserJob job;
  auto hull = convex_hull(std::move(points));
  if (hull.size() < 2) return job;
  hull.push_back(hull.front());
  Stroke& stroke = job.strokes.emplace_back();
  stroke.role = StrokeRole::kPattern;
  stroke.path = std::move(hull);
  stroke.speed = speed;
  stroke.power = power;
  return job;
}

}  // namespace veneer::daemon
