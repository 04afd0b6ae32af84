#include "db/job_store.h"

#include <gmock/gmock.h>

#include "db/audit.h"
#include "tests/db/planned_job.h"

namespace veneer::db {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class JobRunsTest : public PlannedJob {};

TEST_F(JobRunsTest, RunsPanelAfterPanelUntilComplete) {
  const RunId first = start(panel);
  EXPECT_EQ(state(), JobState::kRunning);
  for (const int i : {0, 1, 2}) cut(i);
  VENEER_ASSERT_OK(jobs.finish_run(first, true, kLater));
  EXPECT_EQ(state(), JobState::kRunning);
  const RunId second = start(other);
  cut(3);
  VENEER_ASSERT_OK(jobs.finish_run(second, true, kLater));
  EXPECT_EQ(state(), JobState::kComplete);
  EXPECT_THAT(states(), ElementsAre(PieceState::kCut, PieceState::kCut, PieceState::kCut, PieceState::kCut,
                                    PieceState::kUnfilled));
  const auto runs = must(jobs.runs(job));
  ASSERT_EQ(runs.size(), 2U);
  EXPECT_EQ(runs[0].panel, panel);
  EXPECT_EQ(runs[0].result, "done");
  EXPECT_EQ(runs[0].ended_at, kLater);
  EXPECT_DOUBLE_EQ(runs[0].bed_from_panel.angle().count(), kPose.angle().count());
  EXPECT_EQ(runs[0].bed_from_panel.handedness(), Handedness::kImproper);
  EXPECT_EQ(runs[0].pose_rms, 0.04_mm);
}

TEST_F(JobRunsTest, StopsAfterThisPieceAndGoesOnLater) {
  const RunId run = start(panel);
  cut(0);
  VENEER_ASSERT_OK(jobs.finish_run(run, false, kLater));
  EXPECT_EQ(state(), JobState::kStopped);
  EXPECT_EQ(must(jobs.runs(job))[0].result, "stopped");
  start(panel);
  EXPECT_EQ(state(), JobState::kRunning);
  EXPECT_FALSE(jobs.mark_cutting(pieces[0].id, kLater).ok()) << "a piece is cut once";
}

TEST_F(JobRunsTest, AnAbortMakesTheCuttingPieceSuspect) {
  const RunId run = start(panel);
  cut(0);
  VENEER_ASSERT_OK(jobs.mark_cutting(pieces[1].id, kNow));
  VENEER_ASSERT_OK(jobs.abort_run(run, {}, "the laser stopped answering", kLater));
  EXPECT_EQ(state(), JobState::kAborted);
  EXPECT_THAT(states(), ElementsAre(PieceState::kCut, PieceState::kSuspect, PieceState::kReserved,
                                    PieceState::kReserved, PieceState::kUnfilled));
  EXPECT_EQ(must(jobs.runs(job))[0].result, "the laser stopped answering");
}

TEST_F(JobRunsTest, AnAbortNamesSuspectsButNeverTakesBackWhatWasBooked) {
  const RunId run = start(panel);
  cut(0);
  VENEER_ASSERT_OK(jobs.mark_cutting(pieces[1].id, kNow));
  const std::vector<PieceId> suspects = {pieces[0].id, pieces[1].id, pieces[2].id};
  VENEER_ASSERT_OK(jobs.abort_run(run, suspects, "position lost", kLater));
  EXPECT_THAT(states(), ElementsAre(PieceState::kCut, PieceState::kSuspect, PieceState::kSuspect, PieceState::kReserved,
                                    PieceState::kUnfilled));
}

TEST_F(JobRunsTest, AnAbortWithAForeignPieceChangesNothing) {
  const JobId second = must(jobs.create(job_of({square_piece("B1", panel, 200, 10, 14)}), kNow));
  const RunId run = start(panel);
  VENEER_ASSERT_OK(jobs.mark_cutting(pieces[0].id, kNow));
  const std::vector<PieceId> suspects = {must(jobs.pieces(second))[0].id};
  EXPECT_FALSE(jobs.abort_run(run, suspects, "?", kLater).ok());
  EXPECT_EQ(state(), JobState::kRunning);
  EXPECT_EQ(states()[0], PieceState::kCutting);
}

TEST_F(JobRunsTest, AnAbortMakesNeighboursSuspectWhoseverTheyAre) {
  const JobId second = must(jobs.create(job_of({square_piece("B1", panel, 200, 10, 14)}), kNow));
  const PieceId foreign = must(jobs.pieces(second))[0].id;
  const RunId run = start(panel);
  cut(0);
  VENEER_ASSERT_OK(jobs.mark_cutting(pieces[1].id, kNow));
  const std::vector<PieceId> neighbours = {pieces[0].id, pieces[2].id, foreign};
  VENEER_ASSERT_OK(jobs.abort_run(run, {}, "off its path", kLater, neighbours));
  EXPECT_THAT(states(), ElementsAre(PieceState::kSuspect, PieceState::kSuspect, PieceState::kSuspect,
                                    PieceState::kReserved, PieceState::kUnfilled));
  EXPECT_EQ(must(jobs.pieces(second))[0].state, PieceState::kSuspect);
  EXPECT_EQ(must(jobs.find(second)).state, JobState::kPlanned);
  // A person looks, and the other job goes on with what is left of it.
  VENEER_EXPECT_OK(jobs.settle(foreign, AllocationState::kReleased, kLater, "user anna"));
  VENEER_EXPECT_OK(jobs.cancel(second, kLater));
}

TEST_F(JobRunsTest, APieceOfACompleteJobCanBecomeSuspectAndBeSettled) {
  const JobId second = must(jobs.create(job_of({square_piece("B1", panel, 200, 10, 14)}), kNow));
  const PieceId done = must(jobs.pieces(second))[0].id;
  const RunId first_run = must(jobs.start_run(second, panel, kPose, 0.04_mm, kNow));
  VENEER_ASSERT_OK(jobs.mark_cutting(done, kNow));
  VENEER_ASSERT_OK(jobs.book_piece(done, kNow));
  VENEER_ASSERT_OK(jobs.finish_run(first_run, false, kNow));
  ASSERT_EQ(must(jobs.find(second)).state, JobState::kComplete);
  const RunId run = start(panel);
  const std::vector<PieceId> neighbours = {done};
  VENEER_ASSERT_OK(jobs.abort_run(run, {}, "off its path", kLater, neighbours));
  EXPECT_EQ(must(jobs.pieces(second))[0].state, PieceState::kSuspect);
  VENEER_EXPECT_OK(jobs.settle(done, AllocationState::kScrap, kLater, "user anna"));
  EXPECT_EQ(must(jobs.find(second)).state, JobState::kComplete);
}

TEST_F(JobRunsTest, TheRemainingPiecesRunAfterAnAbort) {
  const RunId run = start(panel);
  cut(0);
  VENEER_ASSERT_OK(jobs.mark_cutting(pieces[1].id, kNow));
  VENEER_ASSERT_OK(jobs.abort_run(run, {}, "power", kLater));
  const RunId again = start(panel);
  cut(2);
  VENEER_ASSERT_OK(jobs.finish_run(again, true, kLater));
  cut_on_other();
  // The suspect piece still waits for an operator's eye.
  EXPECT_EQ(state(), JobState::kStopped);
  VENEER_ASSERT_OK(jobs.settle(pieces[1].id, AllocationState::kScrap, kLater, "user anna"));
  EXPECT_EQ(state(), JobState::kComplete);
}

// Together with the run itself, so that the log lacks none after a power cut.
TEST_F(JobRunsTest, RunsAndRecoveriesAreInTheAuditLog) {
  const RunFacts facts{"uid 1000", {}, "[]"};
  const RunId run = must(jobs.start_run(job, panel, kPose, 0.04_mm, kNow, facts));
  VENEER_ASSERT_OK(jobs.abort_run(run, {}, "the lid was opened", kLater));
  start(other);
  VENEER_ASSERT_OK(jobs.mark_cutting(pieces[3].id, kNow));
  must(jobs.recover(kLater));
  must(jobs.recover(kLater));  // nothing to do, nothing to tell
  std::vector<std::string> told;
  for (const auto& row : must(Audit(cell.database()).latest(10)))
    told.push_back(row.who + ": " + row.what + " " + row.detail);
  EXPECT_THAT(told, ElementsAre("veneerd: cell.recover job 1 aborted, piece 4 suspect",
                                "veneerd: run.end run 2 of job 1 on P-0002, the daemon ended in the middle of it",
                                "veneerd: run.start run 2 of job 1 on P-0002",
                                "veneerd: run.end run 1 of job 1 on P-0001, the lid was opened",
                                "uid 1000: run.start run 1 of job 1 on P-0001"));
}

TEST_F(JobRunsTest, OneRunAtATime) {
  const JobId second = must(jobs.create(job_of({square_piece("B1", panel, 200, 10, 14)}), kNow));
  const RunId run = start(panel);
  const auto refused = jobs.start_run(second, panel, kPose, 0.04_mm, kNow);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kConflict);
  EXPECT_EQ(must(jobs.find(second)).state, JobState::kPlanned);
  EXPECT_FALSE(jobs.cancel(job, kNow).ok());
  EXPECT_FALSE(jobs.abort_job(job, kNow).ok());
  VENEER_EXPECT_OK(jobs.abort_run(run, {}, "stop", kLater));
  EXPECT_FALSE(jobs.abort_run(run, {}, "stop", kLater).ok()) << "a run ends once";
}

