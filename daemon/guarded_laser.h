// A laser whose beam does not begin, and whose port is not opened, while nobody would darken it should this process
// die.
//
// Contract and threading: drivers/laser_driver.h.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <functional>
#include <memory>
#include <utility>

#include "drivers/laser_driver.h"

namespace veneer::daemon {

class GuardedLaser final : public LaserDriver {
 public:
  // `guarded` says whether somebody watches, or why a beam may not begin. `reactor` outlives this.
  GuardedLaser(boost::asio::io_context& reactor, std::unique_ptr<LaserDriver> laser, std::function<Status()> guarded)
      : reactor_(reactor), laser_(std::move(laser)), guarded_(std::move(guarded)), alive_(std::make_shared<int>(0)) {}

  void connect(OnEvent on_event) override {
    on_event_ = on_event;
    if (const Status watched = guarded_(); !watched) return refuse(watched.error());
    laser_->connect(std::move(on_event));
  }
  void home() override { laser_->home(); }
  void start(LaserJob job) override {
    if (const Status watched = guarded_(); !watched && burns(job)) return refuse(watched.error());
    laser_->start(std::move(job));
  }
  void hold() override { laser_->hold(); }
  void resume() override {
    if (guarded_()) return laser_->resume();
    tell(laser_event::Held{});
  }
  void stop_after_piece() override { laser_->stop_after_piece(); }
  void abort() noexcept override { laser_->abort(); }
  LaserStatus status() const override {
    LaserStatus status = laser_->status();
    if (const Status watched = guarded_(); !watched) status.refusal = watched.error().message;
    return status;
  }
  Status check(const LaserJob& job) override { return laser_->check(job); }
  Status jog(Millimetres dx, Millimetres dy, MmPerSecond speed) override { return laser_->jog(dx, dy, speed); }
  void stop_jog() override { laser_->stop_jog(); }
  Status corner_is_here() override { return laser_->corner_is_here(); }
  Status set_overrides(const LaserOverrides& overrides) override { return laser_->set_overrides(overrides); }

 private:
  static bool burns(const LaserJob& job) {
    for (const Stroke& stroke : job.strokes)
      if (stroke.power > PowerFraction(0)) return true;
    return false;
  }
  void refuse(const Error& why) { tell(laser_event::Failed{why}); }
  void tell(LaserEvent event) {
    boost::asio::post(reactor_, [this, event = std::move(event), alive = std::weak_ptr<int>(alive_)] {
      if (!alive.expired() && on_event_) on_event_(event);
    });
  }

  boost::asio::io_context& reactor_;
  std::unique_ptr<LaserDriver> laser_;
  std::function<Status()> guarded_;
  OnEvent on_event_;
  std::shared_ptr<int> alive_;
};

}  // namespace veneer::daemon
