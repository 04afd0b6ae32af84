#include "drivers/v4l2/proposed_settings.h"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "drivers/v4l2/control_lock.h"
#include "drivers/v4l2/frame_average.h"

namespace veneer::v4l2 {
namespace {

// Those that find out something that a program can then set.
constexpr std::array<std::uint32_t, 4> kFindingOut = {V4L2_CID_EXPOSURE_AUTO, V4L2_CID_AUTOGAIN,
                                                      V4L2_CID_AUTO_WHITE_BALANCE, V4L2_CID_FOCUS_AUTO};
// And what they find out.
constexpr std::array<std::uint32_t, 10> kFound = {
    V4L2_CID_EXPOSURE_ABSOLUTE, V4L2_CID_EXPOSURE,      V4L2_CID_GAIN,           V4L2_CID_ANALOGUE_GAIN,
    V4L2_CID_DIGITAL_GAIN,      V4L2_CID_IRIS_ABSOLUTE, V4L2_CID_FOCUS_ABSOLUTE, V4L2_CID_WHITE_BALANCE_TEMPERATURE,
    V4L2_CID_RED_BALANCE,       V4L2_CID_BLUE_BALANCE};

constexpr Duration kFrameWait = std::chrono::milliseconds(200);  // so that a stop request is seen soon
constexpr double kStillShare = 0.02;                             // of a setting, or its step where that is more
constexpr double kStillLevels = 2;                               // of the mean; more is a change of the light
constexpr int kAsWhite = 250;                                    // of a sample; more cannot be told apart
constexpr double kMostWhite = 0.05;                              // of the pixels
constexpr double kLeastMean = 40;                                // grey levels; tags need black and white
constexpr double kMuchBrighter = 1.6, kMuchLessSharp = 0.5;      // than the automatics had it

bool is_one_of(const auto& list, std::uint32_t id) { return std::ranges::find(list, id) != list.end(); }

// ---- how a picture is -----------------------------------------------------------------------------------------------

struct Impression {
  double mean = 0;   // grey levels
  double white = 0;  // share of the pixels
  double edges = 0;  // squared differences of neighbours, by the squared mean: the same for a darker picture
};

// REQUIRES: RGB of 8 bits.
Impression impression_of(const RawPicture& picture) {
  Impression out;
  const auto width = static_cast<std::size_t>(picture.width), pixels = picture.samples.size() / 3;
  if (pixels == 0 || width < 2) return out;
  double sum = 0, squares = 0;
  std::size_t white = 0, pairs = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    const std::uint8_t* rgb = &picture.samples[3 * i];
    sum += (rgb[0] + rgb[1] + rgb[2]) / 3.0;
    white += std::max({rgb[0], rgb[1], rgb[2]}) >= kAsWhite ? 1 : 0;
    if ((i + 1) % width == 0) continue;
    const double step = rgb[4] - rgb[1];
    squares += step * step;
    ++pairs;
  }
  out.mean = sum / static_cast<double>(pixels);
  out.white = static_cast<double>(white) / static_cast<double>(pixels);
  out.edges = squares / static_cast<double>(pairs) / std::max(out.mean * out.mean, 1.0);
  return out;
}

// `by_automatics`: nothing when there is no such picture.
std::vector<LookDoubt> doubts_of(const Impression& locked, const std::optional<Impression>& by_automatics) {
  const double theirs = by_automatics ? by_automatics->mean : locked.mean;
  if (locked.mean < kLeastMean || locked.mean * kMuchBrighter < theirs) return {LookDoubt::kTooDark};
  if (locked.white > kMostWhite || locked.mean > kMuchBrighter * theirs) return {LookDoubt::kTooBright};
  if (by_automatics && locked.edges < kMuchLessSharp * by_automatics->edges) return {LookDoubt::kBlurred};
  return {};
}

// ---- its automatics -------------------------------------------------------------------------------------------------

// Nothing where it has no choice that is one.
std::optional<std::int64_t> on_value(const CameraControl& automatic) {
  if (automatic.id != V4L2_CID_EXPOSURE_AUTO) return 1;
  for (const std::int64_t on : {V4L2_EXPOSURE_AUTO, V4L2_EXPOSURE_APERTURE_PRIORITY})
    if (std::ranges::any_of(automatic.choices, [&](const auto& choice) { return choice.first == on; })) return on;
  return std::nullopt;
}

// One that does not go on stays as it is: then there is nothing that it finds out.
Status switch_on(OpenCamera& camera) {
  const auto controls = camera.controls();
  if (!controls) return controls.error();
  for (const CameraControl& one : *controls) {
    const auto on = on_value(one);
    if (is_one_of(kFindingOut, one.id) && one.settable && on && one.value != *on)
      static_cast<void>(camera.set(one, *on));
  }
  return Ok();
}

// Lamps flicker with the mains, twice in each period: 10 ms where mains have 50 Hz.
std::int64_t flicker_free(std::int64_t exposure) {
  constexpr std::int64_t kFlicker = 100;  // the control's unit is 0.1 ms
  return exposure < kFlicker * 2 / 3 ? exposure
                                     : std::max<std::int64_t>(1, (exposure + kFlicker / 2) / kFlicker) * kFlicker;
}

class Proposal {
 public:
  Proposal(OpenCamera& camera, const SettleOptions& settle, const Clock& clock, const DecodeJpeg& decode_jpeg,
           const std::stop_token& stop)
      : camera_(camera), settle_(settle), clock_(clock), decode_jpeg_(decode_jpeg), stop_(stop) {}