TEST_F(JobRunsTest, ARunNeedsSomethingToCutOnItsPanel) {
  const RunId run = start(panel);
  for (const int i : {0, 1, 2}) cut(i);
  VENEER_ASSERT_OK(jobs.finish_run(run, false, kLater));
  const auto again = jobs.start_run(job, panel, kPose, 0.04_mm, kLater);
  ASSERT_FALSE(again.ok());
  EXPECT_THAT(again.error().message, HasSubstr("nothing left to cut on panel P-0001"));
  EXPECT_EQ(state(), JobState::kStopped);
}

TEST_F(JobRunsTest, ARunCannotFinishWhileAPieceIsBeingCut) {
  const RunId run = start(panel);
  VENEER_ASSERT_OK(jobs.mark_cutting(pieces[0].id, kNow));
  const Status early = jobs.finish_run(run, false, kLater);
  ASSERT_FALSE(early.ok());
  EXPECT_THAT(early.error().message, HasSubstr("while a piece is being cut"));
  EXPECT_EQ(state(), JobState::kRunning);
  EXPECT_FALSE(must(jobs.runs(job))[0].ended_at.has_value());
}

// Its piece is to be settled; what was complete does not begin again by a Stop that comes late.
TEST_F(JobRunsTest, AJobThatWasCompleteAndHasAPieceInDoubtWaitsForNoPanel) {
  cut_on_other();
  const RunId run = start(panel);
  for (const int i : {0, 1, 2}) cut(i);
  VENEER_ASSERT_OK(jobs.finish_run(run, true, kLater));
  VENEER_ASSERT_OK(jobs.make_suspect(std::vector{pieces[0].id}, kLater));
  for (const Status& refused : {jobs.stop_job(job, kLater), jobs.abort_job(job, kLater)}) {
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::kConflict);
  }
  EXPECT_EQ(state(), JobState::kStopped);
}

