// What broke the cell's work off is kept until a person clears it; which jobs lost pieces; and suspect pieces that are
// settled by what scans saw of them.
#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>

#include "db/audit.h"
#include "db/later_scans.h"
#include "tests/db/planned_job.h"
#include "tests/db/stray_sql.h"

namespace veneer::db {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Optional;
using ::testing::UnorderedElementsAre;

class Aborts : public PlannedJob {
 protected:
  // Why Clear is owed, as the next start of the program finds it.
  std::optional<std::string> owed_at_start() {
    cell.reopen();
    return must(jobs.recover(kLater)).clear_owed;
  }
  PieceId id(int index) const { return pieces.at(static_cast<std::size_t>(index)).id; }
};

TEST_F(Aborts, WhatAStartFoundBrokenOffIsToBeClearedAtEachStartUntilSomebodyDoes) {
  EXPECT_EQ(owed_at_start(), std::nullopt);
  start(panel);
  cut(0);
  EXPECT_THAT(owed_at_start(), Optional(HasSubstr(fmt::format("in the middle of job {}", job.value))));
  EXPECT_THAT(owed_at_start(), Optional(HasSubstr("in the middle of job"))) << "it was not cleared";
  VENEER_ASSERT_OK(jobs.note_cleared("anna", kLater));
  EXPECT_EQ(owed_at_start(), std::nullopt);
}

TEST_F(Aborts, SoIsAStopWithoutAJob) {
  VENEER_ASSERT_OK(jobs.note_abort("STOP by anna", kNow));
  EXPECT_THAT(owed_at_start(), Optional(std::string("STOP by anna")));
  VENEER_ASSERT_OK(jobs.note_abort("the link was lost", kNow));
  EXPECT_THAT(owed_at_start(), Optional(std::string("the link was lost"))) << "the newest";
  VENEER_ASSERT_OK(jobs.note_cleared("anna", kLater));
  VENEER_ASSERT_OK(jobs.note_cleared("bert", kLater));
  EXPECT_EQ(owed_at_start(), std::nullopt);
}

// It was looking whether the panel lay as it had to, or had yet to tell that the job is cut.
TEST_F(Aborts, ARunWhoseLastPieceWasBookedIsBrokenOffToo) {
  const RunId run = start(panel);
  for (const int i : {0, 1, 2}) cut(i);
  VENEER_ASSERT_OK(jobs.finish_run(run, true, kLater));
  start(other);
  cut(3);
  EXPECT_THAT(owed_at_start(), Optional(HasSubstr(fmt::format("in the middle of job {}", job.value))));
  EXPECT_EQ(state(), JobState::kComplete);
}

// ---- what was under way ---------------------------------------------------------------------------------------------

TEST_F(Aborts, WhatWasUnderWayIsToBeClearedAndNamed) {
  VENEER_ASSERT_OK(jobs.note_under_way("while the laser was homed", kNow));
  EXPECT_THAT(must(jobs.would_owe_clear()), Optional(std::string("the program ended while the laser was homed")));
  EXPECT_THAT(owed_at_start(), Optional(std::string("the program ended while the laser was homed")));
  EXPECT_THAT(owed_at_start(), Optional(HasSubstr("homed"))) << "it was not cleared";
  VENEER_ASSERT_OK(jobs.note_cleared("anna", kLater));
  EXPECT_EQ(owed_at_start(), std::nullopt) << "it is told once";
  EXPECT_THAT(must(Audit(cell.database()).latest(1)).at(0).detail, "it ended while the laser was homed");
}

TEST_F(Aborts, TheNewestThatWasUnderWayCountsUntilTheCellRests) {
  VENEER_ASSERT_OK(jobs.note_at_rest(kNow));
  VENEER_ASSERT_OK(jobs.note_under_way("in the middle of job 1", kNow));
  VENEER_ASSERT_OK(jobs.note_under_way("while the head was jogged", kNow));
  EXPECT_THAT(must(jobs.would_owe_clear()), Optional(HasSubstr("jogged")));
  VENEER_ASSERT_OK(jobs.note_at_rest(kNow));
  VENEER_ASSERT_OK(jobs.note_at_rest(kNow));
  EXPECT_EQ(owed_at_start(), std::nullopt);
}

TEST_F(Aborts, WhatEndedWellWithWhatWasUnderWayIsNone) {
  VENEER_ASSERT_OK(jobs.note_under_way("in the middle of job 1", kNow));
  const RunId run = start(panel);
  for (const int i : {0, 1, 2}) cut(i);
  VENEER_ASSERT_OK(jobs.finish_run(run, true, kLater));
  EXPECT_THAT(must(jobs.would_owe_clear()), Optional(HasSubstr("in the middle of job"))) << "it waits for a panel";
  const RunId last = start(other);
  cut(3);
  VENEER_ASSERT_OK(jobs.finish_run(last, false, kLater, {{}, true}));
  EXPECT_EQ(owed_at_start(), std::nullopt);
  EXPECT_EQ(state(), JobState::kComplete);
}

TEST_F(Aborts, AJobThatIsStoppedWhileItWaitsEndsWithTheWorkForIt) {
  VENEER_ASSERT_OK(jobs.note_under_way("in the middle of job 1", kNow));
  VENEER_ASSERT_OK(jobs.stop_job_and_rest(job, kLater));
  EXPECT_EQ(state(), JobState::kPlanned) << "it never ran";
  EXPECT_EQ(must(jobs.would_owe_clear()), std::nullopt);
  VENEER_ASSERT_OK(jobs.note_under_way("in the middle of job 1", kNow));
  const RunId run = start(panel);
  cut(0);
  VENEER_ASSERT_OK(jobs.finish_run(run, true, kLater));
  VENEER_ASSERT_OK(jobs.stop_job_and_rest(job, kLater));
  EXPECT_EQ(state(), JobState::kStopped);
  EXPECT_EQ(owed_at_start(), std::nullopt);
}

// With the abort, in one transaction.
TEST_F(Aborts, AnAbortEndsWhatWasUnderWay) {
  VENEER_ASSERT_OK(jobs.note_under_way("while the head was jogged", kNow));
  VENEER_ASSERT_OK(jobs.note_abort("STOP by anna", kNow));
  EXPECT_THAT(owed_at_start(), Optional(std::string("STOP by anna")));
  VENEER_ASSERT_OK(jobs.note_cleared("anna", kLater));
  EXPECT_EQ(owed_at_start(), std::nullopt);
}

TEST_F(Aborts, WhatWasUnderWayIsNeitherChangedNorRemoved) {
  VENEER_ASSERT_OK(jobs.note_under_way("while the head was jogged", kNow));
  for (const char* change : {"UPDATE activities SET doing = ''", "DELETE FROM activities",
                             "INSERT OR REPLACE INTO activities (id, under_way, doing, at) VALUES (1, 0, '', 't')"})
    EXPECT_FALSE(execute(cell.database(), change).ok()) << change;
  VENEER_ASSERT_OK(jobs.note_at_rest(kNow));
  EXPECT_FALSE(execute(cell.database(), "INSERT INTO activities (under_way, doing, at) VALUES (0, '', 't')").ok());
}

// ---- lost pieces ----------------------------------------------------------------------------------------------------

TEST_F(Aborts, AJobIsNamedForItsMissingPiecesOnceNothingOfItIsLeftToCut) {
  const auto lost = [this] {
    std::vector<std::pair<JobId, int>> out;
    for (const JobLoss& one : must(jobs.with_loss())) out.emplace_back(one.id, one.missing);
    return out;
  };
  const RunId run = start(panel);
  for (const int i : {0, 1}) cut(i);
  VENEER_ASSERT_OK(jobs.abort_run(run, std::vector{id(2)}, "stop", kLater));
  VENEER_ASSERT_OK(jobs.settle(id(2), AllocationState::kScrap, kLater, "user anna"));
  EXPECT_THAT(lost(), IsEmpty()) << "a piece is still to be cut";
  cut_on_other();
  ASSERT_EQ(state(), JobState::kComplete);
  EXPECT_THAT(lost(), ElementsAre(std::pair(job, 2))) << "A3 was lost, and A5 never had wood";
  const JobId given_up = must(jobs.create(job_of({square_piece("B1", panel, 70, 10, 14)}), kNow));
  VENEER_ASSERT_OK(jobs.cancel(given_up, kLater));
  EXPECT_THAT(lost(), ElementsAre(std::pair(job, 2))) << "nobody wants the pieces of one that was given up";
  VENEER_ASSERT_OK(jobs.archive(job, true, kLater));
  EXPECT_THAT(lost(), IsEmpty());
}

// One wrong tap would cost a good piece, and new wood.
TEST_F(Aborts, ThatAPieceIsLostIsTakenBackWhileItHasNoOtherWood) {
  const RunId run = start(panel);
  for (const int i : {0, 1}) cut(i);
  VENEER_ASSERT_OK(jobs.abort_run(run, std::vector{id(2)}, "stop", kLater));
  cut_on_other();
  VENEER_ASSERT_OK(jobs.settle(id(2), AllocationState::kScrap, kLater, "user anna"));
  ASSERT_EQ(state(), JobState::kComplete);
  EXPECT_THAT(jobs.settle(id(0), AllocationState::kSuspect, kLater, "user anna").error().message,
              HasSubstr("piece A1 of job 1 is cut, and only that a piece is lost is taken back"));
  VENEER_ASSERT_OK(jobs.settle(id(2), AllocationState::kSuspect, kLater, "user anna"));
  EXPECT_EQ(state(), JobState::kStopped) << "somebody has to look again";
  EXPECT_EQ(states()[2], PieceState::kSuspect);
  VENEER_ASSERT_OK(jobs.settle(id(2), AllocationState::kReleased, kLater, "user anna"));
  EXPECT_EQ(state(), JobState::kComplete);
  EXPECT_EQ(jobs.settle(id(2), AllocationState::kSuspect, kLater, "user anna").error().code, ErrorCode::kConflict)
      << "its wood may be another piece's by now";
}

TEST_F(Aborts, ButNotOnceItHasOtherWoodOrItsPanelIsGone) {
  const RunId run = start(panel);
  VENEER_ASSERT_OK(jobs.abort_run(run, std::vector{id(0), id(1)}, "stop", kLater));
  for (const int i : {0, 1}) VENEER_ASSERT_OK(jobs.settle(id(i), AllocationState::kScrap, kLater, "user anna"));
  must(jobs.redo(job, job_of({square_piece("A1", other, 60, 60, 14)}), kLater));
  EXPECT_FALSE(jobs.settle(id(0), AllocationState::kSuspect, kLater, "user anna").ok());
  EXPECT_EQ(states()[0], PieceState::kReserved);
  EXPECT_FALSE(execute(cell.database(), "UPDATE allocations SET state = 'suspect' WHERE state = 'scrap'").ok())
      << "whoever writes";
  VENEER_ASSERT_OK(jobs.cancel(job, kLater));
  VENEER_ASSERT_OK(cell.panels().retire(panel, "warped", kLater));
  EXPECT_THAT(jobs.settle(id(1), AllocationState::kSuspect, kLater, "user anna").error().message,
              HasSubstr("was retired"));
  VENEER_ASSERT_OK(cell.panels().restore(panel, "flat again", kLater));
  VENEER_EXPECT_OK(jobs.settle(id(1), AllocationState::kSuspect, kLater, "user anna"));
}

// ---- what scans saw -------------------------------------------------------------------------------------------------

class SettledByScans : public Aborts {
 protected:
  SettledByScans() {
    const RunId run = must(jobs.start_run(job, panel, kPose, 0.04_mm, kNow));
    VENEER_EXPECT_OK(jobs.abort_run(run, std::vector{id(0), id(1), id(2)}, "the panel was lifted", kLater));
    pieces = must(jobs.pieces(job));
  }
  // A scan, and what it saw of the first pieces.
  void scan(const std::string& map, std::vector<Seen> seen) {
    LaterScan later{};
    later.mask = {0, map, map + "-mask", map, kLater, SquareMillimetres(1200)};
    later.after = version_++;
    for (std::size_t i = 0; i < seen.size(); ++i)
      later.sightings.emplace_back(pieces[i].allocation, Sighting{seen[i], 0.5, 0, kLater});
    must(LaterScans(cell.database()).enter(panel, later));
  }
  Result<SettledAsSeen> settle_gone() { return jobs.settle_as_seen(job, {}, "anna", kLater); }
  Result<SettledAsSeen> settle(AllocationState there, std::vector<std::string> marks) {
    return jobs.settle_as_seen(job, {there, std::move(marks)}, "anna", kLater);
  }
  int version_ = 1;
};

TEST_F(SettledByScans, WhatAScanSawClearlyIsTakenOverAndTheRestStaysSuspect) {
  EXPECT_THAT(settle_gone().error().message,
              HasSubstr("no scan that counts saw what became of the suspect pieces of job 1: scan their panels"));
  scan("map-2", {Seen::kCut, Seen::kStillThere, Seen::kUnclear});
  const SettledAsSeen gone = must(settle_gone());
  EXPECT_THAT(gone.cut, ElementsAre("A1"));
  EXPECT_THAT(gone.left, ElementsAre("A2", "A3"));
  const SettledAsSeen whole = must(settle(AllocationState::kReleased, {"A2"}));
  EXPECT_THAT(whole.cut, ElementsAre());
  EXPECT_THAT(whole.there, ElementsAre("A2"));
  EXPECT_THAT(whole.left, ElementsAre("A3"));
  EXPECT_THAT(states(), ElementsAre(PieceState::kCut, PieceState::kReleased, PieceState::kSuspect,
                                    PieceState::kReserved, PieceState::kUnfilled));
  AuditFilter filter;
  filter.what = "job.settle-as-seen";
  const auto rows = must(Audit(cell.database()).read(filter, 10));
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0].who, "anna");
  EXPECT_THAT((std::vector{rows[0].detail, rows[1].detail}),
              UnorderedElementsAre(fmt::format("job {}; cut: A1; there: ; still suspect: A2, A3", job.value),
                                   fmt::format("job {}; cut: ; released: A2; still suspect: A3", job.value)));
  const auto again = settle_gone();
  ASSERT_FALSE(again.ok()) << "nothing is left that was seen clearly";
  EXPECT_EQ(again.error().code, ErrorCode::kConflict);
  EXPECT_EQ(jobs.settle_as_seen({99}, {}, "anna", kLater).error().code, ErrorCode::kNotFound);
}

