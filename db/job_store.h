// Jobs, their pieces and their runs. A job is made of a plan: each of its pieces is one patch of it, and is where the
// plan placed that patch. A piece has no state of its own: it is the state of its allocation in the ledger,
// so the two cannot disagree. Whatever moves pieces moves the job in the same transaction.
//
// Jobs:  planned -> running | cancelled            running -> complete | aborted | stopped
//        aborted, stopped -> running | cancelled | complete (the last suspect piece was settled)
//        complete, cancelled -> stopped (lost pieces are to be made again)
//        complete -> stopped (a piece became suspect, also one that was called lost by mistake)
//
// Bound to the thread of the Database it is given, which must outlive it.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/frames.h"
#include "base/ids.h"
#include "base/polygon_ops.h"
#include "base/result.h"
#include "db/database.h"
#include "db/ledger.h"
#include "db/plans.h"
#include "db/request_keys.h"

namespace veneer::db {

using RunId = NumericId<struct RunIdTag>;

enum class JobState {
  kPlanned,    // its wood is reserved; nothing was cut
  kRunning,    // a run is on
  kStopped,    // an operator ended it between two pieces; the remaining pieces can be run
  kAborted,    // it was broken off; the remaining pieces can be run
  kComplete,   // no piece is left to cut; JobRecord::missing() of them may be lost
  kCancelled,  // given up; wood not cut was released
};
const char* to_string(JobState state);

enum class PieceState { kUnfilled, kReserved, kCutting, kCut, kSuspect, kScrap, kReleased };
const char* to_string(PieceState state);

// What a scan saw of a suspect piece's wood: a proposal, until a person settles what became of the piece.
enum class Seen { kCut, kStillThere, kUnclear };  // its wood is gone, is in the panel, or is gone in part
const char* to_string(Seen seen);
struct Sighting {
  Seen seen = Seen::kUnclear;
  double gone = 0;       // share of the piece's inside, 0 to 1
  int mask_version = 0;  // of its panel, that the scan entered
  std::string at;
};

// Somebody has laid a piece at its place in the picture.
struct Assembled {
  std::string who, at;
};

struct PieceRecord {
  PieceId id;  // global, for ever
  JobId job;
  std::string mark;  // of its patch
  Ring<ArtworkFrame> artwork_outline;
  // Where it is placed; empty when it is unfilled.
  std::optional<PanelId> panel;
  Ring<PanelFrame> panel_outline;
  Isometry2<PanelFrame, ArtworkFrame> panel_from_artwork;
  std::optional<Point<PanelFrame>> lead_in;
  AllocationId allocation;  // of its wood; {0} when it is unfilled. Earlier ones are what it was lost from.
  PlanId placed_by;         // the plan that says so; {0} when it is unfilled
  PieceState state = PieceState::kUnfilled;
  std::optional<Sighting> sighting;    // of a suspect one, by the scan that counts, since it became so
  std::optional<Assembled> assembled;  // of a cut one
};

struct JobRecord {
  JobId id;
  std::string name;
  PlanId plan;
  JobState state = JobState::kPlanned;
  std::string created_at;
  std::string target_file, options_json;  // of its plan
  PlanId newest;                          // by which pieces were made again last; else its plan
  std::string preview_file;               // of the newest
  std::map<PieceState, int> pieces;       // how many pieces are in each state; absent = 0
  bool archived = false;                  // out of sight
  int count(PieceState wanted) const;
  // Pieces without wood: lost, given back, or never placed. redo() gives them some.
  int missing() const;
};

// A job with something to do at its pieces.
struct JobWork {
  JobId id;
  std::string name;
  JobState state = JobState::kPlanned;
  int open = 0;  // reserved or being cut
  int suspect = 0;
};

// A job that can be completed only by other wood for its missing pieces.
struct JobLoss {
  JobId id;
  int missing = 0;
};

// What a person takes over of what scans saw of a job's suspect pieces.
struct AsSeen {
  // What the pieces are whose wood was seen in the panel, kScrap or kReleased; nullopt: those seen gone are cut.
  std::optional<AllocationState> there;
  // The marks that the person was shown; with `there` they are needed. nullopt: all that were seen gone.
  std::optional<std::vector<std::string>> pieces;
};

// What became of suspect pieces by what scans saw of them: marks, in the order of the plan.
struct SettledAsSeen {
  std::vector<std::string> cut;    // seen gone
  std::vector<std::string> there;  // seen in the panel, and settled as a person said of all such
  std::vector<std::string> left;   // still suspect
};

// One loading of one panel: from the proven pose to the end of the motion.
struct RunRecord {
  RunId id;
  JobId job;
  PanelId panel;
  Isometry2<BedFrame, PanelFrame> bed_from_panel;
  Millimetres pose_rms;
  std::string started_at;
  std::optional<std::string> ended_at;
  std::string result;  // empty while it lasts; "done", "stopped", or the sentence of what broke it off
};

// On what a run stood.
struct RunFacts {
  std::string who;                          // gave the word for it; empty: nobody noted it
  std::vector<CertificateId> certificates;  // that its strokes were drawn with
  std::string recipes_json = "[]";          // how each wood was burnt, and which pieces lie in it
  bool looks_again = false;                 // what it books is owed a look; on its beginning only
};

// What else ends with a run, in the same transaction.
struct RunEnd {
  std::span<const PieceId> doubted;  // are suspect, as make_suspect() says
  bool rests = false;                // so does the cell (note_at_rest)
  std::string who = {};              // stopped the job with it, as cancel() says
};

// What a run has booked since its panel was seen where it has to lie, in the order of burning.
struct UnprovenCuts {
  RunRecord run;
  std::vector<PieceId> pieces;
};

// A cut of the last run, as the laser burnt it, so that it can be met again.
struct KeptCut {
  PieceId piece;
  std::string mark;  // not on insertion
  RunId run;
  std::string laser;         // that burnt it, as it tells of itself
  std::string strokes_json;  // written and read by the daemon
};

// What became of a piece, in one row.
struct PieceOutcome {
  PieceId piece;
  std::string mark;
  JobId job;
  std::string job_name, job_made_at;
  std::optional<PanelId> panel;  // of its newest place; none without wood
  PieceState state = PieceState::kUnfilled;
  std::string since;                                     // of that state; "" without wood
  std::optional<RunId> run;                              // the last that had to do with this wood
  std::string run_started_at, run_ended_at, run_result;  // "" without a run, or before its end
  std::string who;                                       // gave the word for that run
};

// A state that a piece's wood entered. A piece that was made again has had several allocations.
struct PieceStep {
  AllocationId allocation;
  PanelId panel;
  AllocationState state = AllocationState::kReserved;
  std::string at;
  std::optional<RunId> run;  // that was on then, of its job on its panel
};

// What recover() found after a power cut or a crash; it is in the audit log too.
struct Recovery {
  std::vector<PieceId> suspects;      // were being cut
  std::vector<JobId> aborted_jobs;    // were running, pieces remain
  std::vector<JobId> completed_jobs;  // were running, and every piece had been booked
  std::optional<std::string> doing;   // was under way (note_under_way)
  // Why, when work was broken off, now or before, and nobody has cleared that yet.
  std::optional<std::string> clear_owed;
};

class JobStore {
 public:
  explicit JobStore(Database& database) : database_(&database) {}

