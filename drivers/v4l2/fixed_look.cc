#include "drivers/v4l2/fixed_look.h"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_set>
#include <utility>

#include "drivers/v4l2/frame_average.h"

namespace veneer::v4l2 {
namespace {

// So that a stop request is seen soon.
constexpr Duration kOneWait = std::chrono::milliseconds(200);

// More than the two clocks can seem to drift apart while a process is kept waiting between reading them.
constexpr Duration kMostSuspended = std::chrono::milliseconds(100);

// Why a frame is refused, as part of a sentence: "the camera X gives pictures ...".
constexpr std::string_view kDamaged = "that its own driver calls damaged";
constexpr std::string_view kShort = "that lack pixels";
constexpr std::string_view kBroken = "that are broken off or of another size";
constexpr std::string_view kTimeless = "without a time by this machine's clock";
constexpr std::string_view kOld = "from before they were asked for";
constexpr std::string_view kFuture = "that it says were taken in the future";
constexpr std::string_view kNoYounger = "whose time does not go on";
constexpr std::string_view kRepeated = "that are the same to the last bit, so it hangs or its lens is covered";

// 64 bits: should two pictures ever share them, one is refused for nothing. Of the pixels: in front of a JPEG's stands
// what its camera counts.
std::size_t hash_of(const RawPicture& picture) {
  return std::hash<std::string_view>()({reinterpret_cast<const char*>(picture.samples.data()), picture.samples.size()});
}

class Looker {
 public:
  Looker(FrameSource& source, const FrameFormat& format, const LookOptions& options, const Clock& clock,
         const DecodeJpeg& decode_jpeg, const std::stop_token& stop)
      : source_(source),
        format_(format),
        options_(options),
        clock_(clock),
        decode_jpeg_(decode_jpeg),
        stop_(stop),
        asked_(clock.now()),
        suspended_before_(options.time_suspended()) {}

  Result<AveragedPicture> look() {
    if (Status started = source_.start(); !started) return started.error();
    settled_at_ = clock_.now() + options_.settling;
    while (average_.count() < options_.frames) {
      if (stop_.stop_requested())
        return Error{ErrorCode::kCancelled, fmt::format("the look of the camera {} was cancelled", source_.camera())};
      const Duration left = asked_ + options_.deadline - clock_.now();
      if (left <= Duration(0)) return too_late();
      auto frame = source_.next(std::min(left, kOneWait));
      if (!frame) return frame.error();
      if (!*frame) continue;
      ++came_;
      std::optional<RawPicture> picture;
      if (const auto why = reason_against(**frame, picture)) {
        last_reason_ = *why;
        if (++refused_ > options_.most_refused) return too_many();
        continue;
      }
      // Its own time counts: what comes now may have waited in the driver since before.
      if (++good_ <= options_.settling_frames || *(*frame)->taken < settled_at_) continue;
      if (Status kept = average(*picture); !kept) return kept.error();
    }
    if (options_.time_suspended() - suspended_before_ > kMostSuspended) return slept();
    return AveragedPicture{average_.mean(), average_.count(), refused_};
  }

 private:
  std::optional<std::string_view> reason_against(const Frame& frame, std::optional<RawPicture>& picture) {
    const bool is_short = frame.bytes.empty() || frame.bytes.size() < bytes_of_frame(format_);
    if (!is_short) picture = pixels_of(format_, frame.bytes, decode_jpeg_);
    // Both count as seen whatever else is wrong with the frame.
    const bool repeated = picture && !seen_.insert(hash_of(*picture)).second;
    const std::optional<TimePoint> before = newest_;
    const bool ahead = frame.taken && *frame.taken > clock_.now();
    if (frame.taken && !ahead) newest_ = std::max(newest_.value_or(*frame.taken), *frame.taken);
    if (frame.damaged) return kDamaged;
    if (!frame.taken) return kTimeless;
    if (*frame.taken <= asked_) return kOld;
    if (ahead) return kFuture;
    if (before && *frame.taken <= *before) return kNoYounger;
    if (is_short) return kShort;
    if (!picture) return kBroken;
    if (repeated) return kRepeated;
    return std::nullopt;
  }

