#include "drivers/grbl/gcode.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "drivers/grbl/arc_guard.h"
#include "drivers/job_check.h"

namespace veneer::grbl {
namespace {

// "0.5", "-12.345", "3": micrometres as millimetres without idle zeros.
std::string mm_word(char axis, std::int64_t um) {
  const std::int64_t whole = std::abs(um) / 1000, part = std::abs(um) % 1000;
  std::string text = fmt::format("{}{}{}", axis, um < 0 ? "-" : "", whole);
  if (part != 0) {
    text += fmt::format(".{:03d}", part);
    text.erase(text.find_last_not_of('0') + 1);
  }
  return text;
}

// Speed and acceleration along a direction, under the axes' own limits.
struct Along {
  double length_mm, speed, acceleration;
};

Along along(WirePoint from, WirePoint to, double speed_mm_s, const MachineSettings& settings) {
  const double dx = std::abs(static_cast<double>(to.x_um - from.x_um)) / 1000;
  const double dy = std::abs(static_cast<double>(to.y_um - from.y_um)) / 1000;
  Along a{std::hypot(dx, dy), speed_mm_s, 1e9};
  if (a.length_mm <= 0) return a;
  const auto limit = [&](double share, const Axis& axis) {
    if (share <= 0) return;
    a.speed = std::min(a.speed, axis.max_rate_mm_s / share);
    a.acceleration = std::min(a.acceleration, axis.acceleration_mm_s2 / share);
  };
  limit(dx / a.length_mm, settings.x);
  limit(dy / a.length_mm, settings.y);
  return a;
}

double duration_s(const Along& a) {
  const double ramp = a.speed / a.acceleration;
  return a.length_mm >= a.speed * ramp ? a.length_mm / a.speed + ramp : 2 * std::sqrt(a.length_mm / a.acceleration);
}

// The longest distance that takes no longer than `time_s` from standstill to standstill.
double reach_mm(const Along& a, double time_s) {
  const double ramp = a.speed / a.acceleration;
  return time_s >= 2 * ramp ? a.speed * (time_s - ramp) : a.acceleration * time_s * time_s / 4;
}

class GroupWriter {
 public:
  GroupWriter(WirePoint at, const MachineSettings& settings, double longest_move_s)
      : at_(at), settings_(settings), longest_move_s_(longest_move_s) {
    hold_at(at);
  }

  void modal(const std::string& text) { lines_.push_back({text + "\n", LineKind::kModal, at_, at_}); }
  void dwell() { lines_.push_back({"G4P0.01\n", LineKind::kDwell, at_, at_}); }

  void stroke(const Stroke& stroke, std::size_t index) {
    std::vector<WirePoint> path;
    path.reserve(stroke.path.size());
    for (const auto& p : stroke.path) path.push_back(settings_.to_wire(p));
    const int feed = static_cast<int>(std::max(1L, std::lround(stroke.speed.count() * 60)));
    if (std::exchange(feed_, feed) != feed) {
      modal(fmt::format("F{}", feed));
      echo(index, GcodeLine::kAny);
    }
    const bool overscan = stroke.overscan.count() > 0 && stroke.passes == 1;
    const WirePoint run_up =
        overscan ? settings_.to_wire(beyond(stroke.path[0], stroke.path[1], stroke.overscan)) : path[0];
    travel_to(run_up);
    absolute_ = false;
    power_ = static_cast<int>(std::lround(stroke.power.count() * settings_.max_power));
    if (stroke.power.count() > 0) power_ = std::max(power_, 1);
    speed_mm_s_ = feed_ / 60.0;
    stroke_ = index;
    if (overscan) dark_to(path.front());
    set_power_ = true;
    for (int pass = 0; pass < stroke.passes; ++pass) {
      burn_along(path, stays_inside(stroke));
      // An open path is burnt back and forth.
      if (path.front() != path.back()) std::reverse(path.begin(), path.end());
    }
    if (overscan)
      dark_to(settings_.to_wire(beyond(*stroke.path.rbegin(), *(stroke.path.rbegin() + 1), stroke.overscan)));
    const auto last = std::find_if(lines_.rbegin(), lines_.rend(), [](const GcodeLine& l) { return l.moves(); });
    if (last == lines_.rend()) return;
    last->ends_stroke = true;
    last->stroke = index;
    // A lost or changed word may have switched the motion or the power off in between.
    if (last == lines_.rbegin()) echo(index, overscan ? 0 : power_);
  }

  void jog_to(WirePoint to, double speed_mm_s) {
    absolute_ = false;
    const auto feed = std::max(1L, std::lround(speed_mm_s * 60));
    move(to, static_cast<double>(feed) / 60, [&](WirePoint next) {
      lines_.push_back({fmt::format("$J=G91G21{}F{}\n", step_words(next), feed), LineKind::kTravel, at_, next});
    });
  }

  std::vector<GcodeLine> take() { return std::move(lines_); }

