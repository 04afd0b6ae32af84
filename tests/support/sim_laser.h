// A LaserDriver without bytes: it burns when told to, and tells what it was asked. For tests of what lies above a
// driver; the driver itself is tested on the controller simulator.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <functional>
#include <string>
#include <vector>

#include "drivers/laser_driver.h"

namespace veneer::tests {

class SimLaser final : public LaserDriver {
 public:
  explicit SimLaser(boost::asio::io_context& io) : io_(io) {}

  void connect(OnEvent on_event) override {
    calls.push_back("connect");
    on_event_ = std::move(on_event);
    LaserLimits limits;
    limits.firmware = "SimLaser";
    limits.finds_home = finds_home;
    limits.fastest = MmPerSecond(400);
    limits.motion = motion;
    connected_ = present;
    if (says_why) why_not_connected = present ? "" : absence;
    limits.travel.add(point<MachineFrame>(0, 0));
    limits.travel.add(point<MachineFrame>(520, 380));
    limits.to_confirm = to_confirm;
    limits.burns = cuts;
    limits.identity = identity;
    if (present)
      say(laser_event::Connected{limits});
    else
      say(laser_event::Failed{{ErrorCode::kUnavailable, absence}});
  }
  void home() override {
    calls.push_back("home");
    if (homes) say(laser_event::Homed{});
  }
  void start(LaserJob job) override {
    calls.push_back("start");
    lid_was_open = false;
    job_ = std::move(job);
    burning_ = true;
    if (burn_at_once) finish();
  }
  void hold() override {
    calls.push_back("hold");
    if (on_hold == OnHold::kHeld) say(laser_event::Held{});
    if (on_hold == OnHold::kNotBegun && std::exchange(burning_, false))
      say(laser_event::Failed{{ErrorCode::kCancelled, "held before it began"}});
  }
  void resume() override {
    calls.push_back("resume");
    if (on_resume) on_resume();
    if (lid_open || stays_held || !refusal.empty()) return say(laser_event::Held{});
    say(laser_event::Resumed{});
    if (burn_at_once) finish();
  }
  void stop_after_piece() override { calls.push_back("stop_after_piece"); }
  void abort() noexcept override {
    if (on_abort) on_abort();
    calls.push_back("abort");
    if (burning_) fail({ErrorCode::kCancelled, "the laser was stopped by command"}, stray_path, stray_reach);
  }
  LaserStatus status() const override {
    LaserStatus status;
    status.connected = status.homed = connected_;
    status.state = lid_open ? "Door:1" : leaves_door ? "Door:3" : lid_was_open ? "Door:0" : "Idle";
    status.position = position;
    status.beam_on = burning_ || beam_stays_on;
    status.firmware = "SimLaser";
    status.overrides_wanted = overrides;
    status.lid_open = lid_open;
    status.lid_openings = lid_openings;
    status.refusal = refusal;
    status.why_not_connected = why_not_connected;
    return status;
  }
  // Stands where it was sent once end_jog() is called.
  Status jog(Millimetres dx, Millimetres dy, MmPerSecond) override {
    if (!can_jog) return Error{ErrorCode::kRefused, "this laser cannot be jogged"};
    calls.push_back("jog");
    jogged_to_ = {position.x + dx, position.y + dy};
    return Ok();
  }
  void stop_jog() override {
    calls.push_back("stop_jog");
    say(laser_event::JogEnded{});
  }
  void end_jog() {
    position = jogged_to_;
    say(laser_event::JogEnded{});
  }

  Status set_overrides(const LaserOverrides& wanted) override {
    if (!can_override) return Error{ErrorCode::kRefused, "this laser has no overrides"};
    overrides = wanted;
    return Ok();
  }

  void open_lid() {
    lid_open = true;
    ++lid_openings;
  }
  void close_lid() {
    lid_open = false;
    lid_was_open = true;
  }
  // As one who reaches in between two reports.
  void open_and_close_lid() { open_lid(), close_lid(); }

  // Ends the piece that is being burnt, well.
  void finish() {
    if (!std::exchange(burning_, false)) return;
    burnt.push_back(job_.strokes.empty() ? PieceId{} : job_.strokes.front().piece);
    jobs.push_back(job_);
    say(laser_event::PieceVerified{burnt.back()});
    say(laser_event::Done{false, remark});
  }
  // Breaks it off.
  void fail(const Error& error, Polyline<MachineFrame> strayed = {}, Millimetres reach = {}) {
    burning_ = false;
    say(laser_event::Aborted{error, {job_.strokes.front().piece}, true, std::move(strayed), reach});
  }
  void say(LaserEvent event) {
    boost::asio::post(io_, [this, event = std::move(event)] { on_event_(event); });
  }
  bool burning() const { return burning_; }

  std::vector<std::string> calls;
  std::vector<PieceId> burnt;
  std::vector<LaserJob> jobs;  // as burnt
  bool present = true;
  std::string absence = "no laser at this port: plug it in";  // why it is not connected then
  bool says_why = false;                                      // whenever it is asked how it stands
  std::string why_not_connected;                              // as it says that
  std::optional<LaserMotion> motion;                          // as it tells when it is connected
  bool finds_home = true;
  bool homes = true;                    // and comes to the end of it
  bool beam_stays_on = false;           // whatever it was told
  bool cuts = true;                     // not a file that records
  std::vector<std::string> to_confirm;  // unlikely settings
  std::string identity;                 // of its controller
  std::string remark;                   // behind Done
  bool lid_open = false;
  bool lid_was_open = false;  // and is closed again, and nothing was begun since
  bool leaves_door = false;   // it is closed, and the controller still on its way out of the wait for that
  int lid_openings = 0;
  // What hold() is answered with; nothing by a driver whose strokes have ended in this very turn.
  enum class OnHold { kHeld, kNothing, kNotBegun } on_hold = OnHold::kHeld;
  std::function<void()> on_abort;     // before abort() does anything
  std::function<void()> on_resume;    // the same
  bool stays_held = false;            // when it is to resume
  std::string refusal;                // why no beam may begin
  Polyline<MachineFrame> stray_path;  // what abort() tells of a job
  Millimetres stray_reach{0};
  bool can_jog = false;
  bool can_override = false;
  LaserOverrides overrides;
  Point<MachineFrame> position{};
  bool burn_at_once = true;

 private:
  boost::asio::io_context& io_;
  OnEvent on_event_;
  LaserJob job_;
  bool burning_ = false;
  bool connected_ = false;
  Point<MachineFrame> jogged_to_{};
};

}  // namespace veneer::tests
