#include "daemon/plans/lease_clerk.h"

#include <fmt/format.h>

#include <chrono>

#include "base/clock.h"

namespace veneer::daemon {

Result<EndedLeases> expire_leases(Repositories& r) {
  const auto plans = r.leases.expire(utc_timestamp());
  if (!plans) return plans.error();
  EndedLeases out;
  for (const db::PlanId plan : *plans) {
    out.sentences.push_back(fmt::format("the lease of plan {} is over: its wood is free", plan.value));
    const auto record = r.plans.find(plan);
    if (!record) return record.error();
    for (const db::PlannedPanel& panel : record->panels) out.panels.push_back(panel.panel);
  }
  return out;
}

void LeaseClerk::changed(const std::vector<PanelId>& touched) {
  for (const PanelId& panel : touched) on_panel_(panel);
  database_.async([](Repositories& r) { return r.leases.next_end(); },
                  [this](const Result<std::string>& next) {
                    if (next) next_end_ = *next;
                  });
}

// The clock is asked again and again, because it may have been set meanwhile.
void LeaseClerk::end_due() {
  if (next_end_.empty() || utc_timestamp() < next_end_) return;
  next_end_ = utc_timestamp(std::chrono::minutes(1));  // until it is known better: if it fails, then again
  database_.async(expire_leases, [this](const Result<EndedLeases>& ended) {
    if (!ended) return log_->warn("leases that are over could not be ended: {}", ended.error().message);
    for (const std::string& sentence : ended->sentences) log_->info("{}", sentence);
    changed(ended->panels);
  });
}

}  // namespace veneer::daemon
