// What motion the controller may still hold, and what it has surely executed.
//
// Three questions, three answers:
//  - How long would the machine still move if the link died now? The sum of the longest durations of all motions sent
//    and not known to be done. A motion is known to be done when a reported position lies in a later one, when the
//    machine is idle with every line answered, or when so many later motions were acknowledged that the planner has let
//    it go. Each duration is from standstill to standstill, so the sum is never too small.
//  - Which strokes are burnt? Those before the place the machine itself reports, and all when it has drained.
//    Acknowledgements say nothing about that.
//  - Is the machine late? Motions that were accepted take no longer than their sum, and a motion is accepted when those
//    before it have ended, at the latest; an arc, which the controller plans chord by chord, when it has ended itself.
//    What takes longer runs with another feed, or to another place, than it was sent with.
// Where the path crosses itself the earliest place that fits the reported position counts: too little is believed
// done, never too much.
//
// Pure; not thread-safe.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "drivers/grbl/gcode.h"

namespace veneer::grbl {

struct MotionQueueLimits {
  double longest_s = 1.0;
  // What the controller has taken out of its planner but not yet stepped: GRBL's segment buffer holds up to 6 x 10 ms.
  double hidden_s = 0.1;
  // A line that grew on its way is mostly noticed when it has run on for so long.
  double unseen_s = 0.1;
  std::size_t planner_blocks = 15;
  double tolerance_mm = 0.05;  // of a reported position to the path
};

class MotionQueue {
 public:
  explicit MotionQueue(const MotionQueueLimits& limits) : limits_(limits) {}

  // The machine stands here, nothing is queued.
  void start_at(WirePoint at);
  bool fits(const GcodeLine& line) const;
  void sent(const GcodeLine& line, TimePoint now);
  // The oldest unanswered motion was accepted into the planner.
  void acknowledged(TimePoint now);
  // `now` is when the report was heard. False when the place is on no motion that can be under way. Nothing is
  // concluded then.
  bool reported(double x_mm, double y_mm, TimePoint now);
  // By how much a machine that was still here when it was asked at `asked` is late at least; <= 0 when it keeps its
  // pace or stands where all that was accepted ends. Delays of the link make this smaller, never larger.
  double late_s(double x_mm, double y_mm, TimePoint asked) const;
  // It stood still until now: its pace counts from here.
  void went_on(TimePoint now) { front_since_ = now; }
  // The machine stands still and every line was answered.
  void all_executed();
  // May the beam have been on between the place reported last and this one? False only when every motion that may have
  // run since was dark.
  bool may_have_burnt(double x_mm, double y_mm) const;

  // From now on motion runs at this fraction of its programmed speed, by an override; at most 1 is counted on.
  void set_slowest(double fraction, TimePoint now);
  double queued_s() const { return queued_s_ / slowest_; }
  // Of the strokes that are sent and not surely executed: the first and the last.
  std::optional<std::pair<std::size_t, std::size_t>> strokes_in_flight() const;
  WirePoint end() const { return end_; }  // where the last motion sent leads to
  bool empty() const { return moves_.empty(); }
  // Strokes executed since the last call, in order.
  std::vector<std::size_t> take_executed();

 private:
  struct Move {
    WirePoint from, to;
    std::optional<ArcShape> arc;
    double longest_s = 0;
    std::optional<std::size_t> ends_stroke;
    bool released = false;  // no longer counted in queued_s_
    bool burns = false;
    std::size_t stroke = 0;  // of one that burns
    TimePoint sent{}, accepted{};
  };
  bool lies_on(const Move& move, double x_mm, double y_mm) const;
  double late_in_accepted_s(double x_mm, double y_mm, TimePoint asked) const;
  double longest_s(std::size_t count) const;  // of so many motions, from the front
  void release(Move& move);
  void pop_front();

  MotionQueueLimits limits_;
  std::deque<Move> moves_;        // sent, not surely executed
  std::size_t acknowledged_ = 0;  // how many of moves_, from the front
  double queued_s_ = 0;
  double slowest_ = 1;
  TimePoint front_since_{};  // the machine was in the front motion, at the latest
  WirePoint begin_, end_;
  std::vector<std::size_t> executed_;
};

}  // namespace veneer::grbl
