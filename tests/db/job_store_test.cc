#include "db/job_store.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>

#include "tests/db/everything.h"
#include "tests/db/planned_job.h"
#include "tests/db/stray_sql.h"

namespace veneer::db {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class JobStoreTest : public PlannedJob {};

TEST_F(JobStoreTest, RemembersThePlan) {
  const JobRecord record = must(jobs.find(job));
  EXPECT_EQ(record.name, "portrait");
  EXPECT_EQ(record.state, JobState::kPlanned);
  EXPECT_EQ(record.count(PieceState::kReserved), 4);
  EXPECT_EQ(record.count(PieceState::kUnfilled), 1);
  EXPECT_EQ(record.count(PieceState::kCut), 0);
  EXPECT_EQ(must(jobs.plan_json(job)), "{\"schema_version\":1}");
  ASSERT_EQ(pieces.size(), 5U);
  EXPECT_EQ(pieces[1].mark, "A2");
  EXPECT_EQ(pieces[1].panel_outline, square(30, 10, 14));
  EXPECT_EQ(pieces[1].panel_from_artwork.shift(), point<PanelFrame>(30, 10));
  EXPECT_EQ(pieces[3].panel, other);
  EXPECT_FALSE(pieces[1].lead_in.has_value());
  EXPECT_FALSE(pieces[4].panel.has_value());
  EXPECT_EQ(must(jobs.list()).size(), 1U);
}

TEST_F(JobStoreTest, EachStateOfAJobIsKeptWithWhoBroughtItThere) {
  const auto told = [&] {
    return texts(
        cell.database().connection(),
        fmt::format("SELECT what || ' ' || at || ' ' || who FROM events WHERE kind = 'job' AND job = {} AND what "
                    "<> 'made' ORDER BY at, step",
                    job.value));
  };
  const auto at = [](int minute) { return fmt::format("2026-05-02T08:{:02}:00.000Z", minute); };
  RunFacts facts;
  facts.who = "user bert";
  const RunId run = must(jobs.start_run(job, panel, kPose, 0.04_mm, at(1), facts));
  VENEER_ASSERT_OK(jobs.mark_cutting(pieces[0].id, at(2)));
  VENEER_ASSERT_OK(jobs.abort_run(run, {}, "the link was lost", at(3)));
  VENEER_ASSERT_OK(jobs.settle(pieces[0].id, AllocationState::kScrap, at(4), "user anna"));
  VENEER_ASSERT_OK(jobs.cancel(job, at(5), "user anna"));
  VENEER_ASSERT_OK(jobs.archive(job, true, at(6), "user carl"));
  NewPlan again = made_again({square_piece("A5", other, 40, 40, 14)});
  again.who = "user dora";
  must(jobs.redo(job, again, at(7)));
  EXPECT_THAT(told(), ElementsAre("running " + at(1) + " user bert", "aborted " + at(3) + " ",
                                  "cancelled " + at(5) + " user anna", "archived " + at(6) + " user carl", ::testing::_,
                                  ::testing::_, ::testing::_));
  EXPECT_THAT(told(), ::testing::IsSupersetOf({"stopped " + at(7) + " user dora", "in sight again " + at(7) + " ",
                                               "pieces made again " + at(7) + " user dora"}));
  // The newest is what the job is, of all jobs.
  EXPECT_EQ(
      cell.database()
          .connection()
          .execAndGet("SELECT count(*) FROM jobs AS j WHERE state <> coalesce((SELECT state FROM job_history WHERE "
                      "job = j.id ORDER BY id DESC LIMIT 1), 'planned')")
          .getInt(),
      0);
  for (const char* forgery :
       {"UPDATE job_history SET at = '2020'", "DELETE FROM job_history", "UPDATE done_by SET who = 'nobody'",
        "DELETE FROM done_by", "INSERT INTO done_by (kind, number, who) VALUES ('job', 999, 'x')",
        "INSERT INTO done_by (kind, number, who) VALUES ('lease', 1, 'x')",
        "INSERT INTO done_by (kind, number, who) SELECT 'job', min(id), '' FROM job_history"})
    EXPECT_FALSE(execute(cell.database(), forgery).ok()) << forgery;
  VENEER_EXPECT_OK(cell.database().check_integrity());
}

TEST_F(JobStoreTest, WhoMadeAJobAndWhoseStopEndedItsRunsIsKept) {
  const auto told = [&](JobId of) {
    return texts(cell.database().connection(),
                 fmt::format("SELECT what || ' by ' || who FROM events WHERE kind = 'job' AND job = {} AND what <> "
                             "'running' ORDER BY at, part, step",
                             of.value));
  };
  NewPlan plan = job_of({square_piece("B1", panel, 100, 10, 14), square_piece("B2", other, 100, 10, 14)});
  plan.who = "user anna";
  const JobId at_once = must(jobs.create(plan, kNow));
  EXPECT_THAT(told(at_once), ElementsAre("made by user anna"));
  plan = job_of({square_piece("C1", panel, 120, 10, 14), square_piece("C2", other, 120, 10, 14)});
  plan.who = "user anna";
  const JobId later = must(jobs.create(must(Plans(cell.database()).add(plan, kNow)), kNow, {}, "user bert"));
  EXPECT_THAT(told(later), ElementsAre("made by user bert")) << "who asked for its plan is another matter";

  const auto at = [](int minute) { return fmt::format("2026-05-02T08:{:02}:00.000Z", minute); };
  const auto piece = [&](int index) { return must(jobs.pieces(later)).at(static_cast<std::size_t>(index)).id; };
  const auto begin = [&](const PanelId& on, int minute) {
    return must(jobs.start_run(later, on, kPose, 0.04_mm, at(minute)));
  };
  VENEER_ASSERT_OK(jobs.finish_run(begin(panel, 1), false, at(2), {{}, false, "user anna"}));
  VENEER_ASSERT_OK(jobs.abort_run(begin(panel, 3), {}, "STOP by user bert", at(4), {}, "user bert"));
  const RunId run = begin(panel, 5);
  VENEER_ASSERT_OK(jobs.mark_cutting(piece(0), at(6)));
  VENEER_ASSERT_OK(jobs.book_piece(piece(0), at(6)));
  VENEER_ASSERT_OK(jobs.finish_run(run, true, at(7), {{}, false, "user carl"}));
  VENEER_ASSERT_OK(jobs.stop_job_and_rest(later, at(8), "", "user dora"));
  EXPECT_THAT(told(later),
              ElementsAre("made by user bert", "stopped by user anna", "aborted by user bert", "stopped by user dora"));
  const RunId last = begin(other, 9);
  VENEER_ASSERT_OK(jobs.mark_cutting(piece(1), at(10)));
  VENEER_ASSERT_OK(jobs.book_piece(piece(1), at(10)));
  VENEER_ASSERT_OK(jobs.abort_run(last, {}, "STOP by user bert", at(11), {}, "user bert"));
  EXPECT_EQ(told(later).back(), "complete by ") << "nobody's STOP cut its last piece";
  VENEER_ASSERT_OK(jobs.note_abort("STOP by user bert", at(12), "user bert"));
  VENEER_ASSERT_OK(jobs.note_abort("the link was lost", at(13)));
  EXPECT_THAT(texts(cell.database().connection(),
                    "SELECT what || ' by ' || who FROM events WHERE kind = 'cell' AND part = 1 ORDER BY at, step"),
              ElementsAre("STOP by user bert by user bert", "the link was lost by veneerd"));
  for (const char* forgery : {"INSERT INTO done_by (kind, number, who) VALUES ('made', 999, 'x')",
                              "INSERT INTO done_by (kind, number, who) VALUES ('unmade', 1, 'x')",
                              "INSERT INTO done_by (kind, number, who) SELECT kind, number, 'x' FROM done_by"})
    EXPECT_FALSE(execute(cell.database(), forgery).ok()) << forgery;
  VENEER_EXPECT_OK(cell.database().check_integrity());
}

TEST_F(JobStoreTest, MarksAreUniqueWithinAJob) {
  const auto twice =
      jobs.create(job_of({square_piece("B1", panel, 100, 10, 14), square_piece("B1", panel, 130, 10, 14)}), kNow);
  ASSERT_FALSE(twice.ok());
  EXPECT_EQ(twice.error().code, ErrorCode::kConflict);
}

TEST_F(JobStoreTest, OutlinesHaveTheSameVertices) {
  PlannedPatch piece = square_piece("B1", panel, 100, 10, 14);
  piece.artwork_outline.pop_back();
  EXPECT_FALSE(jobs.create(job_of({piece}), kNow).ok());
}

TEST_F(JobStoreTest, CancellingKeepsWhatWasCut) {
  const RunId run = start(panel);
  cut(0);
  VENEER_ASSERT_OK(jobs.finish_run(run, false, kLater));
  VENEER_ASSERT_OK(jobs.cancel(job, kLater));
  EXPECT_THAT(states(), ElementsAre(PieceState::kCut, PieceState::kReleased, PieceState::kReleased,
                                    PieceState::kReleased, PieceState::kUnfilled));
  EXPECT_EQ(must(cell.ledger().live_allocations(panel)).size(), 1U);
  const Status twice = jobs.cancel(job, kLater);
  ASSERT_FALSE(twice.ok());
  EXPECT_THAT(twice.error().message, HasSubstr("is cancelled and cannot become cancelled"));
}

TEST_F(JobStoreTest, UnknownThingsAreNamed) {
  const auto missing = jobs.find({77});
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(missing.error().message, HasSubstr("job 77"));
  EXPECT_EQ(jobs.find_piece({99}).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(jobs.mark_cutting({99}, kNow).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(jobs.start_run({77}, panel, kPose, 0.04_mm, kNow).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(jobs.cancel({77}, kNow).error().code, ErrorCode::kNotFound);
}

TEST_F(JobStoreTest, RefusesAPlanOfAPanelThatWasScannedAgain) {
  NewPlan planned = job_of({square_piece("B1", panel, 200, 10, 14), square_piece("B2", other, 200, 10, 14)});
  must(cell.panels().add_mask(other, {0, "map", "mask", "hash", kLater}, 1));
  const auto refused = jobs.create(planned, kLater);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kConflict);
  EXPECT_EQ(refused.error().message,
            "panel P-0002 was scanned again after this was planned, or a scan was taken back: plan again");
  EXPECT_EQ(must(jobs.list()).size(), 1U);
  planned.planned_on = {{panel, 1}, {other, 2}};
  VENEER_EXPECT_OK(jobs.create(planned, kLater));
}

TEST_F(JobStoreTest, MakesNoPieceAgainOnAPanelThatWasScannedAgain) {
  const RunId run = start(panel);
  cut(0);
  VENEER_ASSERT_OK(jobs.finish_run(run, false, kLater));
  must(cell.panels().add_mask(other, {0, "map", "mask", "hash", kLater}, 1));
  NewPlan again = job_of({square_piece("A1", other, 100, 10, 14)});
  const auto refused = jobs.redo(job, again, kLater);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kConflict);
  EXPECT_EQ(refused.error().message,
            "panel P-0002 was scanned again after this was planned, or a scan was taken back: plan again");
  EXPECT_EQ(states()[0], PieceState::kCut) << "nothing of it was done";
  EXPECT_THAT(must(jobs.redos(job)), ::testing::IsEmpty());
  again.planned_on = {{other, 2}};
  VENEER_EXPECT_OK(jobs.redo(job, again, kLater));
  EXPECT_EQ(states()[0], PieceState::kReserved);
}

TEST_F(JobStoreTest, RefusesAPlanThatDoesNotSayWhatItWasMadeOn) {
  NewPlan planned = job_of({square_piece("B1", panel, 200, 10, 14)});
  planned.planned_on.clear();
  const auto refused = jobs.create(planned, kLater);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(refused.error().message, HasSubstr("B1"));
}

}  // namespace
}  // namespace veneer::db