 private:
  void travel_to(WirePoint to) {
    move(to, std::hypot(settings_.x.max_rate_mm_s, settings_.y.max_rate_mm_s), [&](WirePoint next) {
      lines_.push_back({absolute_ ? "G53G0" + mm_word('X', next.x_um) + mm_word('Y', next.y_um) + "S0\n"
                                  : "G0" + step_words(next) + "S0\n",
                        LineKind::kTravel, at_, next});
      motion_ = 0;
      if (absolute_) hold_at(next);
    });
  }

  // Dark, at the speed of burning: G1 with S0, so that the power changes in full motion.
  void dark_to(WirePoint to) {
    move(to, speed_mm_s_, [&](WirePoint next) {
      const std::string words = step_words(next);
      lines_.push_back({(motion_ == 1 ? words : "G1" + words) + "S0\n", LineKind::kTravel, at_, next});
      motion_ = 1;
    });
  }

  // An arc bulges a little beyond its points.
  bool stays_inside(const Stroke& stroke) const {
    Box<MachineFrame> inside = settings_.travel();
    const Millimetres slack{0.05};
    inside.min = {inside.min.x + slack, inside.min.y + slack};
    inside.max = {inside.max.x - slack, inside.max.y - slack};
    return std::all_of(stroke.path.begin(), stroke.path.end(), [&](const auto& p) { return inside.contains(p); });
  }

  void burn_along(const std::vector<WirePoint>& path, bool arcs) {
    if (!arcs) {
      for (std::size_t i = 1; i < path.size(); ++i) burn_to(path[i]);
      return;
    }
    std::size_t at = 0;
    for (const PathMove& run : fit_arcs(path)) {
      const std::size_t end = at + run.lines;
      while (at < end) at += run.arc ? burn_arc(std::span(path).subspan(at, end - at + 1)) : burn_line_to(path[at + 1]);
    }
  }

  std::size_t burn_line_to(WirePoint to) {
    burn_to(to);
    return 1;
  }

  // As long an arc from the run's begin as is safe to send, or else its first line; how many lines were burnt.
  std::size_t burn_arc(std::span<const WirePoint> run) {
    for (std::size_t lines = run.size() - 1; lines >= 3; lines = lines * 2 / 3) {
      const auto arc = fit_arc(run.first(lines + 1));
      if (!arc || !arc_is_safe(run[0], run[lines], *arc) || too_long(run[0], run[lines], *arc)) continue;
      arc_to(run[lines], *arc);
      return lines;
    }
    return burn_line_to(run[1]);
  }

  double arc_s(WirePoint from, WirePoint to, const ArcShape& arc) const {
    const double radius_mm =
        std::hypot(static_cast<double>(from.x_um - arc.centre.x_um), static_cast<double>(from.y_um - arc.centre.y_um)) /
        1000;
    return arc_stop_to_stop_s(arc_turn_rad(from, to, arc) * radius_mm, radius_mm, speed_mm_s_, settings_);
  }
  bool too_long(WirePoint from, WirePoint to, const ArcShape& arc) const {
    return arc_s(from, to, arc) > longest_move_s_;
  }

  void burn_to(WirePoint to) {
    move(to, speed_mm_s_, [&](WirePoint next) { burn_line(next, 1, step_words(next)); });
  }

  void arc_to(WirePoint to, const ArcShape& arc) {
    const WirePoint from = at_;
    burn_line(to, arc.clockwise ? 2 : 3, step_words(to) + centre_words(from, arc));
    lines_.back().arc = arc;
    finish_move(to, arc_s(from, to, arc));
  }

  void burn_line(WirePoint next, int motion, std::string words) {
    // A G2 that arrived as G3 ends at the same place by another way, and goes unseen once the next line sets another
    // mode: modes are asked back before they change.
    if (motion_ != motion && unasked_) echo(stroke_, power_);
    ask_ = set_power_;
    if (std::exchange(motion_, motion) != motion || set_power_) words = fmt::format("G{}{}", motion, words);
    if (std::exchange(set_power_, false)) words += fmt::format("S{}", power_);
    lines_.push_back({words + "\n", LineKind::kBurn, at_, next});
    lines_.back().stroke = stroke_;
    lines_.back().power = power_;
    unasked_ = true;
  }

  void finish_move(WirePoint next, double longest_s) {
    lines_.back().longest_s = longest_s;
    at_ = next;
    if (std::exchange(ask_, false)) echo(stroke_, power_);
  }

  void echo(std::size_t stroke, int power) {
    unasked_ = false;
    lines_.push_back(
        {"$G\n", LineKind::kEcho, at_, at_, 0, stroke, false, feed_, power, motion_, power == GcodeLine::kAny});
  }

  // What the controller believes of its place, in its own arithmetic.
  void hold_at(WirePoint at) {
    held_x_ = static_cast<float>(static_cast<double>(at.x_um) / 1000);
    held_y_ = static_cast<float>(static_cast<double>(at.y_um) / 1000);
  }
  WirePoint step_to(WirePoint next) const {
    return {next.x_um - std::llround(static_cast<double>(held_x_) * 1000),
            next.y_um - std::llround(static_cast<double>(held_y_) * 1000)};
  }
  std::string step_words(WirePoint next) {
    const WirePoint by = step_to(next);
    held_x_ += static_cast<float>(static_cast<double>(by.x_um) / 1000);
    held_y_ += static_cast<float>(static_cast<double>(by.y_um) / 1000);
    return axis_words(by);
  }

