// From a picture to a job: free wood of the chosen panels, a plan, its preview, and the reservation of all its wood in
// one transaction. The picture is looked at, and the plan made, by a worker process (daemon/orders/plan_work.h).
//
// Threading: all of it blocks and, but for sketch(), sketch_grid() and sketch_mosaic(), is called on the planner's
// worker only. What it reads of the database it reads itself; the thread that writes is asked for what is written
// alone.
#pragma once

#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "base/log.h"
#include "base/result.h"
#include "daemon/config.h"
#include "daemon/orders/advice_work.h"
#include "daemon/orders/grid_work.h"
#include "daemon/orders/plan_work.h"
#include "daemon/orders/sketch_work.h"
#include "daemon/plans/job_request.h"
#include "daemon/stock/panel_library.h"
#include "daemon/stock/scan_service.h"
#include "daemon/store/database_thread.h"
#include "daemon/workers/work_runner.h"
#include "db/plans.h"
#include "planner/edits/plan_edits.h"
#include "planner/plan.h"

namespace veneer::daemon {

struct JobOutcome {
  JobId job;        // {0} of a plan that no job was made of
  db::PlanId plan;  // {0} of a job: its record names it
  std::size_t pieces = 0;
  double cost_per_pixel = 0;
  std::vector<std::pair<PanelId, std::size_t>> panels;  // pieces from each
  std::size_t without_lead = 0;       // pieces whose cut begins on their own edge, for want of waste beside them
  std::vector<std::string> warnings;  // the planner's, one sentence each
  // What Optimize::kGlobal, fine_rotation and refine gained, of a job that asked for them.
  std::optional<planner::GlobalReport> global;
  std::optional<planner::FineReport> fine;
  std::optional<planner::RefineReport> refined;
  // Of pieces that are made again, and of the picture before them.
  std::vector<RedonePiece> redone;
  double cost_before = 0;
};

class PlanService {
 public:
  // All references outlive this.
  PlanService(DatabaseThread& database, const PanelLibrary& library, WorkRunner& workers, const Config& config,
              Logger log);

  // kRefused when the wood does not fill the picture: nothing is reserved then, and the sentence says which tones are
  // missing and which smaller patches would still fit. kCancelled once `stop` is requested, unless the wood is reserved
  // already. Otherwise as planner::make_plan says.
  Result<JobOutcome> make_job(const JobRequest& request, const std::string& who, const TaskProgress& progress,
                              const std::stop_token& stop);
  // The same without a job: the plan is stored, and no wood is reserved.
  Result<JobOutcome> make_plan(const JobRequest& request, const std::string& who, const TaskProgress& progress,
                               const std::stop_token& stop);
  // At which crop, size, patches and layout the picture reads in the free wood, at most as large as asked for; nothing
  // is stored.
  Result<AdviceGiven> advise(const JobRequest& request, const TaskProgress& progress, const std::stop_token& stop);
  // How the picture would about look in the free wood, drawn small and fast, in squares or (`fine`, as
  // planner::GridEffort::kFine) in the plan's own pieces; nothing is stored but what the next sketch needs of the wood.
  // On any thread but the reactor, with that thread's connection; kCancelled once `stop` is requested.
  Result<SketchDrawn> sketch(const JobRequest& request, bool fine, Repositories& repositories,
                             const std::stop_token& stop);
  // Where the lines of a morphed grid will be (`fine`: as planner::GridEffort::kFine), of the picture alone; nothing is
  // stored. On any thread but the reactor; kCancelled once `stop` is requested.
  Result<GridDrawn> sketch_grid(const JobRequest& request, bool fine, const std::stop_token& stop);
  // Likewise the cells of a mosaic.
  Result<MosaicDrawn> sketch_mosaic(const JobRequest& request, bool fine, const std::stop_token& stop);
  // The plan again with what is asked of it; `forbidden` and `name` are added to what it was asked for, if given. The
  // wood that the plan leases is free for the other, which gets it once that lease is released.
  // kNotFound: there is no such plan, or no such piece in it.
  struct Change {
    db::PlanId plan;
    std::string name;
    planner::PlanEdits edits;
    std::vector<planner::ForbiddenWood> forbidden;
    int threads = 0;
    std::optional<std::size_t> alternatives{};  // listed for each piece, at most; as the plan itself unless given
  };
  Result<JobOutcome> change_plan(const Change& change, const std::string& who, const TaskProgress& progress,
                                 const std::stop_token& stop);

  // Pieces of a job that are lost are looked for again in today's free wood, as the picture was when it was planned;
  // all others stay as they are. The wood is reserved for them, under their marks and ids (JobStore::redo).
  // kInvalidArgument: none is missing. kNotFound, kConflict: a piece cannot be made again, or is cut and not said to be
  // lost. Otherwise as make_job().
  struct Redo {
    JobId job;
    std::vector<std::string> pieces;  // marks. Empty: all that are missing
    int threads = 0;
    bool lost = false;  // those named that are cut are lost from then on; else they are good, and not made again
  };
  Result<JobOutcome> redo(const Redo& wanted, const std::string& who, const TaskProgress& progress,
                          const std::stop_token& stop);

 private:
  // An earlier plan, and what is asked of it.
  struct Earlier {
    db::PlanId plan;
    std::string plan_json;
    planner::PlanEdits edits;
    std::optional<JobId> made;  // the job whose pieces it places, when some of them are made again
  };
  struct ToRedo {
    db::JobRecord job;
    std::string plan_json;
    std::vector<std::string> marks;
  };
  Result<ToRedo> what_to_redo(const Redo& wanted);
  struct Made {
    db::NewPlan plan;
    JobOutcome outcome;
  };
  Result<Made> make(const JobRequest& request, const std::optional<Earlier>& earlier, const TaskProgress& progress,
                    const std::stop_token& stop);
  Result<JobOutcome> store(Made made, const std::string& who);

  DatabaseThread& database_;
  const PanelLibrary& library_;
  WorkRunner& workers_;
  const Config& config_;
  Logger log_;
};

}  // namespace veneer::daemon
