// The planner and the steppers of the simulated GRBL: up to 15 blocks with look-ahead, and the head's exact motion
// along them. Speeds are trapezoids under the acceleration limits, corners are limited by junction deviation, holds and
// overrides take effect from the speed of the moment. Millimetres, seconds; positions are the controller's machine
// coordinates, targets are rounded to whole steps as the motors are.
#pragma once

#include <array>
#include <cstddef>
#include <deque>

#include "drivers/sim/grbl_controller/settings.h"

namespace veneer::sim {

using Vec3 = std::array<double, 3>;

struct MotionRequest {
  Vec3 target{};
  double feed = 0;  // programmed, mm/s; ignored when rapid
  bool rapid = false;
  bool overridable = true;
  double s = 0;          // spindle word that burns while moving, 0 = dark
  bool dynamic = false;  // power follows the speed (M4 in laser mode)
  double queued_at = 0;  // the caller's own time stamp, handed back
};

struct MotionBlock {
  MotionRequest request;
  Vec3 start{};
  Vec3 unit{};
  double length = 0;
  double accel = 0;
  double rapid_rate = 0;    // what the axes allow in this direction
  double programmed = 0;    // mm/s before overrides
  double nominal = 0;       // mm/s with overrides
  double junction_sqr = 0;  // highest speed^2 the corner into this block allows
  double entry_sqr = 0;     // planned
};

class Motion {
 public:
  static constexpr std::size_t kBlocks = 15;

  explicit Motion(const GrblSettings& settings) : settings_(settings) {}

  bool full() const { return blocks_.size() >= kBlocks; }
  bool empty() const { return blocks_.empty(); }
  std::size_t free_blocks() const { return kBlocks - blocks_.size(); }
  // False when the target is the same step: nothing is queued. Not to be called when full().
  bool add(const MotionRequest& request);

  // Where the head is now, and how fast.
  Vec3 position() const;
  double speed() const;
  const MotionBlock* current() const { return blocks_.empty() ? nullptr : &blocks_.front(); }

  bool running() const { return running_; }
  void start();  // from rest, along what is queued
  void hold();   // slows down to rest; what is queued stays
  // Stops dead and forgets all; the position stays where the head is.
  void flush();
  void set_position(const Vec3& position);
  void set_overrides(double feed, double rapid);  // fractions

  // Until the speed changes its course, the block ends, or a hold has come to rest. Only while running().
  double seconds_to_event() const;
  double seconds_to_phase_end() const;

  struct Step {
    Vec3 from{};
    Vec3 to{};
    double seconds = 0;
    MotionRequest request;  // of the block moved along
    bool block_done = false;
    bool stopped = false;  // at rest: nothing queued any more, or held
  };
  // Moves on by at most `seconds`, never past the end of a block.
  Step advance(double seconds);

 private:
  struct Phase {
    double seconds = 0;
    double speed = 0;  // at its start
    double accel = 0;
  };

  double nominal_speed(const MotionBlock& block) const;
  double corner_speed_sqr(const MotionBlock& before, const MotionBlock& block) const;
  double limit_by_axes(const Vec3& unit, int first_setting) const;
  void plan();
  void build_profile();
  void add_phase(double from, double to, double accel);
  void add_cruise(double speed, double length);
  void set_rest_profile(double speed, double remaining, double accel);

  const GrblSettings& settings_;
  std::deque<MotionBlock> blocks_;
  Vec3 last_{};  // where the queue ends
  double feed_override_ = 1;
  double rapid_override_ = 1;
  bool running_ = false;
  bool holding_ = false;
  double done_ = 0;   // mm of the first block that lie behind
  double speed_ = 0;  // at done_
  std::array<Phase, 4> phases_{};
  std::size_t phase_count_ = 0;
  std::size_t phase_ = 0;
  double end_speed_ = 0;       // at the end of the profile
  bool ends_in_rest_ = false;  // the profile ends before the block does
};

}  // namespace veneer::sim