  // Makes a job of the plan: its pieces and their wood enter in one transaction, or nothing does; what the plan leases
  // becomes the job's. kConflict names the piece and panel whose wood is taken, or the panel that was scanned again
  // since the plan was made. `request` is the request that asked for the job, begun before (db/request_keys.h): it gets
  // {"job":N} as its result in the same transaction, so that it can never make two. `who` made it, as cancel() says.
  Result<JobId> create(PlanId plan, const std::string& at, const std::optional<KeyedRequest>& request = {},
                       const std::string& who = {});
  // The same with a plan that is stored in the same transaction: when there is no job, there is no plan either. Whoever
  // asked for the plan made the job.
  Result<JobId> create(const NewPlan& plan, const std::string& at, const std::optional<KeyedRequest>& request = {});
  // Releases what is still reserved. kConflict while a run is on or when the job is already over. `who` asked for it,
  // as of all that takes one here: kept with the job's history, unless it is empty.
  Status cancel(JobId job, const std::string& at, const std::string& who = {});

  // A run begins: planned, stopped or aborted -> running. kConflict when a run is on, or the panel has no piece of it.
  // Its pose is proven; of one that looks again that is noted with it (note_proof).
  Result<RunId> start_run(JobId job, const PanelId& panel, const Isometry2<BedFrame, PanelFrame>& bed_from_panel,
                          Millimetres pose_rms, const std::string& at, const RunFacts& facts = {});
  // reserved -> cutting, before the first stroke that may cut the piece's wood is sent.
  Status mark_cutting(PieceId piece, const std::string& at);
  // cutting -> cut, on executed and verified motion.
  Status book_piece(PieceId piece, const std::string& at);
  // The same, and how it was cut is kept until the next run begins. kConflict too when another run was begun since.
  Status book_and_keep(const KeptCut& cut, const std::string& at);
  // The run ends as intended; nothing may be `cutting` (kConflict). The job becomes complete when nothing is left to
  // cut or to settle, stays running when pieces are left and another panel is to be loaded (`more`), else is stopped.
  Status finish_run(RunId run, bool more, const std::string& at, const RunEnd& end = {});
  // The run is broken off: whatever was `cutting` is suspect, as are `suspects` (pieces already booked stay cut), and
  // the job is aborted. `neighbours` are pieces, of any job, that the beam may have hit besides: those reserved or cut
  // are suspect as well. `reason` is one sentence. `who` broke it off, as cancel() says.
  Status abort_run(RunId run, std::span<const PieceId> suspects, const std::string& reason, const std::string& at,
                   std::span<const PieceId> neighbours = {}, const std::string& who = {});
  // A beam strayed while nothing was cut for the first time, or nobody knows what it hit: `pieces`, of any job, that
  // are reserved or cut are suspect, and their jobs complete no longer.
  Status make_suspect(std::span<const PieceId> pieces, const std::string& at);
  // The panel of the run, which may be over, was seen where it has to lie.
  Status note_proof(RunId run, const std::string& at);
  // What of the last run is booked since it was noted last, and is `cut` on no person's word; nothing of a run of which
  // it never was, which does not look again.
  Result<std::optional<UnprovenCuts>> unproven();
  // A job that waits between two panels is broken off or stopped without a run. kConflict when it does not.
  Status abort_job(JobId job, const std::string& at, const std::string& who = {});
  Status stop_job(JobId job, const std::string& at, const std::string& who = {});
  // The cell rests from now on, or `doing` goes on, and the job is stopped if it waited; any other job stays as it is.
  Status stop_job_and_rest(JobId job, const std::string& at, const std::string& doing = "",
                           const std::string& who = {});
  // What a scan of a panel saw of its suspect wood. Wood that is not suspect any more is left out.
  Status note_sightings(std::span<const std::pair<AllocationId, Sighting>> seen);
  // An operator looked at a suspect piece: kCut, kScrap or kReleased (its wood is whole). Or he takes back that a piece
  // is scrap (kSuspect), as long as it has no other wood and its panel is in stock; that wood is whole he cannot take
  // back, for it may be somebody else's by now. The job follows.
  Status settle(PieceId piece, AllocationState verdict, const std::string& at, const std::string& who);
  // An operator takes over what scans saw of the job's suspect pieces. Those seen gone are cut. Of those seen in the
  // panel no scan sees whether a kerf was begun: he looks at each, names them, and says what they are; a piece that a
  // scan saw there meanwhile is not among them, and stays suspect. What a scan saw that was taken back since, or saw
  // unclearly, decides nothing. The job follows; the audit log names the pieces. kConflict, and nothing is settled,
  // when nothing can be decided, or when a named piece is not suspect or was not seen so by the scan that counts now.
  Result<SettledAsSeen> settle_as_seen(JobId job, const AsSeen& said, const std::string& who, const std::string& at);

