#include "drivers/sim/grbl_controller/gcode.h"

#include <fmt/format.h>

#include <cmath>

#include "drivers/sim/grbl_controller/gcode_words.h"

namespace veneer::sim {
namespace {

constexpr double kInch = 25.4;
constexpr char kAxes[] = "XYZ";
constexpr char kOffsets[] = "IJK";
constexpr double kTwoPi = 6.283185307179586;

bool burns(int motion) { return motion >= 1 && motion <= 3; }

// First, second and normal axis of a plane.
std::array<int, 3> plane_axes(int plane) {
  if (plane == 18) return {2, 0, 1};
  if (plane == 19) return {1, 2, 0};
  return {0, 1, 2};
}

std::string triple(const char* name, const Vec3& v) {
  return fmt::format("[{}:{:.3f},{:.3f},{:.3f}]\r\n", name, v[0], v[1], v[2]);
}

}  // namespace

void GcodeInterpreter::reset(const Vec3& position) {
  modal_ = {};
  feed_ = 0;
  spindle_speed_ = 0;
  shift_ = {};
  position_ = position;
}

Vec3 GcodeInterpreter::work_offset() const {
  const Vec3& system = systems_[static_cast<std::size_t>(modal_.system)];
  return {system[0] + shift_[0], system[1] + shift_[1], system[2] + shift_[2]};
}

std::string GcodeInterpreter::modal_report() const {
  static constexpr std::array<const char*, 3> kSpindle{"M5", "M3", "M4"};
  return fmt::format("[GC:G{} G{} G{} G{} G{} G{} {} M{} T0 F{:.0f} S{:.0f}]\r\n", modal_.motion, modal_.system + 54,
                     modal_.plane, modal_.inches ? 20 : 21, modal_.relative ? 91 : 90, modal_.inverse_time ? 93 : 94,
                     kSpindle[static_cast<std::size_t>(modal_.spindle)], modal_.flood ? 8 : 9,
                     modal_.inches ? feed_ / kInch : feed_, spindle_speed_);
}

std::string GcodeInterpreter::offsets_report() const {
  std::string out;
  for (std::size_t i = 0; i < systems_.size(); ++i) out += triple(fmt::format("G{}", 54 + i).c_str(), systems_[i]);
  out += triple("G28", home_28_) + triple("G30", home_30_) + triple("G92", shift_);
  return out + "[TLO:0.000]\r\n[PRB:0.000,0.000,0.000:0]\r\n";
}

gcode::Modal GcodeInterpreter::next_modal(const Words& w) const {
  gcode::Modal next = modal_;
  next.motion = w.motion.value_or(modal_.motion);
  next.plane = w.plane.value_or(modal_.plane);
  if (w.units) next.inches = *w.units == 20;
  if (w.distance) next.relative = *w.distance == 91;
  if (w.feed_mode) next.inverse_time = *w.feed_mode == 93;
  next.system = w.system.value_or(modal_.system);
  if (w.spindle)
    next.spindle = *w.spindle == 3   ? SpindleMode::kConstant
                   : *w.spindle == 4 ? SpindleMode::kDynamic
                                     : SpindleMode::kOff;
  if (w.coolant) next.flood = *w.coolant == 8;
  return next;
}

Vec3 GcodeInterpreter::target_of(const Words& w, const gcode::Modal& next) const {
  Vec3 target = position_;
  const Vec3& system = systems_[static_cast<std::size_t>(next.system)];
  for (int axis = 0; axis < 3; ++axis) {
    const auto& word = w.value(kAxes[axis]);
    if (!word) continue;
    // In the firmware's single precision: over thousands of short relative moves the roundings add up to a motor step.
    const auto mm = static_cast<float>(*word * (next.inches ? kInch : 1));
    if (w.non_modal == 530)
      target[axis] = mm;
    else if (next.relative)
      target[axis] = static_cast<float>(position_[axis]) + mm;
    else
      target[axis] = mm + static_cast<float>(system[axis]) + static_cast<float>(shift_[axis]);
  }
  return target;
}

double GcodeInterpreter::feed_of(const Words& w, const gcode::Modal& next) const {
  if (!w.has('F')) return modal_.inverse_time == next.inverse_time && !next.inverse_time ? feed_ : 0;
  return *w.value('F') * (next.inches && !next.inverse_time ? kInch : 1);
}

int GcodeInterpreter::check_non_modal(Words& w) const {
  const int command = w.non_modal.value_or(0);
  if (command == 40) {
    if (!w.has('P')) return 28;
    w.use('P');
  } else if (command == 100) {
    if (!w.has_axis()) return 26;
    if (!w.has('P') || !w.has('L')) return 28;
    if (*w.value('P') > 6) return 29;
    const int how = static_cast<int>(*w.value('L'));
    if (how != 20 && (how != 2 || w.has('R'))) return 20;
    w.use('P');
    w.use('L');
  } else if (command == 920) {
    if (!w.has_axis()) return 26;
  } else if (command == 530) {
    const int motion = w.motion.value_or(modal_.motion);
    if (motion != 0 && motion != 1) return 30;
  }
  if (w.tool_length == 431 && (w.has('X') || w.has('Y') || !w.has('Z'))) return 37;
  return 0;
}

int GcodeInterpreter::arc_path(Words& w, const gcode::Modal& next, const Vec3& target, std::vector<Vec3>& path) const {
  const auto [a, b, normal] = plane_axes(next.plane);
  if (!w.has(kAxes[a]) && !w.has(kAxes[b])) return 32;
  const double unit = next.inches ? kInch : 1;
  const double x = target[a] - position_[a];
  const double y = target[b] - position_[b];
  double i = 0;
  double j = 0;
  double radius = 0;
  if (w.has('R')) {
    w.use('R');
    if (x == 0 && y == 0) return 33;
    radius = *w.value('R') * unit;
    const double under = 4 * radius * radius - x * x - y * y;
    if (under < 0) return 34;
    double h = -std::sqrt(under) / std::hypot(x, y);
    if (next.motion == 3) h = -h;
    if (radius < 0) h = -h;
    radius = std::abs(radius);
    i = 0.5 * (x - y * h);
    j = 0.5 * (y + x * h);
  } else {
    if (!w.has(kOffsets[a]) && !w.has(kOffsets[b])) return 35;
    for (int axis = 0; axis < 3; ++axis)
      if (axis != normal) w.use(kOffsets[axis]);
    i = w.value(kOffsets[a]).value_or(0) * unit;
    j = w.value(kOffsets[b]).value_or(0) * unit;
    radius = std::hypot(i, j);
    const double miss = std::abs(std::hypot(x - i, y - j) - radius);
    if (miss > 0.005 && (miss > 0.5 || miss > 0.001 * radius)) return 33;
  }
  double turn = std::atan2(-i * (y - j) + j * (x - i), -i * (x - i) - j * (y - j));
  constexpr double kFullTurn = 5e-7;
  if (next.motion == 2 && turn >= -kFullTurn) turn -= kTwoPi;
  if (next.motion == 3 && turn <= kFullTurn) turn += kTwoPi;
  const double tolerance = settings_[12];
  const double chord = std::sqrt(std::max(1e-12, tolerance * (2 * radius - tolerance)));
  const int segments = static_cast<int>(std::floor(std::abs(0.5 * turn * radius) / chord));
  for (int k = 1; k < segments; ++k) {
    const double part = static_cast<double>(k) / segments;
    const double c = std::cos(turn * part);
    const double s = std::sin(turn * part);
    Vec3 at = position_;
    at[a] += i + (-i * c + j * s);
    at[b] += j + (-i * s - j * c);
    at[normal] += (target[normal] - position_[normal]) * part;
    path.push_back(at);
  }
  path.push_back(target);
  return 0;
}

int GcodeInterpreter::check_motion(Words& w, const gcode::Modal& next, std::vector<Vec3>& path) const {
  if (next.motion == 80) return w.has_axis() && w.axis_use != AxisUse::kNonModal ? 31 : 0;
  if (w.axis_use != AxisUse::kMotion) return 0;
  if (next.motion != 0 && feed_of(w, next) == 0) return 22;
  const Vec3 target = target_of(w, next);
  if (next.motion >= 2) {
    if (!w.has_axis()) return 26;
    return arc_path(w, next, target, path);
  }
  if (w.has_axis()) path.push_back(target);
  return 0;
}

int GcodeInterpreter::check(Words& w, bool jog) const {
  if (w.has_axis() && w.axis_use == AxisUse::kNone) w.axis_use = AxisUse::kMotion;
  if (w.value('N').value_or(0) > 10000000) return 27;
  if (w.value('T').value_or(0) > 255) return 38;
  if (!jog) return check_non_modal(w);
  if (w.motion || w.plane || w.feed_mode || w.system || w.cutter || w.tool_length || w.control || w.arc_distance)
    return 16;
  if (w.non_modal && w.non_modal != 530) return 16;
  if (w.has('S') || w.has('T')) return 16;
  if (!w.has_axis()) return 26;
  return w.value('F').value_or(0) > 0 ? 0 : 22;
}

namespace {

std::uint32_t mask_of(std::string_view letters) {
  std::uint32_t mask = 0;
  for (const char c : letters) mask |= 1U << (c - 'A');
  return mask;
}

}  // namespace

int GcodeInterpreter::execute(std::string_view line, std::vector<gcode::Action>& actions) {
  Words w;
  if (const int error = read_words(line, false, w)) return error;
  if (const int error = check(w, false)) return error;
  const gcode::Modal next = next_modal(w);
  std::vector<Vec3> path;
  if (const int error = check_motion(w, next, path)) return error;
  std::uint32_t given = 0;
  for (char c = 'A'; c <= 'Z'; ++c)
    if (w.has(c)) given |= mask_of(std::string_view(&c, 1));
  given &= ~(w.used | mask_of("NFST"));
  if (w.axis_use != AxisUse::kNone) given &= ~mask_of("XYZ");
  if (given != 0) return 36;
  emit(w, next, path, actions);
  return 0;
}

void GcodeInterpreter::emit(const Words& w, const gcode::Modal& next, const std::vector<Vec3>& path,
                            std::vector<gcode::Action>& actions) {
  const bool laser = settings_.flag(32);
  const bool dark = laser && !burns(next.motion);
  const bool moves = laser && !path.empty();
  const bool mode_changes = laser && !moves && modal_.spindle == SpindleMode::kConstant && burns(modal_.motion) == dark;
  const double speed = w.value('S').value_or(spindle_speed_);
  if (modal_.spindle != SpindleMode::kOff && !moves && (speed != spindle_speed_ || mode_changes))
    actions.emplace_back(gcode::Spindle{modal_.spindle, dark ? 0 : speed});
  spindle_speed_ = speed;
  const double feed = feed_of(w, next);
  feed_ = feed;
  if (next.spindle != modal_.spindle) actions.emplace_back(gcode::Spindle{next.spindle, dark ? 0 : speed});
  if (w.coolant && next.flood != modal_.flood) actions.emplace_back(gcode::Coolant{next.flood});
  if (w.non_modal == 40) actions.emplace_back(gcode::Dwell{*w.value('P')});
  modal_ = next;
  apply_non_modal(w, next, actions);
  for (const Vec3& at : path) {
    double mm_per_s = feed / 60;
    if (next.inverse_time)
      mm_per_s *=
          std::hypot(path.back()[0] - position_[0], path.back()[1] - position_[1]) / static_cast<double>(path.size());
    actions.emplace_back(gcode::Line{at, mm_per_s, next.motion == 0, next.spindle, dark ? 0 : speed});
  }
  if (!path.empty()) position_ = path.back();
  if (w.flow == 0) actions.emplace_back(gcode::Pause{});
  if (w.flow == 2 || w.flow == 30) {
    const bool inches = modal_.inches;
    modal_ = {};
    modal_.inches = inches;
    actions.emplace_back(gcode::ProgramEnd{});
  }
}

void GcodeInterpreter::apply_non_modal(const Words& w, const gcode::Modal& next, std::vector<gcode::Action>& actions) {
  const int command = w.non_modal.value_or(0);
  const double unit = next.inches ? kInch : 1;
  if (command == 100) {
    const int number = static_cast<int>(*w.value('P'));
    Vec3& system = systems_[static_cast<std::size_t>(number == 0 ? next.system : number - 1)];
    for (int axis = 0; axis < 3; ++axis)
      if (const auto& word = w.value(kAxes[axis]))
        system[axis] = *w.value('L') == 20 ? position_[axis] - shift_[axis] - *word * unit : *word * unit;
    actions.emplace_back(gcode::StoreOffsets{});
  } else if (command == 920) {
    const Vec3& system = systems_[static_cast<std::size_t>(next.system)];
    for (int axis = 0; axis < 3; ++axis)
      if (const auto& word = w.value(kAxes[axis])) shift_[axis] = position_[axis] - system[axis] - *word * unit;
  } else if (command == 921) {
    shift_ = {};
  } else if (command == 281 || command == 301) {
    (command == 281 ? home_28_ : home_30_) = position_;
    actions.emplace_back(gcode::StoreOffsets{});
  } else if (command == 280 || command == 300) {
    const Vec3& home = command == 280 ? home_28_ : home_30_;
    Vec3 end = home;
    if (w.has_axis()) {
      const Vec3 through = target_of(w, next);
      actions.emplace_back(gcode::Line{through, 0, true, next.spindle, 0});
      for (int axis = 0; axis < 3; ++axis)
        if (!w.has(kAxes[axis])) end[axis] = through[axis];
    }
    actions.emplace_back(gcode::Line{end, 0, true, next.spindle, 0});
    position_ = end;
  }
}

int GcodeInterpreter::jog(std::string_view line, std::vector<gcode::Action>& actions) {
  Words w;
  if (const int error = read_words(line, true, w)) return error;
  if (const int error = check(w, true)) return error;
  gcode::Modal next = modal_;
  if (w.units) next.inches = *w.units == 20;
  if (w.distance) next.relative = *w.distance == 91;
  next.inverse_time = false;
  const Vec3 target = target_of(w, next);
  if (settings_.flag(20))
    for (int axis = 0; axis < 3; ++axis)
      if (target[axis] > 0 || target[axis] < -settings_[130 + axis]) return 15;
  actions.emplace_back(gcode::Line{target, feed_of(w, next) / 60, false, modal_.spindle, spindle_speed_});
  position_ = target;
  return 0;
}

}  // namespace veneer::sim
