// A LaserDriver without bytes: it burns when told to, and tells what it was asked. For tests of what lies above a
// driver; the driver itself is tested on the controller simulator.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
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
    LaserLimits limits{{}, "SimLaser", finds_home, MmPerSecond(400), motion};
    connected_ = present;
    limits.travel.add(point<MachineFrame>(0, 0));
    limits.travel.add(point<MachineFrame>(520, 380));
    if (present)
      say(laser_event::Connected{limits});
    else
      say(laser_event::Failed{{ErrorCode::kUnavailable, "no laser at this port: plug it in"}});
  }
  void home() override {
    calls.push_back("home");
    say(laser_event::Homed{});
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
    say(laser_event::Held{});
  }
  void resume() override {
    calls.push_back("resume");
    if (lid_open) return say(laser_event::Held{});
    say(laser_event::Resumed{});
    if (burn_at_once) finish();
  }
  void stop_after_piece() override { calls.push_back("stop_after_piece"); }
  void abort() noexcept override {
    calls.push_back("abort");
    burning_ = false;
  }
  LaserStatus status() const override {
    const char* word = lid_open ? "Door:1" : lid_was_open ? "Door:0" : "Idle";
    return {connected_, word, {}, burning_, connected_, "SimLaser", {}};
  }

  // Ends the piece that is being burnt, well.
  void finish() {
    if (!std::exchange(burning_, false)) return;
    burnt.push_back(job_.strokes.empty() ? PieceId{} : job_.strokes.front().piece);
    jobs.push_back(job_);
    say(laser_event::PieceVerified{burnt.back()});
    say(laser_event::Done{});
  }
  // Breaks it off.
  void fail(const Error& error) {
    burning_ = false;
    say(laser_event::Aborted{error, {job_.strokes.front().piece}, true});
  }
  void say(LaserEvent event) {
    boost::asio::post(io_, [this, event = std::move(event)] { on_event_(event); });
  }
  bool burning() const { return burning_; }

  std::vector<std::string> calls;
  std::vector<PieceId> burnt;
  std::vector<LaserJob> jobs;  // as burnt
  bool present = true;
  std::optional<LaserMotion> motion;  // as it tells when it is connected
  bool finds_home = true;
  bool lid_open = false;
  bool lid_was_open = false;  // and is closed again, and nothing was begun since
  bool burn_at_once = true;

 private:
  boost::asio::io_context& io_;
  OnEvent on_event_;
  LaserJob job_;
  bool burning_ = false;
  bool connected_ = false;
};

}  // namespace veneer::tests
