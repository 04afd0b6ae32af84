// To the corner, and to the focus height where the machine has a motorised Z. A machine without switches takes the
// place where its head stands as the corner, or brings the head back to it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/grbl/phase.h"
#include "drivers/overdue.h"

namespace veneer::grbl {
namespace {

class Homing final : public Phase {
 public:
  using Phase::Phase;

  void entered() override {
    m_.homed = false;
    deadline_ = m_.now + m_.options.homing_timeout;
    // A machine without switches may be locked by the reset that stopped it.
    go_on(Step::kCorner, m_.settings.homing ? "$H\n" : "$X\n");
  }
  void home() override {}
  void abort() override {
    m_.homed = false;
    fail(stopped_by_command());
    reset();
  }
  void answered(const Outstanding& line, std::optional<int> error) override;
  void alarm(int number) override {
    fail({ErrorCode::kDeviceFault, alarm_words(number)});
    reset();
  }
  void banner(const Banner&) override {
    m_.homed = false;
    fail(reset_by_others());
    host_.enter(ready(m_, host_));
  }
  void reported(const StatusReport& report, const Heard& heard) override;
  void link_lost(const Error& error) override {
    fail(error);
    m_.homed = false;
    host_.enter(closed(m_, host_));
  }
  void deadline() override {
    m_.homed = false;
    fail({ErrorCode::kTimeout,
          overdue_words(step_ == Step::kFocus
                            ? "the laser's head did not reach the focus height (laser.focus_z_mm) in time"
                            : "the laser did not finish homing in time",
                        "Clear and Reset")});
    reset();
  }
  bool polls() const override { return answered_; }  // stock GRBL answers nothing while it homes

 private:
  enum class Step { kCorner, kBack, kFocus };
  void go_on(Step step, std::string line);
  void finish_with_switches();
  void finish_without_switches();
  void end(std::optional<Error> error);

  Step step_ = Step::kCorner;
  bool answered_ = false;
};

void Homing::go_on(Step step, std::string line) {
  step_ = step;
  answered_ = false;
  m_.ask_afresh();
  m_.send_text(std::move(line));
}

void Homing::answered(const Outstanding&, std::optional<int> error) {
  if (!error) {
    answered_ = true;
    return m_.ask();
  }
  fail({ErrorCode::kDeviceFault,
        fmt::format("the laser refused to {} with {}", step_ == Step::kFocus ? "move to the focus height" : "home",
                    describe_error(*error, m_.settings.family))});
  host_.enter(ready(m_, host_));
}

void Homing::reported(const StatusReport& report, const Heard&) {
  if (!answered_ || !report.is("Idle") || !m_.position()) return;  // the deadline bounds the wait
  if (step_ == Step::kFocus && !m_.at_focus()) return;
  if (!m_.settings.homing) return finish_without_switches();
  // G53 counts from the machine's own zero, whatever the modes; G0 is dark.
  if (m_.options.focus_z && step_ == Step::kCorner)
    return go_on(Step::kFocus, fmt::format("G21G53G0Z{:.3f}\n", m_.options.focus_z->count()));
  finish_with_switches();
}

void Homing::finish_with_switches() {
  const Axis &x = m_.settings.x, &y = m_.settings.y;
  const auto [at_x, at_y] = *m_.position();
  const double tolerance = 0.05 + 1 / std::min(x.steps_per_mm, y.steps_per_mm);
  if (std::abs(at_x - x.home_mm) <= tolerance && std::abs(at_y - y.home_mm) <= tolerance) return end(std::nullopt);
  end(Error{ErrorCode::kRefused,
            fmt::format("after homing the laser says it is at ({:.3f}, {:.3f}), but its settings $23, $27 and $130 "
                        "put the corner at ({:.3f}, {:.3f}): check them",
                        at_x, at_y, x.home_mm, y.home_mm)});
}

void Homing::finish_without_switches() {
  if (m_.options.focus_z)
    return end(Error{ErrorCode::kRefused,
                     "the laser has no homing switches, so nothing says where its head stands over the wood: take "
                     "laser.focus_z_mm out of the configuration and set the focus by hand"});
  const Axis &x = m_.settings.x, &y = m_.settings.y;
  const auto [at_x, at_y] = *m_.position();
  m_.corner.compare(*m_.position(), std::chrono::duration<double>(m_.options.silence_timeout).count() *
                                        std::max(x.max_rate_mm_s, y.max_rate_mm_s));
  if (m_.corner.to_be_taken()) {
    m_.settings.put_corner(at_x, at_y);
    m_.corner.taken();
    return end(std::nullopt);
  }
  if (m_.corner.forgotten())
    return end(Error{ErrorCode::kRefused,
                     "the laser has no homing switches, and its controller has forgotten where its head stands: bring "
                     "the head to the lower left corner of the bed, say veneerctl laser here, then Clear and Reset"});
  // By the controller's own count, which a stop in motion shifts by a few steps at most.
  const double tolerance = 0.5 / std::min(x.steps_per_mm, y.steps_per_mm) + 0.001;
  if (std::max(std::abs(at_x - x.origin_mm), std::abs(at_y - y.origin_mm)) <= tolerance) return end(std::nullopt);
  if (step_ == Step::kCorner) go_on(Step::kBack, fmt::format("G21G53G0X{:.3f}Y{:.3f}\n", x.origin_mm, y.origin_mm));
}

void Homing::end(std::optional<Error> error) {
  host_.enter(ready(m_, host_));
  if (error) return fail(std::move(*error));
  m_.homed = true;
  host_.tell(laser_event::Homed{});
}

}  // namespace

std::unique_ptr<Phase> homing(Machine& machine, PhaseHost& host) { return std::make_unique<Homing>(machine, host); }

}  // namespace veneer::grbl
