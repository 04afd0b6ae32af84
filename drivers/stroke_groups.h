// A job goes in groups, one for each piece: the strokes that follow each other and belong to it. Strokes of no piece
// are cut into groups by their size, so that no group takes long to write, and a digit lost on the wire is found soon.
#pragma once

#include <cstddef>
#include <span>

#include "drivers/laser_job.h"

namespace veneer {

struct StrokeGroup {
  std::size_t begin = 0, end = 0;  // indices into LaserJob::strokes
  bool empty() const { return begin == end; }
};

inline constexpr std::size_t kMostPointsOfNoPiece = 2000;

// The group that begins with this stroke; empty behind the last one.
inline StrokeGroup group_from(const LaserJob& job, std::size_t begin) {
  StrokeGroup group{begin, begin};
  for (std::size_t points = 0; group.end < job.strokes.size(); ++group.end) {
    const Stroke& stroke = job.strokes[group.end];
    if (stroke.piece != job.strokes[begin].piece) break;
    points += stroke.path.size();
    if (stroke.piece == PieceId{} && group.end > begin && points > kMostPointsOfNoPiece) break;
  }
  return group;
}

inline std::span<const Stroke> strokes_of(const LaserJob& job, const StrokeGroup& group) {
  return std::span(job.strokes).subspan(group.begin, group.end - group.begin);
}

}  // namespace veneer