  // A person ticked these pieces off as laid in the picture, or took the tick back: all of them, or none. One that is
  // so already stays as it was noted. kConflict: a piece is not cut. kNotFound: it is not the job's.
  Status assemble(JobId job, std::span<const std::string> marks, bool assembled, const std::string& who,
                  const std::string& at);

  // `plan` places pieces of the job anew: missing ones, and cut ones, which are lost then (scrap), as `plan.who` says.
  // Its wood is reserved for them, they keep their ids and marks, and a job that was over is stopped, with pieces to
  // cut. All of it happens, or nothing. kConflict: the job is running, a piece has wood that is not cut yet or is
  // suspect, wood is taken, or a panel was scanned again since. kNotFound, kInvalidArgument: a piece is not the job's.
  Result<PlanId> redo(JobId job, const NewPlan& plan, const std::string& at);

  // Out of sight, or back. kConflict unless it is complete or cancelled, with no suspect piece. It comes back by itself
  // when it goes on (redo), or when a piece of it becomes suspect.
  Status archive(JobId job, bool archived, const std::string& at, const std::string& who = {});
  // All of which nothing is left to do: complete with no piece missing, or cancelled, and none suspect. Gives those
  // that were in sight.
  Result<std::vector<JobId>> archive_done(const std::string& at, const std::string& who = {});