  Status average(const RawPicture& picture) {
    SquareMeans squares(picture);
    if (!first_ || first_->most_change(squares) > options_.most_change) {
      if (++beginnings_ > options_.most_beginnings) return moves();
      average_ = {};
      first_ = std::move(squares);
    }
    average_.add(picture);
    return Ok();
  }

  Error too_late() const {
    const double seconds = std::chrono::duration<double>(options_.deadline).count();
    if (refused_ > 0)
      return {ErrorCode::kUnavailable,
              fmt::format("the camera {} gave no good picture within {:g} s, but pictures {}: {}", source_.camera(),
                          seconds, last_reason_, remedy())};
    if (came_ > 0)
      return {ErrorCode::kUnavailable,
              fmt::format("the camera {} gave {} pictures within {:g} s, which is too slow: set a smaller width and "
                          "height or a shorter exposure (and fewer frames, where their number was set)",
                          source_.camera(), came_, seconds)};
    return {
        ErrorCode::kUnavailable,
        fmt::format("the camera {} gave no picture within {:g} s: unplug it, plug it in again and look at its cable",
                    source_.camera(), seconds)};
  }
  Error too_many() const {
    return {ErrorCode::kDeviceFault,
            fmt::format("the camera {} gives pictures {}: {}", source_.camera(), last_reason_, remedy())};
  }
  std::string_view remedy() const {
    if (last_reason_ == kTimeless)
      return "its driver cannot tell old pictures from new ones, so use another camera or a newer kernel";
    if (last_reason_ == kRepeated) return "uncover its lens, or unplug it and plug it in again";
    if (last_reason_ == kDamaged || last_reason_ == kShort || last_reason_ == kBroken)
      return "plug it into a socket of the computer itself, by a short cable, or set another format";
    return "unplug it and plug it in again";
  }
  Error slept() const {
    return {
        ErrorCode::kUnavailable,
        fmt::format("this computer was suspended while the camera {} looked, and pictures from before that cannot be "
                    "told from newer ones: look again, and switch its sleep off",
                    source_.camera())};
  }
  Error moves() const {
    return {ErrorCode::kRefused,
            fmt::format(
                "pictures that the camera {} took right after one another differ, so something moves in its sight or "
                "the light flickers: keep hands and smoke away, and set exposure_time_absolute to a multiple of "
                "100 (of 83 where mains have 60 Hz)",
                source_.camera())};
  }

  FrameSource& source_;
  const FrameFormat& format_;
  const LookOptions& options_;
  const Clock& clock_;
  const DecodeJpeg& decode_jpeg_;
  const std::stop_token& stop_;
  const TimePoint asked_;
  const Duration suspended_before_;
  TimePoint settled_at_{};
  std::unordered_set<std::size_t> seen_;  // pixels of frames, as hash_of() has them
  std::optional<TimePoint> newest_;
  int came_ = 0, good_ = 0, refused_ = 0, beginnings_ = 0;
  std::string_view last_reason_;
  std::optional<SquareMeans> first_;  // of the average
  FrameAverage average_;
};

}  // namespace

Duration time_suspended() {
  const auto now = [](clockid_t clock) {
    timespec at{};
    ::clock_gettime(clock, &at);
    return Duration(std::chrono::seconds(at.tv_sec) + std::chrono::nanoseconds(at.tv_nsec));
  };
  // A process may be kept waiting between two calls: of some tries the one that took the least.
  constexpr Duration kSoon = std::chrono::milliseconds(1);
  Duration least = Duration::max(), suspended{};
  for (int i = 0; i < 10 && least > kSoon; ++i) {
    const Duration before = now(CLOCK_MONOTONIC), boot = now(CLOCK_BOOTTIME), took = now(CLOCK_MONOTONIC) - before;
    if (took < least) least = took, suspended = boot - before;
  }
  return suspended;
}

Result<AveragedPicture> take_look(FrameSource& source, const FrameFormat& format, const LookOptions& options,
                                  const Clock& clock, const DecodeJpeg& decode_jpeg, const std::stop_token& stop) {
  auto look = Looker(source, format, options, clock, decode_jpeg, stop).look();
  source.end();
  return look;
}

}  // namespace veneer::v4l2
