// What lasers with a sans-I/O core have in common: every command goes to the core with the time, then what the core has
// to say goes out over the link, its next deadline becomes a timer, and its events are told. A family adds its link.
//
// Contract, threading and safety: laser_driver.h.
#pragma once

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <memory>
#include <string>
#include <utility>
#include <variant>

#include "base/clock.h"
#include "base/log.h"
#include "drivers/laser_driver.h"

namespace veneer {

// Core: connect, home, start, hold, resume, abort and tick take the time; stop_after_piece, status, take_events,
// next_deadline, link_lost and discard_urgent.
template <class Core>
class ReactorLaser : public LaserDriver {
 public:
  ReactorLaser(const ReactorLaser&) = delete;
  ReactorLaser& operator=(const ReactorLaser&) = delete;

  void connect(OnEvent on_event) final {
    on_event_ = std::move(on_event);
    if (const Status opened = open_link(); !opened.ok()) {
      later([this, error = opened.error()] { tell(laser_event::Failed{error}); });
      return;
    }
    core_.connect(clock_.now());
    pump();
  }
  void home() final {
    core_.home(clock_.now());
    pump();
  }
  void start(LaserJob job) final {
    core_.start(std::move(job), clock_.now());
    pump();
  }
  void hold() final {
    core_.hold(clock_.now());
    pump();
  }
  void resume() final {
    core_.resume(clock_.now());
    pump();
  }
  void stop_after_piece() final {
    core_.stop_after_piece();
    pump();
  }
  void abort() noexcept final {
    send_reset();
    core_.abort(clock_.now());
    core_.discard_urgent();  // the reset is out already; a second one would only lengthen the controller's restart
    pump();
  }
  LaserStatus status() const final {
    LaserStatus status = core_.status();
    if (!status.connected) status.why_not_connected = why_not_connected_;
    return status;
  }

 protected:
  // `clock` is device time. It, `io` and the logger's sinks must outlive the laser.
  template <class Options>
  ReactorLaser(const Clock& clock, boost::asio::io_context& io, Logger log, Options options)
      : clock_(clock), core_(options), log_(std::move(log)), io_(io), timer_(io), alive_(std::make_shared<int>(0)) {}

  // Opens the link anew; what arrives goes through heard() and lost().
  virtual Status open_link() = 0;
  // Beam off and stop, past everything that is queued; on the wire, or with the system, when this returns.
  virtual void send_reset() noexcept = 0;
  // Hands the core's output to the link.
  virtual void flush_output() = 0;

  // Handlers of the link: dropped once the laser is gone.
  template <class Receive>
  auto heard(Receive receive) {
    return [this, alive = std::weak_ptr<int>(alive_), receive](const auto& what) {
      if (alive.expired()) return;
      receive(what);
      pump();
    };
  }
  auto lost() {
    return heard([this](const Error& error) {
      log_->warn("laser link: {}", error.message);
      core_.link_lost(error, clock_.now());
    });
  }

  void pump() {
    flush_output();
    arm_timer();
    // Events are told from the reactor's own turn, never from inside a call of the one who listens.
    for (LaserEvent& event : core_.take_events()) later([this, told = std::move(event)] { tell(told); });
  }
  // First of all in a destructor: nothing calls back from then on.
  void stop_listening() { alive_.reset(); }

  const Clock& clock_;
  Core core_;

 private:
  // A clock that stands still asks for timers of no length; the reactor must get round to other things in between.
  static constexpr Duration kShortestTimer = std::chrono::microseconds(200);

  void tell(const LaserEvent& event) {
    if (!core_.status().connected) note_why(event);
    if (on_event_) on_event_(event);
  }
  void note_why(const LaserEvent& event) {
    if (const auto* failed = std::get_if<laser_event::Failed>(&event)) why_not_connected_ = failed->error.message;
    if (const auto* fault = std::get_if<laser_event::Fault>(&event)) why_not_connected_ = fault->error.message;
    if (const auto* aborted = std::get_if<laser_event::Aborted>(&event)) why_not_connected_ = aborted->error.message;
  }
  template <class Then>
  void later(Then then) {
    boost::asio::post(io_, [alive = std::weak_ptr<int>(alive_), then = std::move(then)] {
      if (!alive.expired()) then();
    });
  }
  void arm_timer() {
    const TimePoint next = core_.next_deadline();
    if (next == TimePoint::max()) {
      timer_.cancel();
      return;
    }
    const Duration wait = std::max(kShortestTimer, clock_.real_delay(next - clock_.now()));
    timer_.expires_after(std::chrono::duration_cast<boost::asio::steady_timer::duration>(wait));
    timer_.async_wait([this, alive = std::weak_ptr<int>(alive_)](const boost::system::error_code& error) {
      if (error || alive.expired()) return;
      core_.tick(clock_.now());
      pump();
    });
  }

  Logger log_;
  boost::asio::io_context& io_;
  boost::asio::steady_timer timer_;
  OnEvent on_event_;
  std::string why_not_connected_;
  std::shared_ptr<int> alive_;  // handlers posted to the reactor hold it weakly
};

}  // namespace veneer
