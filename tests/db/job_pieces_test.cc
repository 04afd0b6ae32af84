#include "db/job_store.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>

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

class JobPiecesTest : public PlannedJob {};

TEST_F(JobPiecesTest, TellsWhatBecameOfAPieceStepByStep) {
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
TEST_F(JobPiecesTest, AWalkThroughAllPiecesIsCounted) {
  Database& database = cell.database();
  const auto walk = [&] { texts(database.connection(), "SELECT checksum FROM pieces"); };
  EXPECT_GT(rows_scanned_by(database, walk), 3);
  EXPECT_EQ(statements_of(database, walk), 1);
}

// There are a million pieces, and the one that is asked for may be an old one.
TEST_F(JobPiecesTest, OfOnePieceNothingElseIsRead) {
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
TEST_F(JobPiecesTest, OfKeptCutsNoOtherHistoryIsRead) {
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

TEST_F(JobPiecesTest, WhatAScanSawOfASuspectPieceIsKeptUntilSomebodyDecides) {
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

TEST_F(JobPiecesTest, APieceIsTickedOffOnceItIsCutAndUntilItIsMadeAgain) {
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

TEST_F(JobPiecesTest, FindsAPieceByItsMark) {
  const PieceRecord found = must(jobs.find_piece(job, "A3"));
  EXPECT_EQ(found.id, pieces[2].id);
  EXPECT_EQ(found.placed_by, must(jobs.find(job)).plan);
  EXPECT_THAT(jobs.find_piece(job, "Z9").error().message,
              HasSubstr("job 1 has no piece Z9: see `veneerctl job pieces 1`"));
  EXPECT_THAT(jobs.find_piece({77}, "A3").error().message, HasSubstr("there is no job 77"));
}

TEST_F(JobPiecesTest, ALostPieceIsMadeAgainUnderItsNumber) {
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
TEST_F(JobPiecesTest, WhoGivesUpAPieceThatIsCutIsKept) {
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

TEST_F(JobPiecesTest, NothingIsMadeAgainThatHasItsWood) {
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

TEST_F(JobPiecesTest, RemembersWhereACutBeginsInWaste) {
  PlannedPatch led = square_piece("B1", panel, 100, 10, 14);
  led.lead_in = point<PanelFrame>(114.8, 24.8);
  led.allocation = unite(led.allocation, Region<PanelFrame>(square(114, 24, 1)));
  const JobId second = must(jobs.create(job_of({led}), kNow));
  EXPECT_EQ(must(jobs.pieces(second))[0].lead_in, led.lead_in);
  // Its wood is the piece's.
  EXPECT_FALSE(jobs.create(job_of({square_piece("C1", panel, 114.6, 24.6, 14)}), kNow).ok());
}

TEST_F(JobPiecesTest, PieceIdsAreGlobal) {
  const JobId second = must(jobs.create(job_of({square_piece("A1", panel, 200, 10, 14)}), kNow));
  EXPECT_GT(must(jobs.pieces(second))[0].id, pieces.back().id);
  EXPECT_EQ(must(jobs.find_piece(pieces[2].id)).mark, "A3");
}

TEST_F(JobPiecesTest, SettlingNeedsASuspectPieceAndAVerdict) {
  EXPECT_FALSE(jobs.settle(pieces[0].id, AllocationState::kCut, kNow, "user anna").ok());
  const RunId run = start(panel);
  VENEER_ASSERT_OK(jobs.mark_cutting(pieces[0].id, kNow));
  VENEER_ASSERT_OK(jobs.abort_run(run, {}, "power", kLater));
  EXPECT_FALSE(jobs.settle(pieces[0].id, AllocationState::kReserved, kNow, "user anna").ok());
  VENEER_EXPECT_OK(jobs.settle(pieces[0].id, AllocationState::kCut, kNow, "user anna"));
  EXPECT_EQ(state(), JobState::kAborted);
}

// Who said what of which piece, and when.
TEST_F(JobPiecesTest, WhatPeopleSayOfSuspectPiecesIsKept) {
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

}  // namespace
}  // namespace veneer::db
