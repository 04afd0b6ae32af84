// A new link: a reset, then all that must be known of the controller is asked for and read.
#include <algorithm>
#include <utility>

#include "drivers/grbl/phase.h"

namespace veneer::grbl {
namespace {

class Connecting final : public Phase {
 public:
  using Phase::Phase;

  void entered() override {
    m_.start_anew();
    deadline_ = m_.now + m_.options.connect_timeout;
    // Stops whatever a former host left running, and throws away half a line it left in the buffer.
    m_.reset();
  }
  void home() override { fail({ErrorCode::kUnavailable, "the laser is not connected, so it cannot be homed"}); }
  void start(LaserJob&&) override { fail({ErrorCode::kUnavailable, "the laser is not connected"}); }
  Status check(const LaserJob&) override { return Error{ErrorCode::kUnavailable, "the laser is not connected"}; }
  Status jog(Millimetres, Millimetres, MmPerSecond) override {
    return Error{ErrorCode::kUnavailable, "the laser is not connected"};
  }
  Status corner_is_here() override {
    m_.corner.operator_says_here();
    return Ok();
  }
  void abort() override {
    m_.reset();
    give_up(stopped_by_command());
  }
  void alarm(int) override {}
  void banner(const Banner& banner) override {
    m_.settings_reader.banner(banner);
    step_ = Step::kWake;
    settled_at_ = m_.now + m_.options.settle_time;
  }
  void settled() override { go_on(Step::kBuildInfo); }
  void answered(const Outstanding& line, std::optional<int> error) override;
  void reported(const StatusReport& report, const Heard& heard) override;
  void link_lost(const Error& error) override {
    fail(error);
    host_.enter(closed(m_, host_));
  }
  void deadline() override {
    m_.reset();
    give_up({ErrorCode::kTimeout,
             "no GRBL controller answers on the laser's port: check power, cable and the port in the configuration"});
  }
  bool minds_silence() const override { return false; }  // it may still be booting; the deadline rules
  bool connected() const override { return false; }

 private:
  enum class Step { kWake, kBuildInfo, kSettings, kSettingsAgain, kModes, kStatus };
  void go_on(Step step);
  void finish();
  void give_up(Error error) {
    fail(std::move(error));
    m_.close_link();
    host_.enter(closed(m_, host_));
  }

  Step step_ = Step::kWake;
};

void Connecting::go_on(Step step) {
  step_ = step;
  switch (step) {
    case Step::kWake:
      return;
    case Step::kBuildInfo:
      return m_.send_text("$I\n");
    case Step::kSettings:
      return m_.send_text("$$\n");
    case Step::kSettingsAgain:
      m_.settings_reader.read_again();
      return m_.send_text("$$\n");
    case Step::kModes:
      m_.modes_told = false;
      return m_.send_text("$G\n");
    case Step::kStatus:
      return m_.ask_afresh();
  }
}

void Connecting::answered(const Outstanding&, std::optional<int> error) {
  switch (step_) {
    case Step::kBuildInfo:
      return go_on(Step::kSettings);  // without $I: stock sizes
    case Step::kSettings:
      return go_on(Step::kSettingsAgain);
    case Step::kSettingsAgain:
      return go_on(Step::kModes);
    case Step::kModes:
      if (!error && m_.modes_told) return go_on(Step::kStatus);
      return give_up(
          {ErrorCode::kRefused, "the laser controller does not tell its modes ($G), so it cannot be supervised"});
    case Step::kWake:
    case Step::kStatus:
      return;
  }
}

void Connecting::reported(const StatusReport&, const Heard&) {
  // A controller that runs already may print no banner.
  if (step_ == Step::kWake && !settled_at_ && m_.now - begin_ >= m_.options.banner_wait) return go_on(Step::kBuildInfo);
  if (step_ == Step::kStatus && m_.position()) finish();
}

void Connecting::finish() {
  auto settings = m_.settings_reader.finish();
  if (!settings.ok()) return give_up(settings.error());
  m_.settings = std::move(settings).value();
  m_.use_window_of(m_.settings);
  const Axis &x = m_.settings.x, &y = m_.settings.y;
  host_.enter(ready(m_, host_));
  host_.tell(laser_event::Connected{
      {m_.settings.travel(), m_.settings.firmware, m_.settings.homing,
       MmPerSecond(std::min(x.max_rate_mm_s, y.max_rate_mm_s)),
       LaserMotion{MmPerSecond(x.max_rate_mm_s), MmPerSecond(y.max_rate_mm_s), MmPerSecond2(x.acceleration_mm_s2),
                   MmPerSecond2(y.acceleration_mm_s2), Millimetres(m_.settings.junction_deviation_mm),
                   static_cast<int>(m_.settings.planner_blocks)},
       m_.settings.unlikely, m_.settings.identity, !m_.options.recording}});
}

}  // namespace

std::unique_ptr<Phase> connecting(Machine& machine, PhaseHost& host) {
  return std::make_unique<Connecting>(machine, host);
}

}  // namespace veneer::grbl
