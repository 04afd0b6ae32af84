#include "daemon/unit/job_progress.h"

namespace veneer::daemon {

void JobProgress::refresh(std::function<void()> then) {
  if (!view_.job) return then();
  host_.parts().database.async([job = view_.job->id](Repositories& r) { return r.jobs.find(job); },
                               host_.while_current([this, then = std::move(then)](const Result<db::JobRecord>& record) {
                                 if (record && view_.job) {
                                   JobView& job = *view_.job;
                                   view_.rest = rest_of(*record);
                                   job.pieces = view_.rest->pieces;
                                   job.cut = view_.rest->cut;
                                   job.suspect = view_.rest->suspect;
                                   job.current_piece.clear();
                                   job.eta_seconds = 0;
                                 }
                                 then();
                               }));
}

void JobProgress::refresh_rest(JobId job) {
  host_.parts().database.async([job](Repositories& r) { return r.jobs.find(job); },
                               [this, alive = std::weak_ptr<int>(alive_)](const Result<db::JobRecord>& record) {
                                 if (alive.expired() || !record) return;
                                 view_.rest = rest_of(*record);
                                 on_change_();
                               });
}

void JobProgress::show_piece(JobId job, const std::string& mark, double eta_seconds) {
  if (!view_.job || view_.job->id != job) return;
  view_.job->current_piece = mark;
  view_.job->eta_seconds = eta_seconds;
  on_change_();
}

}  // namespace veneer::daemon
