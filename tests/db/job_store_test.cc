#include "db/job_store.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>

#include "db/audit.h"
#include "db/guard.h"
#include "tests/db/counted_statements.h"
#include "tests/db/everything.h"
#include "tests/db/planned_job.h"
#include "tests/db/stray_sql.h"

namespace veneer::db {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

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

TEST_F(JobStoreTest, TellsWhatBecameOfAPieceStepByStep) {
  const RunFacts facts{"local:1000", {{4}, {7}}, R"([{"material":"walnut","pieces":["A1"]}])"};
  const RunId run = must(jobs.start_run(job, panel, kPose, 0.04_mm, kNow, facts));
  cut(0);
  VENEER_ASSERT_OK(jobs.mark_cutting(pieces[1].id, "t2"));
  VENEER_ASSERT_OK(jobs.abort_run(run, {}, "stop", "t3"));
  VENEER_ASSERT_OK(jobs.settle(pieces[1].id, AllocationState::kScrap, "t4", "user anna"));
  const auto told = [&](PieceId piece) {
    std::string out;
    for (const PieceStep& step : must(jobs.history(piece)))
      out += fmt::format("{} {} {}, ", to_string(step.state), step.at, step.run ? step.run->value : 0);
    return out;
  };
  EXPECT_EQ(told(pieces[0].id), fmt::format("reserved {0} 0, cutting {0} 1, cut {0} 1, ", kNow));
  EXPECT_EQ(told(pieces[1].id), fmt::format("reserved {} 0, cutting t2 1, suspect t3 1, scrap t4 0, ", kNow));
  EXPECT_EQ(told(pieces[4].id), "") << "it has no wood";
  // Made again, it has another piece of wood, and both are told of.
  NewPlan again = job_of({square_piece("A2", other, 70, 40, 14)});
  must(jobs.redo(job, again, "t5"));
  const auto steps = must(jobs.history(pieces[1].id));
  ASSERT_EQ(steps.size(), 5U);
  EXPECT_EQ(steps[3].panel, panel);
  EXPECT_EQ(steps[4].panel, other);
  EXPECT_NE(steps[3].allocation, steps[4].allocation);

  EXPECT_EQ(must(jobs.facts(run)).who, "local:1000");
  EXPECT_THAT(must(jobs.facts(run)).certificates, ElementsAre(CertificateId{4}, CertificateId{7}));
  EXPECT_EQ(must(jobs.facts(run)).recipes_json, facts.recipes_json);
  EXPECT_EQ(must(jobs.facts(start(other))).who, "") << "nobody noted it";
}

// What counts must find a walk through a table, or it would find none anywhere.
TEST_F(JobStoreTest, AWalkThroughAllPiecesIsCounted) {
  Database& database = cell.database();
  const auto walk = [&] { texts(database.connection(), "SELECT checksum FROM pieces"); };
  EXPECT_GT(rows_scanned_by(database, walk), 3);
  EXPECT_EQ(statements_of(database, walk), 1);
}

// There are a million pieces, and the one that is asked for may be an old one.
TEST_F(JobStoreTest, OfOnePieceNothingElseIsRead) {
  VENEER_ASSERT_OK(jobs.finish_run(start(panel), false, kNow));
  VENEER_ASSERT_OK(jobs.finish_run(start(other), false, kNow));
  VENEER_ASSERT_OK(jobs.cancel(job, kNow));
  const JobId later = must(jobs.create(job_of({square_piece("B1", panel, 10, 10, 14)}), kNow));
  const PieceId piece = must(jobs.pieces(later)).at(0).id;
  must(jobs.create(job_of({square_piece("C1", panel, 70, 10, 14), square_piece("C2", panel, 90, 10, 14)}), kNow));
  must(jobs.start_run(later, panel, kPose, 0.04_mm, kNow));
  Database& database = cell.database();
  EXPECT_EQ(rows_scanned_by(database, [&] { must(jobs.find_piece(piece)); }), 0);
  EXPECT_EQ(rows_scanned_by(database, [&] { must(jobs.history(piece)); }), 0);
  EXPECT_EQ(rows_scanned_by(database, [&] { must(Ledger(database).allocations_at(panel, {17_mm, 17_mm})); }), 0);
  EXPECT_EQ(rows_scanned_by(database, [&] { VENEER_ASSERT_OK(jobs.mark_cutting(piece, kNow)); }), 0);
  EXPECT_EQ(rows_scanned_by(database, [&] { VENEER_ASSERT_OK(jobs.book_piece(piece, kNow)); }), 0);
}

// They are read at each start, and the history of all wood has grown by then.
TEST_F(JobStoreTest, OfKeptCutsNoOtherHistoryIsRead) {
  const RunId run = start(panel);
  for (const std::size_t i : {0, 1}) {
    VENEER_ASSERT_OK(jobs.mark_cutting(pieces[i].id, kNow));
    VENEER_ASSERT_OK(jobs.book_and_keep(KeptCut{pieces[i].id, "", run, "Grbl", R"([{"speed":12}])"}, kNow));
  }
  VENEER_ASSERT_OK(jobs.finish_run(run, false, kNow));
  std::vector<PlannedPatch> later;
  for (int i = 0; i < 20; ++i) later.push_back(square_piece(fmt::format("B{}", i), panel, 10 + 18 * i, 150, 14));
  must(jobs.create(job_of(later), kNow));
  std::vector<KeptCut> kept;
  EXPECT_LE(rows_scanned_by(cell.database(), [&] { kept = must(jobs.kept_cuts()); }), 2);
  ASSERT_EQ(kept.size(), 2U);
  EXPECT_EQ(kept[0].mark, "A1");
  EXPECT_EQ(kept[1].mark, "A2");
}

TEST_F(JobStoreTest, WhatAScanSawOfASuspectPieceIsKeptUntilSomebodyDecides) {
  const RunId run = start(panel);
  VENEER_ASSERT_OK(jobs.mark_cutting(pieces[0].id, kNow));
  VENEER_ASSERT_OK(jobs.abort_run(run, {}, "stop", kNow));
  const auto saw = [&](int index, Sighting sighting) {
    const std::pair seen(pieces[static_cast<std::size_t>(index)].allocation, std::move(sighting));
    return jobs.note_sightings({&seen, 1});
  };
  const auto sighting = [&](int index) {
    return must(jobs.find_piece(pieces[static_cast<std::size_t>(index)].id)).sighting;
  };
  EXPECT_FALSE(sighting(0)) << "nobody has looked";
  VENEER_ASSERT_OK(saw(0, {Seen::kCut, 1, 2, kNow}));
  EXPECT_FALSE(sighting(0)) << "what a scan saw that does not count is not told";
  VENEER_ASSERT_OK(saw(0, {Seen::kUnclear, 0.4, 1, kNow}));
  VENEER_ASSERT_OK(saw(0, {Seen::kCut, 0.97, 1, kLater}));
  VENEER_ASSERT_OK(saw(1, {Seen::kCut, 1, 1, kLater}));
  ASSERT_TRUE(sighting(0));
  EXPECT_EQ(sighting(0)->seen, Seen::kCut) << "the last one counts";
  EXPECT_EQ(sighting(0)->gone, 0.97);
  EXPECT_EQ(sighting(0)->mask_version, 1);
  EXPECT_EQ(sighting(0)->at, kLater);
  EXPECT_FALSE(sighting(1)) << "it is not suspect";
  EXPECT_EQ(states()[0], PieceState::kSuspect) << "nothing is decided by it";
  EXPECT_FALSE(saw(0, {Seen::kCut, 1.5, 3, kLater}).ok());
  VENEER_ASSERT_OK(jobs.settle(pieces[0].id, AllocationState::kCut, kLater, "user anna"));
  EXPECT_FALSE(sighting(0));
  const std::vector<PieceId> strayed = {pieces[0].id};
  VENEER_ASSERT_OK(jobs.make_suspect(strayed, kLater));
  EXPECT_FALSE(sighting(0)) << "what was seen before it became suspect again says nothing";
}

TEST_F(JobStoreTest, APieceIsTickedOffOnceItIsCutAndUntilItIsMadeAgain) {
  const std::vector<std::string> two = {pieces[0].mark, pieces[1].mark}, first = {pieces[0].mark};
  const auto assembled = [&](int index) {
    return must(jobs.find_piece(pieces[static_cast<std::size_t>(index)].id)).assembled;
  };
  const Status early = jobs.assemble(job, two, true, "anna", kNow);
  ASSERT_FALSE(early.ok());
  EXPECT_EQ(early.error().code, ErrorCode::kConflict);
  EXPECT_THAT(early.error().message, HasSubstr("only a piece that is cut is assembled: cut it with"));
  const RunId run = start(panel);
  VENEER_ASSERT_OK(jobs.mark_cutting(pieces[0].id, kNow));
  EXPECT_THAT(jobs.assemble(job, first, true, "anna", kNow).error().message,
              HasSubstr("is being cut, and only a piece that is cut is assembled: wait until it is cut"));
  VENEER_ASSERT_OK(jobs.book_piece(pieces[0].id, kNow));
  EXPECT_FALSE(jobs.assemble(job, two, true, "anna", kNow).ok());
  EXPECT_FALSE(assembled(0)) << "all of them, or none";
  VENEER_ASSERT_OK(jobs.assemble(job, first, true, "anna", kNow));
  VENEER_ASSERT_OK(jobs.assemble(job, first, true, "bert", kLater));
  ASSERT_TRUE(assembled(0));
  EXPECT_EQ(assembled(0)->who, "anna") << "who ticked it off first";
  EXPECT_EQ(assembled(0)->at, kNow);
  VENEER_ASSERT_OK(jobs.assemble(job, first, false, "bert", kLater));
  EXPECT_FALSE(assembled(0));
  VENEER_ASSERT_OK(jobs.assemble(job, first, true, "bert", kLater));
  EXPECT_EQ(assembled(0)->who, "bert");
  VENEER_ASSERT_OK(jobs.abort_run(run, {}, "stop", kLater));
  const std::vector<PieceId> strayed = {pieces[0].id};
  VENEER_ASSERT_OK(jobs.make_suspect(strayed, kLater));
  EXPECT_FALSE(assembled(0)) << "nobody knows what it is now";
  VENEER_ASSERT_OK(jobs.settle(pieces[0].id, AllocationState::kCut, kLater, "user anna"));
  EXPECT_TRUE(assembled(0)) << "it lies where it lay";
  EXPECT_EQ(jobs.assemble(job, std::vector<std::string>{"Z9"}, true, "anna", kNow).error().code, ErrorCode::kNotFound);
}

TEST_F(JobStoreTest, FindsAPieceByItsMark) {
  const PieceRecord found = must(jobs.find_piece(job, "A3"));
  EXPECT_EQ(found.id, pieces[2].id);
  EXPECT_EQ(found.placed_by, must(jobs.find(job)).plan);
  EXPECT_THAT(jobs.find_piece(job, "Z9").error().message,
              HasSubstr("job 1 has no piece Z9: see `veneerctl job pieces 1`"));
  EXPECT_THAT(jobs.find_piece({77}, "A3").error().message, HasSubstr("there is no job 77"));
}

// A plan that makes these again, from the first panel at x, y.
NewPlan made_again(const std::vector<PlannedPatch>& pieces) {
  NewPlan out = job_of(pieces);
  out.plan_json = "{\"redone\":true}";
  out.preview_file = "previews/redone.png";
  return out;
}

TEST_F(JobStoreTest, ALostPieceIsMadeAgainUnderItsNumber) {
  for (const PanelId& on : {panel, other}) {
    const RunId run = start(on);
    if (on == panel) cut(0), cut(1), cut(2);
    if (on == other) cut(3);
    VENEER_ASSERT_OK(jobs.finish_run(run, true, kLater));
  }
  ASSERT_EQ(state(), JobState::kComplete);
  EXPECT_EQ(must(jobs.find(job)).missing(), 1) << "the one that found no wood";

  // A2 was lost after it was cut, A5 had no wood.
  const PlanId plan = must(jobs.redo(
      job, made_again({square_piece("A2", panel, 70, 40, 14), square_piece("A5", other, 40, 40, 14)}), kLater));
  EXPECT_EQ(state(), JobState::kStopped);
  EXPECT_THAT(states(), ElementsAre(PieceState::kCut, PieceState::kReserved, PieceState::kCut, PieceState::kCut,
                                    PieceState::kReserved));
  const auto now = must(jobs.pieces(job));
  EXPECT_EQ(now[1].id, pieces[1].id);
  EXPECT_EQ(now[1].panel_outline, square(70, 40, 14));
  EXPECT_EQ(now[4].panel, other);
  // What it was cut from is gone for good.
  int scrap = 0;
  for (const auto& live : must(cell.ledger().live_allocations(panel))) {
    if (live.state != AllocationState::kScrap) continue;
    ++scrap;
    EXPECT_EQ(live.piece, pieces[1].id);
  }
  EXPECT_EQ(scrap, 1);
  const JobRecord record = must(jobs.find(job));
  EXPECT_EQ(record.newest, plan);
  EXPECT_NE(record.plan, plan);
  EXPECT_EQ(record.preview_file, "previews/redone.png");
  EXPECT_EQ(must(jobs.plan_json(job)), "{\"redone\":true}");
  EXPECT_THAT(must(jobs.redos(job)), ElementsAre(plan));
  Plans plans(cell.database());
  EXPECT_EQ(must(plans.find(plan)).placed, 2);
  EXPECT_EQ(must(plans.find(plan)).patches, 5);
  EXPECT_THAT(must(plans.find(plan)).jobs, ElementsAre(job));
  ASSERT_EQ(must(plans.patches(plan)).size(), 2U);
  EXPECT_EQ(must(plans.patches(plan))[1].mark, "A5");
  EXPECT_EQ(plans.remove(plan).error().code, ErrorCode::kConflict);
  EXPECT_EQ(jobs.create(plan, kLater).error().code, ErrorCode::kConflict) << "it is not a whole picture";

  const RunId run = start(panel);
  VENEER_ASSERT_OK(jobs.mark_cutting(pieces[1].id, kLater));
  VENEER_ASSERT_OK(jobs.book_piece(pieces[1].id, kLater));
  VENEER_ASSERT_OK(jobs.finish_run(run, false, kLater));
  EXPECT_EQ(state(), JobState::kStopped);
  VENEER_EXPECT_OK(cell.database().check_integrity());

  // The rest is given up, and taken up again.
  VENEER_ASSERT_OK(jobs.cancel(job, kLater));
  EXPECT_EQ(must(jobs.find(job)).missing(), 1);
  must(jobs.redo(job, made_again({square_piece("A5", other, 40, 40, 14)}), kLater));
  EXPECT_EQ(state(), JobState::kStopped);
}

// That a cut piece is lost is said by whoever has it made again; of one that had no wood nothing is said.
TEST_F(JobStoreTest, WhoGivesUpAPieceThatIsCutIsKept) {
  const RunId run = start(panel);
  cut(0), cut(1);
  VENEER_ASSERT_OK(jobs.finish_run(run, false, kLater));
  NewPlan again = made_again({square_piece("A2", panel, 70, 40, 14), square_piece("A5", other, 40, 40, 14)});
  again.who = "user anna";
  must(jobs.redo(job, again, kLater));
  const auto said =
      texts(cell.database().connection(),
            "SELECT a.piece || ' ' || v.verdict || ' ' || v.as_seen || ' ' || v.who || ' ' || v.at || ' ' "
            "|| h.state FROM verdicts AS v JOIN allocations AS a ON a.id = v.allocation JOIN "
            "allocation_history AS h ON h.id = v.step AND h.allocation = a.id");
  EXPECT_THAT(said, ElementsAre(fmt::format("{} scrap 0 user anna {} scrap", pieces[1].id.value, kLater)));
  EXPECT_THAT(texts(cell.database().connection(), "SELECT kind || ' ' || who FROM events WHERE what = 'scrap'"),
              ElementsAre("verdict user anna"))
      << "once";
  VENEER_EXPECT_OK(cell.database().check_integrity());
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

TEST_F(JobStoreTest, NothingIsMadeAgainThatHasItsWood) {
  const auto again = [&](const PlannedPatch& piece) { return jobs.redo(job, made_again({piece}), kLater); };
  EXPECT_THAT(again(square_piece("A1", panel, 70, 40, 14)).error().message, HasSubstr("still to be cut"));
  EXPECT_EQ(again(square_piece("B9", panel, 70, 40, 14)).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(again(square_piece("A5", panel, 70, 40, 12)).error().code, ErrorCode::kInvalidArgument) << "another shape";
  EXPECT_EQ(again(unfilled("A5")).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(again(square_piece("A5", panel, 12, 12, 14)).error().code, ErrorCode::kConflict) << "A1's wood";
  const RunId run = start(panel);
  cut(0);
  EXPECT_THAT(again(square_piece("A5", panel, 70, 40, 14)).error().message, HasSubstr("is running"));
  VENEER_ASSERT_OK(jobs.mark_cutting(pieces[1].id, kNow));
  VENEER_ASSERT_OK(jobs.abort_run(run, {}, "the link was lost", kLater));
  EXPECT_THAT(again(square_piece("A2", panel, 70, 40, 14)).error().message, HasSubstr("job settle"));
  VENEER_ASSERT_OK(jobs.settle(pieces[1].id, AllocationState::kScrap, kLater, "user anna"));
  must(cell.panels().add_mask(panel, {0, "map", "mask", "hash", kLater}, 1));
  EXPECT_EQ(again(square_piece("A2", panel, 70, 40, 14)).error().code, ErrorCode::kConflict) << "scanned since";
  // Nothing of all this came to pass.
  EXPECT_THAT(states(), ElementsAre(PieceState::kCut, PieceState::kScrap, PieceState::kReserved, PieceState::kReserved,
                                    PieceState::kUnfilled));
  EXPECT_EQ(state(), JobState::kAborted);
  EXPECT_THAT(must(jobs.redos(job)), IsEmpty());
}

TEST_F(JobStoreTest, RemembersWhereACutBeginsInWaste) {
  PlannedPatch led = square_piece("B1", panel, 100, 10, 14);
  led.lead_in = point<PanelFrame>(114.8, 24.8);
  led.allocation = unite(led.allocation, Region<PanelFrame>(square(114, 24, 1)));
  const JobId second = must(jobs.create(job_of({led}), kNow));
  EXPECT_EQ(must(jobs.pieces(second))[0].lead_in, led.lead_in);
  // Its wood is the piece's.
  EXPECT_FALSE(jobs.create(job_of({square_piece("C1", panel, 114.6, 24.6, 14)}), kNow).ok());
}

TEST_F(JobStoreTest, PieceIdsAreGlobal) {
  const JobId second = must(jobs.create(job_of({square_piece("A1", panel, 200, 10, 14)}), kNow));
  EXPECT_GT(must(jobs.pieces(second))[0].id, pieces.back().id);
  EXPECT_EQ(must(jobs.find_piece(pieces[2].id)).mark, "A3");
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

TEST_F(JobStoreTest, RunsPanelAfterPanelUntilComplete) {
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

TEST_F(JobStoreTest, StopsAfterThisPieceAndGoesOnLater) {
  const RunId run = start(panel);
  cut(0);
  VENEER_ASSERT_OK(jobs.finish_run(run, false, kLater));
  EXPECT_EQ(state(), JobState::kStopped);
  EXPECT_EQ(must(jobs.runs(job))[0].result, "stopped");
  start(panel);
  EXPECT_EQ(state(), JobState::kRunning);
  EXPECT_FALSE(jobs.mark_cutting(pieces[0].id, kLater).ok()) << "a piece is cut once";
}

TEST_F(JobStoreTest, AnAbortMakesTheCuttingPieceSuspect) {
  const RunId run = start(panel);
  cut(0);
  VENEER_ASSERT_OK(jobs.mark_cutting(pieces[1].id, kNow));
  VENEER_ASSERT_OK(jobs.abort_run(run, {}, "the laser stopped answering", kLater));
  EXPECT_EQ(state(), JobState::kAborted);
  EXPECT_THAT(states(), ElementsAre(PieceState::kCut, PieceState::kSuspect, PieceState::kReserved,
                                    PieceState::kReserved, PieceState::kUnfilled));
  EXPECT_EQ(must(jobs.runs(job))[0].result, "the laser stopped answering");
}

TEST_F(JobStoreTest, AnAbortNamesSuspectsButNeverTakesBackWhatWasBooked) {
  const RunId run = start(panel);
  cut(0);
  VENEER_ASSERT_OK(jobs.mark_cutting(pieces[1].id, kNow));
  const std::vector<PieceId> suspects = {pieces[0].id, pieces[1].id, pieces[2].id};
  VENEER_ASSERT_OK(jobs.abort_run(run, suspects, "position lost", kLater));
  EXPECT_THAT(states(), ElementsAre(PieceState::kCut, PieceState::kSuspect, PieceState::kSuspect, PieceState::kReserved,
                                    PieceState::kUnfilled));
}

TEST_F(JobStoreTest, AnAbortWithAForeignPieceChangesNothing) {
  const JobId second = must(jobs.create(job_of({square_piece("B1", panel, 200, 10, 14)}), kNow));
  const RunId run = start(panel);
  VENEER_ASSERT_OK(jobs.mark_cutting(pieces[0].id, kNow));
  const std::vector<PieceId> suspects = {must(jobs.pieces(second))[0].id};
  EXPECT_FALSE(jobs.abort_run(run, suspects, "?", kLater).ok());
  EXPECT_EQ(state(), JobState::kRunning);
  EXPECT_EQ(states()[0], PieceState::kCutting);
}

TEST_F(JobStoreTest, AnAbortMakesNeighboursSuspectWhoseverTheyAre) {
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

TEST_F(JobStoreTest, APieceOfACompleteJobCanBecomeSuspectAndBeSettled) {
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

TEST_F(JobStoreTest, TheRemainingPiecesRunAfterAnAbort) {
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

TEST_F(JobStoreTest, SettlingNeedsASuspectPieceAndAVerdict) {
  EXPECT_FALSE(jobs.settle(pieces[0].id, AllocationState::kCut, kNow, "user anna").ok());
  const RunId run = start(panel);
  VENEER_ASSERT_OK(jobs.mark_cutting(pieces[0].id, kNow));
  VENEER_ASSERT_OK(jobs.abort_run(run, {}, "power", kLater));
  EXPECT_FALSE(jobs.settle(pieces[0].id, AllocationState::kReserved, kNow, "user anna").ok());
  VENEER_EXPECT_OK(jobs.settle(pieces[0].id, AllocationState::kCut, kNow, "user anna"));
  EXPECT_EQ(state(), JobState::kAborted);
}

// Together with the run itself, so that the log lacks none after a power cut.
TEST_F(JobStoreTest, RunsAndRecoveriesAreInTheAuditLog) {
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

TEST_F(JobStoreTest, OneRunAtATime) {
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

TEST_F(JobStoreTest, ARunNeedsSomethingToCutOnItsPanel) {
  const RunId run = start(panel);
  for (const int i : {0, 1, 2}) cut(i);
  VENEER_ASSERT_OK(jobs.finish_run(run, false, kLater));
  const auto again = jobs.start_run(job, panel, kPose, 0.04_mm, kLater);
  ASSERT_FALSE(again.ok());
  EXPECT_THAT(again.error().message, HasSubstr("nothing left to cut on panel P-0001"));
  EXPECT_EQ(state(), JobState::kStopped);
}

TEST_F(JobStoreTest, ARunCannotFinishWhileAPieceIsBeingCut) {
  const RunId run = start(panel);
  VENEER_ASSERT_OK(jobs.mark_cutting(pieces[0].id, kNow));
  const Status early = jobs.finish_run(run, false, kLater);
  ASSERT_FALSE(early.ok());
  EXPECT_THAT(early.error().message, HasSubstr("while a piece is being cut"));
  EXPECT_EQ(state(), JobState::kRunning);
  EXPECT_FALSE(must(jobs.runs(job))[0].ended_at.has_value());
}

// Its piece is to be settled; what was complete does not begin again by a Stop that comes late.
TEST_F(JobStoreTest, AJobThatWasCompleteAndHasAPieceInDoubtWaitsForNoPanel) {
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

TEST_F(JobStoreTest, AJobThatWaitsForAPanelCanBeStoppedOrAborted) {
  const RunId run = start(panel);
  for (const int i : {0, 1, 2}) cut(i);
  VENEER_ASSERT_OK(jobs.finish_run(run, true, kLater));
  VENEER_ASSERT_OK(jobs.stop_job(job, kLater));
  EXPECT_EQ(state(), JobState::kStopped);
  EXPECT_FALSE(jobs.abort_job(job, kLater).ok());
}

TEST_F(JobStoreTest, ARunEndsWithWhatIsInDoubtOfIt) {
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

// Who said what of which piece, and when.
TEST_F(JobStoreTest, WhatPeopleSayOfSuspectPiecesIsKept) {
  const RunId run = start(panel);
  cut(2);
  for (const int i : {0, 1}) VENEER_ASSERT_OK(jobs.mark_cutting(pieces[i].id, kNow));
  VENEER_ASSERT_OK(jobs.abort_run(run, {}, "the lid was opened", kNow));
  const auto said = [&] {
    std::vector<std::string> out;
    SQLite::Statement rows(cell.database().connection(),
                           "SELECT a.piece || ' ' || v.verdict || ' ' || v.as_seen || ' ' || v.who || ' ' || h.state "
                           "FROM verdicts AS v JOIN allocations AS a ON a.id = v.allocation JOIN allocation_history AS "
                           "h ON h.id = v.step AND h.allocation = a.id ORDER BY v.id");
    while (rows.executeStep()) out.push_back(rows.getColumn(0).getString());
    return out;
  };
  const auto line = [&](int piece, const std::string& rest) {
    return fmt::format("{} {}", pieces[static_cast<std::size_t>(piece)].id.value, rest);
  };
  VENEER_ASSERT_OK(jobs.settle(pieces[0].id, AllocationState::kScrap, kLater, "user anna"));
  EXPECT_FALSE(jobs.settle(pieces[2].id, AllocationState::kScrap, kLater, "user anna").ok()) << "it is not suspect";
  VENEER_ASSERT_OK(jobs.settle(pieces[0].id, AllocationState::kSuspect, kLater, "user bert"));
  EXPECT_THAT(said(), ElementsAre(line(0, "scrap 0 user anna scrap"), line(0, "suspect 0 user bert suspect")));
  const int version = must(cell.panels().find(panel)).mask_version;
  const std::pair seen(must(jobs.find_piece(pieces[1].id)).allocation, Sighting{Seen::kCut, 0.98, version, kLater});
  VENEER_ASSERT_OK(jobs.note_sightings({&seen, 1}));
  must(jobs.settle_as_seen(job, {}, "user anna", kLater));
  EXPECT_EQ(said().back(), line(1, "cut 1 user anna cut"));

  // Once of each step, the newest, and what may be said after the step before it.
  const auto say_again = [&](int piece, const char* step, int as_seen = 0, const char* at = "h.at") -> std::string {
    const WritePermission permission(cell.database().guard());
    try {
      cell.database().connection().exec(fmt::format(
          "INSERT INTO verdicts (allocation, step, verdict, as_seen, who, at) SELECT a.id, {}(h.id), a.state, {}, "
          "'user anna', {} FROM allocations AS a JOIN allocation_history AS h ON h.allocation = a.id AND h.state = "
          "a.state "
          "WHERE a.piece = {} GROUP BY a.id",
          step, as_seen, at, pieces[static_cast<std::size_t>(piece)].id.value));
    } catch (const SQLite::Exception& refused) {
      return refused.what();
    }
    return "";
  };
  EXPECT_THAT(say_again(1, "max"), HasSubstr("UNIQUE"));
  EXPECT_THAT(say_again(2, "max"), HasSubstr("a verdict is of a piece")) << "the machine said that it is cut";
  VENEER_ASSERT_OK(execute(cell.database(),
                           fmt::format("UPDATE allocations SET state = 'scrap' WHERE piece = {}", pieces[2].id.value)));
  EXPECT_THAT(say_again(2, "max", 1), HasSubstr("a verdict is of a piece")) << "a scan saw nothing of what was cut";
  EXPECT_THAT(say_again(2, "max", 0, "'t'"), HasSubstr("a verdict is of a piece")) << "that was at another time";
  EXPECT_EQ(say_again(2, "max"), "");
  VENEER_ASSERT_OK(jobs.settle(pieces[0].id, AllocationState::kScrap, kLater, "user anna"));
  EXPECT_THAT(say_again(0, "min"), HasSubstr("a verdict is of a piece")) << "something became of it since";
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

TEST_F(JobStoreTest, RecoveryMakesCuttingPiecesSuspectAndAbortsTheJob) {
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

TEST_F(JobStoreTest, RecoveryCompletesAJobWhoseLastPieceWasBooked) {
  const RunId run = start(panel);
  for (const int i : {0, 1, 2}) cut(i);
  VENEER_ASSERT_OK(jobs.finish_run(run, true, kLater));
  start(other);
  cut(3);
  cell.reopen();
  EXPECT_THAT(must(jobs.recover(kLater)).completed_jobs, ElementsAre(job));
  EXPECT_EQ(state(), JobState::kComplete);
}

TEST_F(JobStoreTest, RecoveryLeavesAQuietDatabaseAlone) {
  const Recovery found = must(jobs.recover(kLater));
  EXPECT_THAT(found.suspects, IsEmpty());
  EXPECT_EQ(state(), JobState::kPlanned);
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
