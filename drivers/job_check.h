// What is wrong with a job whichever laser is to burn it, and what this one cannot do. Checked whole, before any byte
// of it is sent: places, speeds, powers, order. Pure; thread-safe.
#pragma once

#include <functional>
#include <string>

#include "base/geometry.h"
#include "base/result.h"
#include "drivers/laser_job.h"

namespace veneer {

// What a machine can do with a stroke.
struct JobLimits {
  Box<MachineFrame> travel;
  MmPerSecond slowest{0}, fastest{0};
  std::string speed_words;  // "0 to 400 mm/s, the slower axis's limit"
  bool overscan = false;    // it runs up to a fill's lines, so the run-ups count too
  // Can the machine not tell these two places apart?
  std::function<bool(const Point<MachineFrame>&, const Point<MachineFrame>&)> same_place;
};

// kInvalidArgument; the sentence names the stroke.
Status check_job(const LaserJob& job, const JobLimits& limits);

// The end of a line of a fill, lengthened by its run-up or run-out.
Point<MachineFrame> beyond(const Point<MachineFrame>& end, const Point<MachineFrame>& before, Millimetres by);

}  // namespace veneer
