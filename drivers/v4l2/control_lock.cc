#include "drivers/v4l2/control_lock.h"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <optional>

namespace veneer::v4l2 {
namespace {

// What changes a picture by itself. 0 is off but of exposure, which is told apart below.
constexpr std::array<std::uint32_t, 10> kAutomatics = {V4L2_CID_EXPOSURE_AUTO,
                                                       V4L2_CID_EXPOSURE_AUTO_PRIORITY,
                                                       V4L2_CID_AUTOGAIN,
                                                       V4L2_CID_AUTO_WHITE_BALANCE,
                                                       V4L2_CID_FOCUS_AUTO,
                                                       V4L2_CID_HUE_AUTO,
                                                       V4L2_CID_AUTOBRIGHTNESS,
                                                       V4L2_CID_CHROMA_AGC,
                                                       V4L2_CID_IMAGE_STABILIZATION,
                                                       V4L2_CID_ISO_SENSITIVITY_AUTO};

// What an earlier program may have left at another value.
constexpr std::array<std::uint32_t, 23> kLasting = {V4L2_CID_BRIGHTNESS,
                                                    V4L2_CID_CONTRAST,
                                                    V4L2_CID_SATURATION,
                                                    V4L2_CID_HUE,
                                                    V4L2_CID_GAMMA,
                                                    V4L2_CID_GAIN,
                                                    V4L2_CID_SHARPNESS,
                                                    V4L2_CID_BACKLIGHT_COMPENSATION,
                                                    V4L2_CID_WHITE_BALANCE_TEMPERATURE,
                                                    V4L2_CID_RED_BALANCE,
                                                    V4L2_CID_BLUE_BALANCE,
                                                    V4L2_CID_EXPOSURE,
                                                    V4L2_CID_EXPOSURE_ABSOLUTE,
                                                    V4L2_CID_ANALOGUE_GAIN,
                                                    V4L2_CID_DIGITAL_GAIN,
                                                    V4L2_CID_IRIS_ABSOLUTE,
                                                    V4L2_CID_ZOOM_ABSOLUTE,
                                                    V4L2_CID_PAN_ABSOLUTE,
                                                    V4L2_CID_TILT_ABSOLUTE,
                                                    V4L2_CID_HFLIP,
                                                    V4L2_CID_VFLIP,
                                                    V4L2_CID_ROTATE,
                                                    V4L2_CID_WIDE_DYNAMIC_RANGE};

// What a motor follows; an automatic that was on may have left it anywhere.
constexpr std::array<std::uint32_t, 6> kMotors = {V4L2_CID_FOCUS_ABSOLUTE, V4L2_CID_FOCUS_AUTO,
                                                  V4L2_CID_ZOOM_ABSOLUTE,  V4L2_CID_PAN_ABSOLUTE,
                                                  V4L2_CID_TILT_ABSOLUTE,  V4L2_CID_IRIS_ABSOLUTE};

bool holds(const auto& list, std::uint32_t id) { return std::ranges::find(list, id) != list.end(); }

// Nothing when the device has no choice by which it keeps still.
std::optional<std::int64_t> off_value(const CameraControl& automatic) {
  if (automatic.id != V4L2_CID_EXPOSURE_AUTO) return 0;
  // The second leaves the lens's iris to the device, which cheap lenses do not have.
  for (const std::int64_t manual : {V4L2_EXPOSURE_MANUAL, V4L2_EXPOSURE_SHUTTER_PRIORITY})
    if (std::ranges::any_of(automatic.choices, [&](const auto& choice) { return choice.first == manual; }))
      return manual;
  return std::nullopt;
}

// Of one that no program can set.
bool is_off(const CameraControl& automatic) {
  if (automatic.id != V4L2_CID_EXPOSURE_AUTO) return automatic.value == 0;
  return automatic.value == V4L2_EXPOSURE_MANUAL || automatic.value == V4L2_EXPOSURE_SHUTTER_PRIORITY;
}

class Lock {
 public:
  Lock(OpenCamera& camera, const StatedControls& stated) : camera_(camera), stated_(stated) {}

  Result<LockedControls> lock() {
    if (Status done = set_all(); !done) return done.error();
    // At the end, since one setting may change another.
    if (Status kept = still_locked(camera_, wanted_); !kept) return kept.error();
    return wanted_;
  }

 private:
  Status set_all() {
    if (Status read = look(); !read) return read;
    if (Status known = check_stated(); !known) return known;
    all_ = controls_;
    if (Status off = switch_all_off(); !off) return off;
    for (const auto& [name, text] : stated_)
      if (Status set = set_stated(name, text); !set) return set;
    // One may begin to count when another one is set, so until nothing is left; each is set once at most.
    std::size_t before = 0;
    do {
      before = wanted_.values.size();
      if (Status off = switch_all_off(); !off) return off;
      if (Status usual = set_defaults(); !usual) return usual;
    } while (before != wanted_.values.size());
    return Ok();
  }

  Status switch_all_off() {
    for (const CameraControl& one : all_)
      if (holds(kAutomatics, one.id) && !is_set(one.name))
        if (Status off = switch_off(one.name); !off) return off;
    return Ok();
  }

