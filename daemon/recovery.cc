#include "daemon/recovery.h"

#include <fmt/format.h>

#include <chrono>
#include <utility>

#include "base/clock.h"
#include "daemon/plans/lease_clerk.h"

namespace veneer::daemon {

Result<Recovered> recover(Repositories& r) {
  constexpr std::chrono::hours kKeysLife{30 * 24};
  auto recovery = r.jobs.recover(utc_timestamp());
  if (!recovery) return recovery.error();
  if (auto pruned = r.request_keys.prune(utc_timestamp(-std::chrono::seconds(kKeysLife))); !pruned)
    return pruned.error();
  auto leases = expire_leases(r);
  if (!leases) return leases.error();
  Recovered out{std::move(*recovery), {}, std::move(leases->sentences)};
  for (const JobId job : out.found.completed_jobs)
    out.sentences.push_back(fmt::format(
        "job {} was running when this program ended last; every piece was booked by then, and it is complete",
        job.value));
  for (const JobId job : out.found.aborted_jobs)
    out.sentences.push_back(fmt::format(
        "job {0} was running when this program ended last and is aborted; veneerctl job start {0} goes on with it",
        job.value));
  for (const PieceId id : out.found.suspects) {
    const auto piece = r.jobs.find_piece(id);
    if (!piece) return piece.error();
    out.sentences.push_back(fmt::format(
        "piece {0} of job {1} on panel {2} was being cut and is suspect: look at it, then veneerctl job settle {1} {0}",
        piece->mark, piece->job.value, piece->panel.value_or(PanelId{"?"}).value));
  }
  return out;
}

void begin_after(JobRunner& runner, const Recovered& recovered, const Logger& log) {
  for (const std::string& sentence : recovered.sentences) log->warn("{}", sentence);
  for (const std::string& sentence : recovered.ended_leases) log->info("{}", sentence);
  runner.begin(recovered.found);
}

}  // namespace veneer::daemon