  Result<ProposedSettings> propose(CameraSettings wanted, LookOptions options) {
    const auto format = take_format(camera_, wanted);
    if (!format) return format.error();
    // What another program left there would be found out about, and one that cannot be locked needs no seeking.
    if (auto locked = lock(); !locked) return locked.error();
    if (Status on = switch_on(camera_); !on) return on.error();
    const Status settled = settle(*format);
    camera_.end();
    if (!settled) return settled.error();
    const auto locked = lock();
    if (!locked) return locked.error();
    wanted.options.clear();
    for (const CameraControl& one : found_)
      if (std::ranges::any_of(locked->values, [&](const auto& set) { return set.first == one.name; }))
        wanted.options.emplace_back(one.name, std::to_string(figure(one)));
    if (locked->motor_moves) options.settling = std::max(options.settling, options.motor_settling);
    auto look = take_locked_look(camera_, wanted, options, clock_, decode_jpeg_, stop_);
    if (!look) return look.error();
    std::optional<Impression> theirs;
    if (still_.count() > 0) theirs = impression_of(still_.mean());
    ProposedSettings out{std::move(wanted), std::move(*look), {}};
    out.doubts = doubts_of(impression_of(out.look.picture), theirs);
    if (!is_settled_) out.doubts.insert(out.doubts.begin(), LookDoubt::kUnsettled);
    return out;
  }

 private:
  static std::int64_t figure(const CameraControl& found) {
    return nearest_value(found, found.id == V4L2_CID_EXPOSURE_ABSOLUTE ? flicker_free(found.value) : found.value);
  }

  // With the focus that it has now, since that must be stated.
  Result<LockedControls> lock() {
    const auto controls = camera_.controls();
    if (!controls) return controls.error();
    StatedControls focus;
    for (const CameraControl& one : *controls)
      if (one.id == V4L2_CID_FOCUS_ABSOLUTE && one.settable)
        focus.emplace_back(one.name, std::to_string(nearest_value(one, one.value)));
    return lock_controls(camera_, focus);
  }

  Status settle(const FrameFormat& format) {
    if (Status started = camera_.start(); !started) return started;
    const TimePoint begun = clock_.now();
    TimePoint changed = begun;
    std::optional<TimePoint> read;
    std::optional<double> level;
    for (TimePoint now = begun; now - begun < settle_.most; now = clock_.now()) {
      if (stop_.stop_requested())
        return Error{ErrorCode::kCancelled, fmt::format("trying the camera {} was cancelled", camera_.camera())};
      if (!read || now - *read >= settle_.between) {
        const auto differs = read_found();
        if (!differs) return differs.error();
        if (*differs) changed = now, still_ = {};
        read = now;
      }
      auto frame = camera_.next(kFrameWait);
      if (!frame) return frame.error();
      if (!*frame || (*frame)->damaged) continue;
      const auto picture = pixels_of(format, (*frame)->bytes, decode_jpeg_);
      if (!picture) continue;
      const double mean = impression_of(*picture).mean;
      if (!level || std::abs(mean - *level) > kStillLevels) level = mean, changed = clock_.now(), still_ = {};
      still_.add(*picture);
      is_settled_ = clock_.now() - begun >= settle_.least && clock_.now() - changed >= settle_.still;
      if (is_settled_) break;
    }
    // What it came to at last, whatever was read before.
    const auto last = read_found();
    return last ? Ok() : Status(last.error());
  }

  // Whether something has moved since it moved last; automatics go to and fro between two neighbours for ever.
  Result<bool> read_found() {
    const auto controls = camera_.controls();
    if (!controls) return controls.error();
    std::vector<CameraControl> now;
    for (const CameraControl& one : *controls)
      if (is_one_of(kFound, one.id) && one.kind == CameraControl::Kind::kWhole) now.push_back(one);
    found_ = std::move(now);
    const bool rests = std::ranges::equal(found_, moved_to_, [](const CameraControl& one, const CameraControl& before) {
      const auto still =
          std::max(static_cast<double>(one.step), kStillShare * std::abs(static_cast<double>(before.value)));
      return one.id == before.id &&
             std::abs(static_cast<double>(one.value) - static_cast<double>(before.value)) <= still;
    });
    if (!rests) moved_to_ = found_;
    return !rests;
  }

  OpenCamera& camera_;
  const SettleOptions& settle_;
  const Clock& clock_;
  const DecodeJpeg& decode_jpeg_;
  const std::stop_token& stop_;
  std::vector<CameraControl> found_;     // as they stood last
  std::vector<CameraControl> moved_to_;  // and when one of them moved last
  FrameAverage still_;                   // frames since the last change
  bool is_settled_ = false;
};

}  // namespace

Result<ProposedSettings> propose_settings(OpenCamera& camera, const CameraSettings& wanted, const SettleOptions& settle,
                                          const LookOptions& options, const Clock& clock, const DecodeJpeg& decode_jpeg,
                                          const std::stop_token& stop) {
  return Proposal(camera, settle, clock, decode_jpeg, stop).propose(wanted, options);
}

Result<ProposedSettings> try_settings(OpenCamera& camera, const CameraSettings& stated, const LookOptions& options,
                                      const Clock& clock, const DecodeJpeg& decode_jpeg, const std::stop_token& stop) {
  auto look = take_locked_look(camera, stated, options, clock, decode_jpeg, stop);
  if (!look) return look.error();
  ProposedSettings out{stated, std::move(*look), {}};
  out.doubts = doubts_of(impression_of(out.look.picture), std::nullopt);
  return out;
}

}  // namespace veneer::v4l2
