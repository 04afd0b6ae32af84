#include "daemon/unit/recut_memory.h"

#include <fmt/format.h>

namespace veneer::daemon {

Result<std::vector<PieceBurn>> RecutMemory::find(const std::vector<std::string>& marks) const {
  if (cuts_.empty())
    return Error{ErrorCode::kConflict,
                 "nothing can be cut again but pieces of the panel that was cut last, while it lies as it did: make "
                 "others again with `veneerctl job redo`"};
  std::vector<PieceBurn> found;
  for (const std::string& mark : marks) {
    const PieceBurn* cut = cuts_.find(mark);
    if (cut == nullptr)
      return Error{ErrorCode::kNotFound,
                   fmt::format("piece {} was not cut from panel {} as it lies now", mark, cuts_.pose().panel.value)};
    found.push_back(*cut);
  }
  if (found.empty()) return Error{ErrorCode::kInvalidArgument, "name the pieces that are not through"};
  return found;
}

void RecutMemory::recall() {
  database_.async([](Repositories& r) { return KeptCuts::read(r); },
                  [this, alive = std::weak_ptr<int>(alive_)](Result<KeptCuts> known) {
                    if (alive.expired()) return;
                    if (!known) return log_->warn("{}", known.error().message);
                    if (cuts_.begun() || known->empty()) return;
                    cuts_ = std::move(*known);
                    if (another_laser()) return forget();
                    show();
                    on_change_();
                  });
}

bool RecutMemory::another_laser() const {
  const LaserLimits* laser = laser_();
  return laser != nullptr && cuts_.basis().laser != laser->identity;
}

void RecutMemory::laser_connected() {
  if (!cuts_.empty() && another_laser()) forget();
}

void RecutMemory::show() {
  count();
  if (cuts_.empty()) return;
  view_.recut_panel = cuts_.pose().panel;
  view_.recut_job = cuts_.basis().job;
}

void RecutMemory::forget() {
  database_.async([](Repositories& r) { return r.jobs.forget_cuts(); },
                  [log = log_](const Status& forgotten) {
                    if (!forgotten) log->debug("{}", forgotten.error().message);
                  });
  cuts_.forget();
  view_.can_recut = 0;
  view_.recut_panel = {};
  view_.recut_job = {};
}

}  // namespace veneer::daemon
