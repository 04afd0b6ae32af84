// Up to which piece of a run its panel was seen where it has to lie, what is owed a look, and what becomes of a job
// whose piece was missed.
#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>

#include "db/audit_chain.h"
#include "tests/db/old_rows.h"
#include "tests/db/planned_job.h"

namespace veneer::db {
namespace {

using ::testing::ElementsAre;

class Proofs : public PlannedJob {
 protected:
  RunId start_looking(const PanelId& on) {
    RunFacts facts;
    facts.looks_again = true;
    return must(jobs.start_run(job, on, kPose, 0.04_mm, kNow, facts));
  }
  std::vector<PieceId> owed() {
    const auto cuts = must(jobs.unproven());
    return cuts ? cuts->pieces : std::vector<PieceId>();
  }
  PieceId id(int index) const { return pieces.at(static_cast<std::size_t>(index)).id; }
};

// Killed before anything but the run's beginning and a booking reached the disk.
TEST_F(Proofs, ARunOwesALookFromItsFirstBookingOn) {
  start_looking(panel);
  EXPECT_THAT(owed(), ElementsAre());
  cut(0);
  EXPECT_THAT(owed(), ElementsAre(id(0)));
  must(jobs.recover(kLater));
  EXPECT_THAT(owed(), ElementsAre(id(0)));
}

TEST_F(Proofs, WhatWasBookedBeforeAProofIsNotOwed) {
  const RunId run = start_looking(panel);
  cut(0);
  VENEER_ASSERT_OK(jobs.note_proof(run, kNow));
  cut(1);
  EXPECT_THAT(owed(), ElementsAre(id(1)));
  VENEER_ASSERT_OK(jobs.finish_run(run, false, kLater));
  VENEER_ASSERT_OK(jobs.note_proof(run, kLater));
  EXPECT_THAT(owed(), ElementsAre());
}

TEST_F(Proofs, ARunThatDoesNotLookAgainOwesNothing) {
  start(panel);
  cut(0);
  EXPECT_THAT(owed(), ElementsAre());
}

TEST_F(Proofs, AProofOfAnotherRunSaysNothingOfThisOne) {
  const RunId first = start_looking(panel);
  cut(0);
  VENEER_ASSERT_OK(jobs.finish_run(first, true, kNow));
  start_looking(other);
  cut(3);
  VENEER_ASSERT_OK(jobs.note_proof(first, kLater));
  EXPECT_THAT(owed(), ElementsAre(id(3)));
  EXPECT_EQ(jobs.note_proof({99}, kLater).error().code, ErrorCode::kNotFound);
}

TEST_F(Proofs, WhatAPersonSaidIsNotOwed) {
  start_looking(panel);
  cut(0);
  cut(1);
  VENEER_ASSERT_OK(jobs.make_suspect(std::vector{id(0)}, kNow));
  EXPECT_THAT(owed(), ElementsAre(id(1)));
  VENEER_ASSERT_OK(jobs.settle(id(0), AllocationState::kCut, kNow, "user anna"));
  EXPECT_THAT(owed(), ElementsAre(id(1)));
}

TEST_F(Proofs, ACompleteJobIsStoppedWhenAPieceOfItBecomesSuspect) {
  const RunId run = start(panel);
  cut(0), cut(1), cut(2);
  VENEER_ASSERT_OK(jobs.finish_run(run, true, kLater));
  cut_on_other();
  ASSERT_EQ(state(), JobState::kComplete);
  VENEER_ASSERT_OK(jobs.make_suspect(std::vector{pieces[0].id, pieces[1].id}, kLater));
  EXPECT_EQ(state(), JobState::kStopped) << "somebody has to say what became of them";
  VENEER_ASSERT_OK(jobs.settle(pieces[0].id, AllocationState::kCut, kLater, "user anna"));
  EXPECT_EQ(state(), JobState::kStopped);
  VENEER_ASSERT_OK(jobs.settle(pieces[1].id, AllocationState::kScrap, kLater, "user anna"));
  EXPECT_EQ(state(), JobState::kComplete);
}

// By the beam of another job's run, which was broken off.
TEST_F(Proofs, SoIsANeighboursJob) {
  const RunId run = start(panel);
  cut(0), cut(1), cut(2);
  VENEER_ASSERT_OK(jobs.finish_run(run, true, kLater));
  cut_on_other();
  const JobId second = must(jobs.create(job_of({square_piece("B1", panel, 70, 10, 14)}), kNow));
  const RunId other_run = must(jobs.start_run(second, panel, kPose, 0.04_mm, kLater));
  VENEER_ASSERT_OK(jobs.abort_run(other_run, {}, "astray", kLater, std::vector{pieces[2].id}));
  EXPECT_EQ(state(), JobState::kStopped);
}

// The audit log alone told it before: two pieces are cut, and the panel is seen after so many of them.
class OldProofs : public ::testing::TestWithParam<std::size_t> {};

TEST_P(OldProofs, AreReadFromTheAuditLog) {
  const testing::TempDirectory directory;
  const auto file = directory / "veneerd.db";
  std::vector<PieceId> cut;
  {
    Database database = must(Database::open(file));
    Panels panels(database);
    const PanelId panel = must(panels.next_panel_id());
    VENEER_ASSERT_OK(panels.add(sheet(panel), {}, {}));
    JobStore jobs(database);
    const JobId job =
        must(jobs.create(job_of({square_piece("A1", panel, 10, 10, 14), square_piece("A2", panel, 30, 10, 14)}), kNow));
    RunFacts facts;
    facts.looks_again = true;
    const RunId run = must(jobs.start_run(job, panel, kPose, 0.04_mm, kNow, facts));
    for (const auto& piece : must(jobs.pieces(job))) {
      if (cut.size() == GetParam()) VENEER_ASSERT_OK(jobs.note_proof(run, kNow));
      VENEER_ASSERT_OK(jobs.mark_cutting(piece.id, kNow));
      VENEER_ASSERT_OK(jobs.book_piece(piece.id, kNow));
      cut.push_back(piece.id);
    }
    if (cut.size() == GetParam()) VENEER_ASSERT_OK(jobs.note_proof(run, kNow));
    VENEER_ASSERT_OK(jobs.abort_run(run, {}, "stop", kLater));
  }
  {
    SQLite::Database old(file.string(), SQLite::OPEN_READWRITE);
    register_functions(old);
    const std::string kept =
        old.execAndGet("SELECT sql FROM sqlite_master WHERE name = 'allocation_moves_are_kept'").getString();
    old.exec(
        "DROP VIEW artworks; DROP VIEW registrations; DROP VIEW events; DROP TRIGGER a_job_that_moves_is_noted; DROP "
        "TABLE done_by; DROP TABLE job_history; DROP INDEX allocation_history_by_time; DROP INDEX sightings_by_time; "
        "DROP INDEX assemblies_by_time; DROP INDEX runs_by_start; DROP INDEX runs_by_end; DROP INDEX runs_of_panel; "
        "DROP TABLE zone_confidences; DROP TABLE zone_versions; DROP TABLE asked_strips; DROP TABLE queue_orders; DROP "
        "TABLE verdicts; DROP TABLE proofs; DROP "
        "TABLE aborts; DROP TABLE activities; DROP INDEX allocations_lost; DROP INDEX scans_by_content; DROP TRIGGER "
        "only_a_piece_is_found_again; "
        "DROP TRIGGER allocation_moves_are_kept; PRAGMA user_version = 29; "
        "DELETE FROM allocation_moves WHERE from_state = 'scrap' AND to_state = 'suspect'");
    old.exec(kept);
    append_to_chain(old, {0, kLater, kDaemon, "run.proven", "run 9 of job 7 on P-0009, 3 pieces cut before"});
    append_to_chain(old, {0, kLater, kDaemon, "run.proven", "run 1 of job 1, as somebody wrote by hand"});
  }
  Database database = must(Database::open(file));
  VENEER_EXPECT_OK(database.check_integrity());
  const auto owed = must(JobStore(database).unproven());
  const std::vector<PieceId> since(cut.begin() + static_cast<std::ptrdiff_t>(GetParam()), cut.end());
  EXPECT_EQ(owed ? owed->pieces : std::vector<PieceId>(), since);
}

INSTANTIATE_TEST_SUITE_P(PiecesBefore, OldProofs, ::testing::Values(0U, 1U, 2U));

}  // namespace
}  // namespace veneer::db