// A kerf that was begun is too fine for what a scan compares: that wood is whole is a person's word.
TEST_F(SettledByScans, OfWoodThatIsStillThereAPersonSaysWhatItIs) {
  scan("map-2", {Seen::kCut, Seen::kStillThere, Seen::kStillThere});
  const SettledAsSeen only_cut = must(settle_gone());
  EXPECT_THAT(only_cut.cut, ElementsAre("A1"));
  EXPECT_THAT(only_cut.left, ElementsAre("A2", "A3"));
  EXPECT_EQ(
      settle_gone().error().message,
      "the scan saw the wood of A2, A3 still in the panel, and no scan sees a cut that was only begun: look at each, "
      "then say veneerctl job settle 1 --as-seen --there scrap --pieces A2 A3 (or released for scrap, when none is "
      "burnt)");
  EXPECT_EQ(settle(AllocationState::kCut, {"A2"}).error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(must(settle(AllocationState::kScrap, {"A3", "A2"})).there, ElementsAre("A2", "A3"));
  EXPECT_EQ(states()[1], PieceState::kScrap);
}

// The list that he confirmed is as old as his walk to the panel: a scan that was entered meanwhile adds none to it.
TEST_F(SettledByScans, WhatIsSaidOfWoodInThePanelHoldsForThePiecesThatWereShown) {
  scan("map-2", {Seen::kStillThere, Seen::kUnclear, Seen::kCut});
  scan("map-3", {Seen::kStillThere, Seen::kStillThere, Seen::kCut});
  for (const std::vector<std::string>& none : {std::vector<std::string>{}, {"A1", "A3"}, {"A1", "A4"}, {"A1", "Z9"}})
    EXPECT_FALSE(settle(AllocationState::kReleased, none).ok()) << fmt::format("{}", fmt::join(none, " "));
  EXPECT_EQ(jobs.settle_as_seen(job, {AllocationState::kReleased, {}}, "anna", kLater).error().code,
            ErrorCode::kInvalidArgument);
  EXPECT_EQ(jobs.settle_as_seen(job, {{}, std::vector<std::string>{"A3", "A1"}}, "anna", kLater).error().code,
            ErrorCode::kConflict)
      << "the scan saw the wood of A1 in the panel";
  EXPECT_EQ(states()[0], PieceState::kSuspect);
  const SettledAsSeen settled = must(settle(AllocationState::kReleased, {"A1"}));
  EXPECT_THAT(settled.there, ElementsAre("A1"));
  EXPECT_THAT(settled.left, ElementsAre("A2", "A3"));
  EXPECT_EQ(states()[1], PieceState::kSuspect) << "nobody has looked at it";
  EXPECT_EQ(settle(AllocationState::kReleased, {"A1"}).error().code, ErrorCode::kConflict)
      << "it is not suspect any more";
  scan("map-4", {Seen::kUnclear, Seen::kUnclear});
  EXPECT_EQ(settle(AllocationState::kReleased, {"A2"}).error().code, ErrorCode::kConflict) << "not seen so now";
}

// What was taken back may have been of another panel, or of one that lay askew.
TEST_F(SettledByScans, AScanThatWasTakenBackDecidesNothing) {
  scan("map-2", {Seen::kCut, Seen::kStillThere, Seen::kUnclear});
  must(cell.panels().revert_mask(panel, 1, kLater, "anna"));
  EXPECT_FALSE(settle_gone().ok());
  EXPECT_EQ(states()[0], PieceState::kSuspect);
  must(cell.panels().revert_mask(panel, 2, kLater, "anna"));
  EXPECT_THAT(must(settle_gone()).cut, ElementsAre("A1")) << "it counts again";
}

TEST_F(SettledByScans, OnlyTheLastScanDecides) {
  scan("map-2", {Seen::kCut});
  scan("map-3", {Seen::kUnclear});
  EXPECT_FALSE(settle_gone().ok());
  scan("map-4", {});
  EXPECT_FALSE(settle_gone().ok());
}

// Wood that became suspect anew, after a scan had seen it.
TEST_F(SettledByScans, WhatWasSeenBeforeAPieceBecameSuspectDecidesNothing) {
  scan("map-2", {Seen::kCut});
  must(settle_gone());
  VENEER_ASSERT_OK(jobs.make_suspect({{id(0)}}, kLater));
  EXPECT_FALSE(settle_gone().ok());
}

TEST_F(SettledByScans, TheLastOfThemCompletesTheJob) {
  cut_on_other();
  ASSERT_EQ(state(), JobState::kStopped) << "three pieces are suspect";
  scan("map-2", {Seen::kCut, Seen::kCut, Seen::kStillThere});
  must(settle_gone());
  must(settle(AllocationState::kReleased, {"A3"}));
  EXPECT_EQ(state(), JobState::kComplete);
}

}  // namespace
}  // namespace veneer::db
