#include "drivers/grbl/motion_queue.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace veneer::grbl {
namespace {

double distance_to_segment_mm(double x, double y, WirePoint from, WirePoint to) {
  const double ax = static_cast<double>(from.x_um) / 1000, ay = static_cast<double>(from.y_um) / 1000;
  const double bx = static_cast<double>(to.x_um) / 1000 - ax, by = static_cast<double>(to.y_um) / 1000 - ay;
  const double squared = bx * bx + by * by;
  const double t = squared > 0 ? std::clamp(((x - ax) * bx + (y - ay) * by) / squared, 0.0, 1.0) : 0;
  return std::hypot(x - ax - t * bx, y - ay - t * by);
}

double distance_to_arc_mm(double x, double y, WirePoint from, WirePoint to, const ArcShape& arc) {
  const MicroPoint p{std::llround(x * 1000), std::llround(y * 1000)};
  const auto from_centre_mm = [&arc](MicroPoint q) {
    return std::hypot(static_cast<double>(q.x_um - arc.centre.x_um), static_cast<double>(q.y_um - arc.centre.y_um)) /
           1000;
  };
  const double to_ends = std::min(distance_to_segment_mm(x, y, from, from), distance_to_segment_mm(x, y, to, to));
  const bool beside = p == from || arc_turn_rad(from, p, arc) <= arc_turn_rad(from, to, arc);
  return beside ? std::min(to_ends, std::abs(from_centre_mm(p) - from_centre_mm(from))) : to_ends;
}

}  // namespace

bool MotionQueue::lies_on(const Move& move, double x_mm, double y_mm) const {
  const double off = move.arc ? distance_to_arc_mm(x_mm, y_mm, move.from, move.to, *move.arc)
                              : distance_to_segment_mm(x_mm, y_mm, move.from, move.to);
  return off <= limits_.tolerance_mm;
}

void MotionQueue::start_at(WirePoint at) {
  moves_.clear();
  executed_.clear();
  acknowledged_ = 0;
  queued_s_ = 0;
  begin_ = end_ = at;
}

bool MotionQueue::fits(const GcodeLine& line) const {
  return queued_s_ + line.longest_s <= (limits_.longest_s - limits_.hidden_s - limits_.unseen_s) * slowest_;
}

void MotionQueue::sent(const GcodeLine& line, TimePoint now) {
  moves_.push_back(
      {line.from, line.to, line.arc, line.longest_s, std::nullopt, false, line.lit(), line.stroke, now, {}});
  if (line.ends_stroke) moves_.back().ends_stroke = line.stroke;
  queued_s_ += line.longest_s;
  end_ = line.to;
}

void MotionQueue::acknowledged(TimePoint now) {
  if (acknowledged_ >= moves_.size()) return;
  moves_[acknowledged_++].accepted = now;
  // The planner holds at most so many motions; the ones before have left it.
  if (acknowledged_ > limits_.planner_blocks) release(moves_[acknowledged_ - limits_.planner_blocks - 1]);
}

void MotionQueue::release(Move& move) {
  if (std::exchange(move.released, true)) return;
  queued_s_ = std::max(0.0, queued_s_ - move.longest_s);
}

void MotionQueue::pop_front() {
  Move& move = moves_.front();
  release(move);
  begin_ = move.to;
  if (move.ends_stroke) executed_.push_back(*move.ends_stroke);
  moves_.pop_front();
  if (acknowledged_ > 0) --acknowledged_;
  // Sums of decimals do not come back to zero by themselves.
  if (moves_.empty()) queued_s_ = 0;
}

bool MotionQueue::reported(double x_mm, double y_mm, TimePoint now) {
  if (moves_.empty()) return distance_to_segment_mm(x_mm, y_mm, begin_, begin_) <= limits_.tolerance_mm;
  const auto here =
      std::find_if(moves_.begin(), moves_.end(), [&](const Move& move) { return lies_on(move, x_mm, y_mm); });
  if (here == moves_.end()) return false;
  if (here != moves_.begin()) front_since_ = now;
  for (auto passed = here - moves_.begin(); passed > 0; --passed) pop_front();
  return true;
}

double MotionQueue::longest_s(std::size_t count) const {
  double sum = 0;
  for (std::size_t i = 0; i < count; ++i) sum += moves_[i].longest_s;
  return sum / slowest_;
}

double MotionQueue::late_s(double x_mm, double y_mm, TimePoint asked) const {
  const double late = late_in_accepted_s(x_mm, y_mm, asked);
  if (acknowledged_ == moves_.size()) return late;
  const TimePoint since = std::max(front_since_, moves_[acknowledged_].sent);
  return std::max(late, std::chrono::duration<double>(asked - since).count() - longest_s(acknowledged_ + 1));
}

double MotionQueue::late_in_accepted_s(double x_mm, double y_mm, TimePoint asked) const {
  // Where the path crosses itself, the latest place that fits.
  std::size_t count = acknowledged_;
  while (count > 0 && !lies_on(moves_[count - 1], x_mm, y_mm)) --count;
  if (count == 0) return 0;
  const Move& last = moves_[count - 1];
  if (count == acknowledged_ && distance_to_segment_mm(x_mm, y_mm, last.to, last.to) <= limits_.tolerance_mm) return 0;
  return std::chrono::duration<double>(asked - std::max(front_since_, last.accepted)).count() - longest_s(count);
}

void MotionQueue::set_slowest(double fraction, TimePoint now) {
  if (std::exchange(slowest_, fraction) != fraction) went_on(now);
}

void MotionQueue::all_executed() {
  while (!moves_.empty()) pop_front();
}

bool MotionQueue::may_have_burnt(double x_mm, double y_mm) const {
  const auto last =
      std::find_if(moves_.rbegin(), moves_.rend(), [&](const Move& move) { return lies_on(move, x_mm, y_mm); });
  return std::any_of(last, moves_.rend(), [](const Move& move) { return move.burns; });
}

std::optional<std::pair<std::size_t, std::size_t>> MotionQueue::strokes_in_flight() const {
  const auto burns = [](const Move& move) { return move.burns; };
  const auto first = std::find_if(moves_.begin(), moves_.end(), burns);
  if (first == moves_.end()) return std::nullopt;
  return std::pair(first->stroke, std::find_if(moves_.rbegin(), moves_.rend(), burns)->stroke);
}

std::vector<std::size_t> MotionQueue::take_executed() { return std::exchange(executed_, {}); }

}  // namespace veneer::grbl