  // The queue: jobs in sight with pieces to cut that wait, as they stand; the one that is being cut does not. `job` is
  // put right before `other`, or behind all others. Gives the queue as it is now; where nothing changes, nothing is
  // noted. A new job stands last. One that is being cut, or has suspect pieces alone, keeps its place; one that was
  // over and is made again stands where the newest order names it, and behind all that it names where it does not.
  // kConflict: one of the two does not wait. kInvalidArgument: they are the same.
  Result<std::vector<JobId>> put_before(JobId job, std::optional<JobId> other, const std::string& who,
                                        const std::string& at);
  Result<std::vector<JobId>> queue();

  // Start-up, before anything else: pieces found cutting -> suspect, open runs end, running jobs -> aborted (or
  // complete), and what was so broken off, or was under way, is to be cleared, in one transaction.
  Result<Recovery> recover(const std::string& at);
  // Why the cell would be Aborted by recover(), or nothing; for another program that takes the database away.
  Result<std::optional<std::string>> would_owe_clear();
  // What the cell does from now on, before anything moves for it. `doing` goes on behind "the program ended", as in
  // "while the laser was homed". What was under way before is so no longer.
  Status note_under_way(const std::string& doing, const std::string& at);
  // The cell rests again. Nothing is changed where nothing was under way.
  Status note_at_rest(const std::string& at);
  // The cell's work was broken off, for `reason`, and is under way no longer; a person cleared it. That is kept over
  // starts of the program (recover). Where there is nothing to clear a Clear changes nothing. `who` broke it off; "":
  // the program did.
  Status note_abort(const std::string& reason, const std::string& at, const std::string& who = {});
  Status note_cleared(const std::string& who, const std::string& at);

  Result<JobRecord> find(JobId job);      // kNotFound
  Result<std::vector<JobRecord>> list();  // in order of id
  // At most `limit` of them, behind `after`; `archived`: those too.
  Result<std::vector<JobRecord>> list(JobId after, int limit, bool archived = true);
  // Those in sight with pieces that are reserved, being cut or suspect, in the order in which they are to be cut. Of an
  // index alone, however many pieces there are.
  Result<std::vector<JobWork>> with_work();
  // Those in sight of which pieces are missing and none is left to cut or to settle, in order of id: aborted, stopped,
  // and complete ones of which wood was lost (not those that never found all). Cheap, too.
  Result<std::vector<JobLoss>> with_loss();
  Result<std::string> plan_json(JobId job);            // the newest: JobRecord::newest
  Result<std::vector<PieceRecord>> pieces(JobId job);  // in the order of the plan
  // At most `limit` of them by id, behind `after`.
  Result<std::vector<PieceRecord>> pieces(JobId job, PieceId after, int limit);
  // Of all jobs, those behind `after` in the order of their numbers.
  Result<std::vector<PieceOutcome>> outcomes(PieceId after, int limit);
  Result<PieceRecord> find_piece(PieceId piece);  // kNotFound
  Result<PieceRecord> find_piece(JobId job, const std::string& mark);
  // What became of its wood, the oldest first. Of wood booked before schema 11 the last step alone.
  Result<std::vector<PieceStep>> history(PieceId piece);
  Result<std::vector<RunRecord>> runs(JobId job);
  Result<std::optional<RunRecord>> last_run();  // of any job; nothing before the first
  Result<RunFacts> facts(RunId run);            // empty when nobody noted them
  // All of the last run, in the order of burning; none once they were forgotten.
  Result<std::vector<KeptCut>> kept_cuts();
  // They cannot be met again: the panel was moved, or another laser is there.
  Status forget_cuts();
  Result<std::vector<PlanId>> redos(JobId job);  // by which its pieces were made again, in their order

 private:
  Database* database_;
};

}  // namespace veneer::db