TEST_F(JobRunsTest, AJobThatWaitsForAPanelCanBeStoppedOrAborted) {
  const RunId run = start(panel);
  for (const int i : {0, 1, 2}) cut(i);
  VENEER_ASSERT_OK(jobs.finish_run(run, true, kLater));
  VENEER_ASSERT_OK(jobs.stop_job(job, kLater));
  EXPECT_EQ(state(), JobState::kStopped);
  EXPECT_FALSE(jobs.abort_job(job, kLater).ok());
}

TEST_F(JobRunsTest, ARunEndsWithWhatIsInDoubtOfIt) {
  const RunId run = start(panel);
  for (const int i : {0, 1, 2}) cut(i);
  const std::vector doubted{pieces[1].id};
  VENEER_ASSERT_OK(jobs.finish_run(run, false, kLater, {doubted}));
  EXPECT_EQ(must(jobs.find_piece(pieces[1].id)).state, PieceState::kSuspect);
  EXPECT_EQ(must(jobs.find_piece(pieces[2].id)).state, PieceState::kCut);
  EXPECT_EQ(state(), JobState::kStopped);
  EXPECT_FALSE(jobs.finish_run(run, false, kLater, {std::vector{pieces[2].id}}).ok()) << "it is over";
  EXPECT_EQ(must(jobs.find_piece(pieces[2].id)).state, PieceState::kCut) << "all of it, or nothing";
}

TEST_F(JobRunsTest, RecoveryMakesCuttingPiecesSuspectAndAbortsTheJob) {
  start(panel);
  cut(0);
  VENEER_ASSERT_OK(jobs.mark_cutting(pieces[1].id, kNow));
  cell.reopen();
  const Recovery found = must(jobs.recover(kLater));
  EXPECT_THAT(found.suspects, ElementsAre(pieces[1].id));
  EXPECT_THAT(found.aborted_jobs, ElementsAre(job));
  EXPECT_EQ(state(), JobState::kAborted);
  EXPECT_TRUE(must(jobs.runs(job))[0].ended_at.has_value());
  const Recovery again = must(jobs.recover(kLater));
  EXPECT_THAT(again.suspects, IsEmpty());
  EXPECT_THAT(again.aborted_jobs, IsEmpty());
}

TEST_F(JobRunsTest, RecoveryCompletesAJobWhoseLastPieceWasBooked) {
  const RunId run = start(panel);
  for (const int i : {0, 1, 2}) cut(i);
  VENEER_ASSERT_OK(jobs.finish_run(run, true, kLater));
  start(other);
  cut(3);
  cell.reopen();
  EXPECT_THAT(must(jobs.recover(kLater)).completed_jobs, ElementsAre(job));
  EXPECT_EQ(state(), JobState::kComplete);
}

TEST_F(JobRunsTest, RecoveryLeavesAQuietDatabaseAlone) {
  const Recovery found = must(jobs.recover(kLater));
  EXPECT_THAT(found.suspects, IsEmpty());
  EXPECT_EQ(state(), JobState::kPlanned);
}

}  // namespace
}  // namespace veneer::db