  template <class AddLine>
  void move(WirePoint to, double speed_mm_s, AddLine add_line) {
    const WirePoint from = at_;
    if (from == to) return;
    const Along whole = along(from, to, speed_mm_s, settings_);
    const auto parts = static_cast<std::int64_t>(std::ceil(whole.length_mm / reach_mm(whole, longest_move_s_)));
    for (std::int64_t i = 1; i <= parts; ++i) {
      const WirePoint next{from.x_um + (to.x_um - from.x_um) * i / parts,
                           from.y_um + (to.y_um - from.y_um) * i / parts};
      if (next == at_ || (!absolute_ && step_to(next) == WirePoint{0, 0})) continue;
      add_line(next);
      finish_move(next, stop_to_stop_s(at_, next, speed_mm_s, settings_));
    }
  }

  WirePoint at_;
  const MachineSettings& settings_;
  double longest_move_s_;
  std::vector<GcodeLine> lines_;
  int feed_ = 0, power_ = 0;
  double speed_mm_s_ = 0;
  std::size_t stroke_ = 0;
  int motion_ = 0;          // G0 to G3, as the controller has it
  bool set_power_ = false;  // the stroke's power is still to be said
  bool ask_ = false;        // the line just written set the stroke's power
  bool unasked_ = false;    // a line has burnt since the controller was asked what it understood
  bool absolute_ = true;
  float held_x_ = 0, held_y_ = 0;
};

}  // namespace

std::string axis_words(WirePoint by) {
  std::string words;
  if (by.x_um != 0) words += mm_word('X', by.x_um);
  if (by.y_um != 0) words += mm_word('Y', by.y_um);
  return words;
}

double arc_stop_to_stop_s(double length_mm, double radius_mm, double speed_mm_s, const MachineSettings& settings) {
  const double acceleration = std::min(settings.x.acceleration_mm_s2, settings.y.acceleration_mm_s2);
  const double sagitta = std::clamp(settings.arc_tolerance_mm, 1e-4, radius_mm / 2);
  const double chord = 2 * std::sqrt(sagitta * (2 * radius_mm - sagitta));
  // The sine of half the angle between two chords; the controller's chords are up to twice as long on a short arc.
  const double s = std::sqrt(1 - std::min(0.75, (chord / radius_mm) * (chord / radius_mm)));
  const double corner = std::sqrt(acceleration * settings.junction_deviation_mm * s / (1 - s));
  // With all but two blocks of the planner ahead it can always stop in time; a short arc is one chord, or a few.
  const double ahead = chord * std::max(1.0, static_cast<double>(settings.planner_blocks) - 2);
  const double sight = std::sqrt(2 * acceleration * ahead);
  const double fastest = std::min(settings.x.max_rate_mm_s, settings.y.max_rate_mm_s);
  return duration_s({length_mm, std::min({speed_mm_s, fastest, corner, sight}), acceleration});
}

double stop_to_stop_s(WirePoint from, WirePoint to, double speed_mm_s, const MachineSettings& settings) {
  const Along a = along(from, to, speed_mm_s, settings);
  return a.length_mm <= 0 ? 0 : duration_s(a);
}

std::vector<GcodeLine> write_group(std::span<const Stroke> strokes, std::size_t first, WirePoint at,
                                   const MachineSettings& settings, double longest_move_s) {
  GroupWriter writer(at, settings, longest_move_s);
  writer.modal("G0G17G21G91G94");
  // M4: power follows the true speed and is zero at rest, so the beam dies with the bytes.
  writer.modal("G0M4S0");
  if (std::any_of(strokes.begin(), strokes.end(), [](const Stroke& stroke) { return stroke.air; })) writer.modal("M8");
  for (std::size_t i = 0; i < strokes.size(); ++i) writer.stroke(strokes[i], first + i);
  writer.modal("G0M5S0");
  writer.modal("M9");
  writer.dwell();
  return writer.take();
}

std::vector<GcodeLine> write_jog(WirePoint from, WirePoint to, MmPerSecond speed, const MachineSettings& settings,
                                 double longest_move_s) {
  GroupWriter writer(from, settings, longest_move_s);
  writer.jog_to(to, speed.count());
  return writer.take();
}

Status check_job(const LaserJob& job, const MachineSettings& settings) {
  const double fastest = std::min(settings.x.max_rate_mm_s, settings.y.max_rate_mm_s);
  JobLimits limits;
  limits.travel = settings.travel();
  limits.fastest = MmPerSecond(fastest);
  limits.speed_words = fmt::format("0 to {:.0f} mm/s, the slower axis's limit", fastest);
  limits.overscan = true;
  limits.same_place = [&settings](const auto& a, const auto& b) { return settings.to_wire(a) == settings.to_wire(b); };
  return veneer::check_job(job, limits);
}

}  // namespace veneer::grbl
