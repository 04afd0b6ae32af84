#include "drivers/grbl/stray_path.h"

#include <algorithm>
#include <cmath>

namespace veneer::grbl {

void StrayPath::add_to(laser_event::Aborted& aborted, const JobRun& run, const MachineSettings& settings,
                       Millimetres tolerance, TimePoint now) const {
  if (slipped_mm_) {
    aborted.stray_path = run.path_under_way();
    aborted.stray_reach = Millimetres(*slipped_mm_);
    return;
  }
  const double fastest =
      at_any_speed_ ? std::hypot(settings.x.max_rate_mm_s, settings.y.max_rate_mm_s) : run.fastest_under_way().count();
  const auto seconds = [](Duration d) { return std::chrono::duration<double>(d).count(); };
  double reach = 0;
  const Place* before = nullptr;
  const auto add = [&](const Place& place) {
    aborted.stray_path.push_back(settings.from_wire(place.at[0], place.at[1]));
    if (before != nullptr) reach = std::max(reach, fastest * seconds(place.heard - before->heard) / 2);
    before = &place;
  };
  if (late_) {
    for (const Place& place : on_path_) {
      // It went from the one place to the other, and no farther aside than the time allowed.
      if (before != nullptr) {
        const double way = place.fastest_mm_s * seconds(place.heard - before->heard);
        const double apart = std::hypot(place.at[0] - before->at[0], place.at[1] - before->at[1]);
        reach = std::max(reach, std::sqrt(std::max(0.0, way * way - apart * apart)) / 2);
      }
      aborted.stray_path.push_back(settings.from_wire(place.at[0], place.at[1]));
      before = &place;
    }
  } else {
    add(on_path_.back());
  }
  for (const Place& place : off_path_) add(place);
  if (aborted.position_lost) reach = std::max(reach, fastest * seconds(now - before->heard));
  aborted.stray_reach = Millimetres(reach) + tolerance;
}

}  // namespace veneer::grbl
