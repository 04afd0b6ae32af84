// A camera that plays what a test tells it, on a clock that the test owns: each wait for a frame lets time pass.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "drivers/raw_picture.h"
#include "drivers/v4l2/open_camera.h"

namespace veneer::testing {

class PlayedCamera : public v4l2::OpenCamera {
 public:
  // What is wrong with a frame.
  enum class Fault {
    kNone,
    kNoFrame,       // none comes
    kDamaged,       // the driver says so
    kShort,         // half of its bytes are missing
    kStale,         // shows what was there before the look, and says so
    kRepeated,      // the one before once more, with a time of its own
    kOldTime,       // the time of the one before
    kFutureTime,    // an hour ahead
    kNoTime,        // by another clock
    kUnplugged,     // from here on
    kCannotBeRead,  // from here on
  };
  static constexpr int kSide = 48;  // pixels

  explicit PlayedCamera(ManualClock& clock) : clock_(clock) {}

  const std::string& camera() const override { return name; }
  std::string card() const override { return "Played Camera"; }
  std::string bus() const override { return "usb-1"; }

  Status start() override {
    ++starts;
    if (on_start) on_start();
    return start_refusal;
  }
  Result<std::optional<v4l2::Frame>> next(Duration wait) override {
    if (on_next) on_next(number_);
    const Fault now = fault ? fault(number_) : Fault::kNone;
    if (now == Fault::kUnplugged) return Error{ErrorCode::kUnavailable, "the camera played was unplugged"};
    if (now == Fault::kCannotBeRead) return Error{ErrorCode::kDeviceFault, "the camera played cannot be read"};
    clock_.advance(std::min(wait, interval));
    if (wait < interval) return std::optional<v4l2::Frame>();
    ++number_;
    if (now == Fault::kNoFrame) return std::optional<v4l2::Frame>();
    v4l2::Frame frame = taken_now(now);
    if (queue == 0) return std::optional(std::move(frame));
    waiting_.push_back(std::move(frame));
    if (waiting_.size() <= queue) return std::optional<v4l2::Frame>();
    frame = std::move(waiting_.front());
    waiting_.pop_front();
    return std::optional(std::move(frame));
  }
  void end() noexcept override { ++ends; }

  Result<std::vector<v4l2::OfferedFormat>> formats() override { return offered; }
  Result<v4l2::FrameFormat> set_format(const std::string& code, int width, int height) override {
    v4l2::FrameFormat out = format;
    if (!keeps_format) out.code = code, out.width = width, out.height = height, out.bytes_per_line = width * 3;
    return out;
  }
  Result<std::vector<v4l2::CameraControl>> controls() override { return has; }
  Status set(const v4l2::CameraControl& control, std::int64_t value) override {
    sets.emplace_back(control.name, value);
    const auto of_it = std::ranges::find(has, control.name, &v4l2::CameraControl::name);
    if (of_it == has.end()) return Error{ErrorCode::kRefused, "the camera played has no " + control.name};
    if (!of_it->active) return Error{ErrorCode::kRefused, "the camera played does not take " + control.name};
    of_it->value = takes ? takes(control.name, value) : value;
    if (on_set) on_set(control.name);
    return Ok();
  }

  v4l2::Frame taken_now(Fault now) {
    v4l2::Frame frame;
    frame.bytes = now == Fault::kRepeated && !last_.empty() ? last_ : seen(now == Fault::kStale ? before : scene);
    frame.taken = clock_.now() - std::chrono::milliseconds(1);
    if (now == Fault::kDamaged) frame.damaged = true;
    if (now == Fault::kShort) frame.bytes.resize(frame.bytes.size() / 2);
    if (now == Fault::kStale) frame.taken = TimePoint(std::chrono::milliseconds(1));
    if (now == Fault::kOldTime) frame.taken = last_time_;
    if (now == Fault::kFutureTime) frame.taken = clock_.now() + std::chrono::hours(1);
    if (now == Fault::kNoTime) frame.taken.reset();
    if (now == Fault::kNone) good.push_back(frame.bytes), good_at.push_back(*frame.taken);
    last_ = frame.bytes, last_time_ = frame.taken;
    return frame;
  }

  // What it shows of `levels`, with noise of its own in every frame.
  std::vector<std::uint8_t> seen(const std::function<int(int x, int y)>& levels) {
    std::vector<std::uint8_t> out;
    std::uniform_int_distribution<int> scatter(-noise, noise);
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x)
        for (int c = 0; c < 3; ++c)
          out.push_back(static_cast<std::uint8_t>(std::clamp(levels(x, y) + scatter(random_), 0, 255)));
    return out;
  }

  std::string name = "played";
  v4l2::FrameFormat format{"RGB3", kSide, kSide, kSide * 3};
  bool keeps_format = false;
  std::vector<v4l2::OfferedFormat> offered{{"RGB3", kSide, kSide, kSide, kSide}};
  Duration interval = std::chrono::milliseconds(40);
  std::size_t queue = 0;  // frames that its driver holds back, as one that has several buffers
  int noise = 3;
  std::function<int(int, int)> scene = [](int x, int y) { return 100 + x - y; };
  std::function<int(int, int)> before = [](int x, int y) { return 30 + x + y; };
  std::function<Fault(int number)> fault;  // of each frame since the first start, from 0
  std::function<void()> on_start;
  std::function<void(int number)> on_next;
  Status start_refusal;
  int starts = 0, ends = 0;
  std::vector<std::vector<std::uint8_t>> good;  // frames without a fault
  std::vector<TimePoint> good_at;               // when each was taken

  std::vector<v4l2::CameraControl> has;
  std::function<std::int64_t(const std::string& name, std::int64_t value)> takes;
  std::function<void(const std::string& name)> on_set;
  std::vector<std::pair<std::string, std::int64_t>> sets;

 private:
  ManualClock& clock_;
  std::mt19937 random_{7};
  int number_ = 0;
  std::deque<v4l2::Frame> waiting_;
  std::vector<std::uint8_t> last_;
  std::optional<TimePoint> last_time_;
};

}  // namespace veneer::testing
