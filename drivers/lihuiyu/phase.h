// What the driver is about with its board, one object per phase: how it takes the board's lines, packets that were
// accepted, failures of the link and deadlines, and which commands.
//
//   closed -> configuring -> connecting -> ready <-> homing, burning
//   any that is connected -> resetting -> ready;  any -> closed
//
// A phase that goes over into another one calls PhaseHost::enter() last and returns: it lives until its call is over.
// Pure; not thread-safe.
#pragma once

#include <memory>
#include <optional>
#include <utility>

#include "drivers/laser_driver.h"
#include "drivers/lihuiyu/machine.h"

namespace veneer::lihuiyu {

class Phase;

class PhaseHost {
 public:
  virtual void enter(std::unique_ptr<Phase> next) = 0;
  virtual void tell(LaserEvent event) = 0;

 protected:
  ~PhaseHost() = default;
};

class Phase {
 public:
  Phase(Machine& machine, PhaseHost& host) : m_(machine), host_(host) {}
  virtual ~Phase() = default;
  Phase(const Phase&) = delete;
  Phase& operator=(const Phase&) = delete;

  // The host has let it in.
  virtual void entered() {}

  // ---- commands; what a phase has no use for is refused, or nothing
  virtual void home() = 0;
  virtual void start(LaserJob&& job);
  virtual void hold() {}
  virtual void resume() {}
  virtual void stop_after_piece() {}
  virtual void abort() = 0;

  // ---- what comes in
  // The reply to a transfer of the phase's own; false: it is the link's.
  virtual bool replied(const UsbReply& reply) {
    static_cast<void>(reply);
    return false;
  }
  virtual void accepted() {}  // the packet that was sent last
  virtual void told(BoardState state) { static_cast<void>(state); }
  virtual void link_failed(const Error& error) = 0;  // the board no longer does its part, though the port is there
  virtual void link_lost(const Error& error) = 0;    // the port is gone; ends in the closed phase

  // ---- time
  virtual void deadline() {}
  virtual void tick() {}
  void serve_deadline();
  virtual TimePoint next_deadline() const { return deadline_.value_or(TimePoint::max()); }
  virtual Duration poll_period() const { return m_.options.poll_period; }
  virtual bool uses_link() const { return true; }

  virtual bool connected() const { return true; }
  virtual bool job_running() const { return false; }
  virtual bool held() const { return false; }
  virtual bool beam_supposed_on() const { return false; }
  virtual MilPoint at() const { return m_.at; }

 protected:
  void fail(Error error) { host_.tell(laser_event::Failed{std::move(error)}); }
  void drop_out(Error error, bool still_connected);
  void close() {
    m_.output.close = true;
    end_closed();
  }
  void end_closed();
  // The reset packet now, and again until it is confirmed; the position is lost.
  void reset_board();

  Machine& m_;
  PhaseHost& host_;
  std::optional<TimePoint> deadline_;  // of what the phase awaits
};

std::unique_ptr<Phase> closed(Machine& machine, PhaseHost& host);
std::unique_ptr<Phase> configuring(Machine& machine, PhaseHost& host);
std::unique_ptr<Phase> ready(Machine& machine, PhaseHost& host);
std::unique_ptr<Phase> resetting(Machine& machine, PhaseHost& host);
std::unique_ptr<Phase> homing(Machine& machine, PhaseHost& host);
// `job` has passed check_job().
std::unique_ptr<Phase> burning(Machine& machine, PhaseHost& host, LaserJob job);

std::string_view firmware_of(Board board);

inline Error stopped_by_command() { return {ErrorCode::kCancelled, "the laser was stopped by command"}; }
inline Error power_lost() {
  return {ErrorCode::kDeviceFault,
          "the laser board lost its power: check the lid, the emergency stop and the laser's supply"};
}

}  // namespace veneer::lihuiyu
