#include "drivers/grbl/stray_path.h"

#include <algorithm>

namespace veneer::grbl {

void StrayPath::add_to(laser_event::Aborted& aborted, const JobRun& run, const MachineSettings& settings,
                       Millimetres tolerance, TimePoint now) const {
  if (slipped_mm_) {
    aborted.stray_path = run.path_under_way();
    aborted.stray_reach = Millimetres(*slipped_mm_);
    return;
  }
  const double fastest = run.fastest_under_way().count();
  const auto seconds = [](Duration d) { return std::chrono::duration<double>(d).count(); };
  double reach = 0;
  const Place* before = nullptr;
  const auto add = [&](const Place& place) {
    aborted.stray_path.push_back(settings.from_wire(place.at[0], place.at[1]));
    if (before != nullptr) reach = std::max(reach, fastest * seconds(place.heard - before->heard) / 2);
    before = &place;
  };
  add(on_path_);
  for (const Place& place : off_path_) add(place);
  if (aborted.position_lost) reach = std::max(reach, fastest * seconds(now - before->heard));
  aborted.stray_reach = Millimetres(reach) + tolerance;
}

}  // namespace veneer::grbl
