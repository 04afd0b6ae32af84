// What `veneerctl laser run` asks to be burnt: strokes of no piece, in machine millimetres. Pure.
#pragma once

#include <cstddef>
#include <vector>

#include "base/result.h"
#include "drivers/laser_driver.h"
#include "drivers/laser_job.h"

namespace veneer::daemon {

// Flat, since a dense drawing has half a million points. Of the lists behind the points each has one entry for each
// stroke, or one for all.
struct DrawnStrokes {
  std::vector<double> points_mm;          // x, y, x, y, ...
  std::vector<double> points_per_stroke;  // whole, at least 2
  std::vector<double> speeds_mm_s, powers;
  std::vector<double> passes{1};  // whole
  std::vector<double> air{0};     // 0 or 1
};

// kInvalidArgument says which list does not fit the others. Long strokes come in parts that begin where the one before
// ended: a stroke is written whole before any of it is sent. All dark when `dry`.
Result<LaserJob> job_of_strokes(const DrawnStrokes& strokes, bool dry);

// Burnt, all passes.
Millimetres length_of(const LaserJob& job);

// kInvalidArgument says by how much the drawing leaves the travel, and what helps.
Status check_fits(const LaserJob& job, const LaserLimits& limits);

// Without homing switches: dark, back to the corner, so that the head shows it to a person.
void return_to_corner(LaserJob& job, const LaserLimits& limits, MmPerSecond speed);

inline constexpr std::size_t kMostPointsToRun = 500'000;

}  // namespace veneer::daemon