  Status set_defaults() {
    for (const CameraControl& one : all_) {
      if (!holds(kLasting, one.id) || is_stated(one.name) || is_set(one.name)) continue;
      const auto control = as_it_is(one.name);
      if (!control) return control.error();
      if (!control->settable || !control->active) continue;
      if (Status set = set_to(*control, control->usual); !set) return set;
    }
    return Ok();
  }

  Status look() {
    auto controls = camera_.controls();
    if (!controls) return controls.error();
    controls_ = std::move(*controls);
    return Ok();
  }
  const CameraControl* find(const std::string& name) const {
    const auto at = std::ranges::find(controls_, name, &CameraControl::name);
    return at == controls_.end() ? nullptr : &*at;
  }
  // Settings may vanish when others are set.
  Result<CameraControl> as_it_is(const std::string& name) const {
    if (const CameraControl* control = find(name)) return *control;
    return Error{ErrorCode::kRefused,
                 fmt::format("the camera {} has no {} any more since another setting was changed, so it cannot be "
                             "locked: leave settings out one by one, or use another camera",
                             camera_.camera(), name)};
  }
  bool is_set(const std::string& name) const {
    return std::ranges::any_of(wanted_.values, [&](const auto& one) { return one.first == name; });
  }
  bool is_stated(const std::string& name) const {
    return std::ranges::any_of(stated_, [&](const auto& one) { return one.first == name; });
  }

  Status check_stated() const {
    for (const auto& [name, text] : stated_) {
      if (find(name) != nullptr) continue;
      std::vector<std::string> names;
      for (const CameraControl& control : controls_)
        if (control.settable) names.push_back(control.name);
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("the camera {} has no setting {}: it has {}", camera_.camera(), name,
                               names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", ")))};
    }
    for (const CameraControl& control : controls_)
      if (control.id == V4L2_CID_FOCUS_ABSOLUTE && control.settable && !is_stated(control.name))
        return Error{ErrorCode::kInvalidArgument,
                     fmt::format("a motor sets the focus of the camera {0}, and its calibration is good for one focus: "
                                 "set {1} = {2}, which is what it has now (it takes {3})",
                                 camera_.camera(), control.name, control.value, what_it_takes(control))};
    return Ok();
  }

  Status switch_off(const std::string& automatic_name) {
    const auto now = as_it_is(automatic_name);
    if (!now) return now.error();
    const CameraControl& automatic = *now;
    if (!automatic.active) return Ok();
    if (!automatic.settable) return is_off(automatic) ? Ok() : stays_on(automatic);
    const auto off = off_value(automatic);
    if (!off)
      return Error{ErrorCode::kRefused,
                   fmt::format("the camera {} always sets its exposure itself, and such pictures cannot be compared: "
                               "use another camera",
                               camera_.camera())};
    for (const auto& [name, text] : stated_) {
      if (name != automatic.name) continue;
      const auto wanted = fitting_value(automatic, text, camera_.camera());
      if (!wanted) return wanted.error();
      if (*wanted != *off)
        return Error{ErrorCode::kInvalidArgument,
                     fmt::format("{} = {} lets the camera {} change by itself, and such pictures cannot be compared: "
                                 "leave it out",
                                 name, text, camera_.camera())};
    }
    return set_to(automatic, *off);
  }

  Status stays_on(const CameraControl& automatic) const {
    return Error{ErrorCode::kRefused,
                 fmt::format("{} of the camera {} is on and cannot be switched off by a program, and such pictures "
                             "cannot be compared: use another camera",
                             automatic.name, camera_.camera())};
  }

  Status set_stated(const std::string& name, const std::string& text) {
    const auto control = as_it_is(name);
    if (!control) return control.error();
    const auto value = fitting_value(*control, text, camera_.camera());
    if (!value) return value.error();
    if (!control->active)
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("{} of the camera {} does not count as its other settings are: leave it out", name,
                               camera_.camera())};
    return set_to(*control, *value);
  }

  // A device that refuses what it has already is not asked.
  Status set_to(const CameraControl& control, std::int64_t value) {
    wanted_.values.emplace_back(control.name, value);
    if (control.value == value) return Ok();
    wanted_.motor_moves = wanted_.motor_moves || holds(kMotors, control.id);
    if (Status set = camera_.set(control, value); !set) return set;
    return look();
  }

  OpenCamera& camera_;
  const StatedControls& stated_;
  std::vector<CameraControl> all_;       // that it had at first
  std::vector<CameraControl> controls_;  // as they are now
  LockedControls wanted_;
};

}  // namespace

Result<LockedControls> lock_controls(OpenCamera& camera, const StatedControls& stated) {
  return Lock(camera, stated).lock();
}

Status still_locked(OpenCamera& camera, const LockedControls& locked) {
  const auto controls = camera.controls();
  if (!controls) return controls.error();
  for (const auto& [name, value] : locked.values) {
    const auto now = std::ranges::find(*controls, name, &CameraControl::name);
    if (now != controls->end() && now->value == value) continue;
    return Error{
        ErrorCode::kRefused,
        fmt::format("the camera {} has {} = {} where {} was set, so it is not locked: set a value that it "
                    "keeps, and close other programs that use it",
                    camera.camera(), name, now == controls->end() ? "nothing" : std::to_string(now->value), value)};
  }
  return Ok();
}

}  // namespace veneer::v4l2
