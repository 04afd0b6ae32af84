#include "db/ledger.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>

#include <map>
#include <set>

#include "tests/db/stray_sql.h"

namespace veneer::db {
namespace {

using ::testing::HasSubstr;

class LedgerTest : public ::testing::Test {
 protected:
  CellDatabase cell;
  PanelId panel = cell.new_panel();
  SQLite::Database& sql() { return cell.database().connection(); }
  int rows(const std::string& table) { return sql().execAndGet("SELECT count(*) FROM " + table).getInt(); }
};

TEST_F(LedgerTest, RefusesOverlappingWood) {
  must(cell.jobs().create(job_of({square_piece("A1", panel, 10, 10, 14)}), kNow));
  const auto second = cell.jobs().create(job_of({square_piece("B1", panel, 20, 20, 14)}), kNow);
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, ErrorCode::kConflict);
  EXPECT_THAT(second.error().message, HasSubstr("piece B1"));
  EXPECT_THAT(second.error().message, HasSubstr("P-0001"));
  EXPECT_THAT(second.error().message, HasSubstr("plan again"));
}

TEST_F(LedgerTest, RefusesWoodInsideOtherWood) {
  must(cell.jobs().create(job_of({square_piece("A1", panel, 10, 10, 40)}), kNow));
  EXPECT_FALSE(cell.jobs().create(job_of({square_piece("B1", panel, 20, 20, 4)}), kNow).ok());
  EXPECT_FALSE(cell.jobs().create(job_of({square_piece("B1", panel, 0, 0, 100)}), kNow).ok());
}

TEST_F(LedgerTest, AllowsTouchingWood) {
  // The areas [10 - k, 24 + k] and [24 + k, ...] share a border.
  VENEER_EXPECT_OK(cell.jobs().create(
      job_of({square_piece("A1", panel, 10, 10, 14), square_piece("A2", panel, 24 + 2 * kSquareKerf, 10, 14)}), kNow));
  // One micrometre closer is an overlap.
  EXPECT_FALSE(
      cell.jobs().create(job_of({square_piece("B1", panel, 10, 24 + 2 * kSquareKerf - 0.001, 14)}), kNow).ok());
  VENEER_EXPECT_OK(cell.jobs().create(job_of({square_piece("B1", panel, 10, 24 + 2 * kSquareKerf, 14)}), kNow));
}

TEST_F(LedgerTest, AllowsTheSamePlaceOnAnotherPanel) {
  const PanelId other = cell.new_panel();
  VENEER_EXPECT_OK(
      cell.jobs().create(job_of({square_piece("A1", panel, 10, 10, 14), square_piece("A2", other, 10, 10, 14)}), kNow));
}

TEST_F(LedgerTest, AllowsWoodWhoseBoxesOverlapButNotTheShapes) {
  PlannedPatch lower = square_piece("A1", panel, 0, 0, 10), upper = square_piece("A2", panel, 0, 0, 10);
  lower.panel_outline = {point<PanelFrame>(1, 1), point<PanelFrame>(9, 1), point<PanelFrame>(1, 9),
                         point<PanelFrame>(1, 5)};
  upper.panel_outline = {point<PanelFrame>(10, 2), point<PanelFrame>(10, 10), point<PanelFrame>(2, 10),
                         point<PanelFrame>(6, 6)};
  for (PlannedPatch* piece : {&lower, &upper}) piece->allocation = Region<PanelFrame>(piece->panel_outline);
  VENEER_EXPECT_OK(cell.jobs().create(job_of({lower, upper}), kNow));
}

TEST_F(LedgerTest, RollsBackWholePlanWhenOnePieceIsTaken) {
  must(cell.jobs().create(job_of({square_piece("A1", panel, 200, 200, 14)}), kNow));
  std::vector<PlannedPatch> pieces;
  pieces.reserve(11);
  for (int i = 0; i < 10; ++i) pieces.push_back(square_piece(fmt::format("B{}", i), panel, 5 + 20 * i, 5, 14));
  pieces.push_back(square_piece("B10", panel, 205, 205, 14));
  const auto refused = cell.jobs().create(job_of(pieces), kNow);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, HasSubstr("B10"));
  EXPECT_EQ(rows("jobs"), 1);
  EXPECT_EQ(rows("pieces"), 1);
  EXPECT_EQ(rows("allocations"), 1);
  EXPECT_EQ(rows("allocation_boxes"), 1);
}

TEST_F(LedgerTest, RefusesAPlanThatOverlapsItself) {
  EXPECT_FALSE(cell.jobs()
                   .create(job_of({square_piece("A1", panel, 10, 10, 14), square_piece("A2", panel, 12, 12, 14)}), kNow)
                   .ok());
}

TEST_F(LedgerTest, RefusesWoodThatDoesNotHoldThePiece) {
  PlannedPatch piece = square_piece("A1", panel, 10, 10, 14);
  piece.allocation = offset(Region<PanelFrame>(piece.panel_outline), -0.3_mm);
  const auto refused = cell.jobs().create(job_of({piece}), kNow);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(refused.error().message, HasSubstr("A1"));
}

TEST_F(LedgerTest, ReleasedWoodIsFreeAgain) {
  const JobId job = must(cell.jobs().create(job_of({square_piece("A1", panel, 10, 10, 14)}), kNow));
  VENEER_ASSERT_OK(cell.jobs().cancel(job, kLater));
  EXPECT_TRUE(must(cell.ledger().live_allocations(panel)).empty());
  VENEER_EXPECT_OK(cell.jobs().create(job_of({square_piece("B1", panel, 12, 12, 14)}), kLater));
  const auto all = must(cell.ledger().allocations(panel, {0}, 10));
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].state, AllocationState::kReleased);
  EXPECT_EQ(all[0].changed_at, kLater);
  EXPECT_EQ(all[1].state, AllocationState::kReserved);
}

TEST_F(LedgerTest, ReturnsTheShapesItWasGiven) {
  const PlannedPatch piece = square_piece("A1", panel, 10.123, 20.456, 14);
  must(cell.jobs().create(job_of({piece}), kNow));
  const auto live = must(cell.ledger().live_allocations(panel));
  ASSERT_EQ(live.size(), 1U);
  EXPECT_EQ(live[0].area.micro_area().rings, piece.allocation.micro_area().rings);
  ASSERT_EQ(live[0].outline.size(), piece.panel_outline.size());
  for (std::size_t i = 0; i < piece.panel_outline.size(); ++i)
    EXPECT_LT(distance(live[0].outline[i], piece.panel_outline[i]), 0.0006_mm) << i;
  EXPECT_EQ(live[0].panel, panel);
}

TEST_F(LedgerTest, SaysWhatIsBookedAtAPlace) {
  must(cell.jobs().create(job_of({square_piece("A1", panel, 10, 10, 14)}), kNow));
  const PanelId other = cell.new_panel();
  must(cell.jobs().create(job_of({square_piece("B1", other, 10, 10, 14)}), kNow));
  const auto at = [&](double x, double y) {
    return must(cell.ledger().allocations_at(panel, point<PanelFrame>(x, y)));
  };
  ASSERT_EQ(at(12, 20).size(), 1U);
  EXPECT_EQ(at(12, 20)[0].panel, panel);
  EXPECT_EQ(at(10 - kSquareKerf / 2, 20).size(), 1U) << "in its kerf";
  EXPECT_TRUE(at(10 - 2 * kSquareKerf, 20).empty());
  EXPECT_TRUE(at(-1e300, 20).empty());
  VENEER_ASSERT_OK(cell.jobs().cancel({1}, kLater));
  EXPECT_TRUE(at(12, 20).empty()) << "given back";
}

TEST_F(LedgerTest, WritesOffWoodWithoutAJob) {
  VENEER_ASSERT_OK(cell.ledger().write_off(panel, Region<PanelFrame>(square(0, 0, 30)), "burnt pattern", kNow));
  const auto live = must(cell.ledger().live_allocations(panel));
  ASSERT_EQ(live.size(), 1U);
  EXPECT_EQ(live[0].state, AllocationState::kScrap);
  EXPECT_EQ(live[0].reason, "burnt pattern");
  EXPECT_EQ(live[0].piece, PieceId{});
  EXPECT_FALSE(cell.jobs().create(job_of({square_piece("A1", panel, 10, 10, 14)}), kNow).ok());
  EXPECT_FALSE(cell.ledger().write_off(panel, {}, "nothing", kNow).ok());
}

TEST_F(LedgerTest, AConnectionWithoutTheOverlapFunctionCannotInsert) {
  must(cell.jobs().create(job_of({square_piece("A1", panel, 10, 10, 14)}), kNow));
  SQLite::Database bare(cell.file().string(), SQLite::OPEN_READWRITE);
  EXPECT_THROW(bare.exec("INSERT INTO allocations (panel, state, area_um, reason, changed_at) VALUES "
                         "('P-0001', 'scrap', '[[[0,0],[9,0],[9,9]]]', '', '')"),
               SQLite::Exception);
}

TEST_F(LedgerTest, TheWoodOfAnAllocationNeverChanges) {
  must(cell.jobs().create(job_of({square_piece("A1", panel, 10, 10, 14)}), kNow));
  for (const char* statement : {"UPDATE allocations SET area_um = '[[[0,0],[9,0],[9,9]]]'",
                                "UPDATE allocations SET panel = 'P-0002'", "UPDATE patches SET mark = 'Z'",
                                "UPDATE placements SET panel_outline_um = '[]'", "UPDATE pieces SET patch = 2"}) {
    const Status changed = execute(cell.database(), statement);
    ASSERT_FALSE(changed.ok()) << statement;
    EXPECT_THAT(changed.error().message, ::testing::AnyOf(HasSubstr("never changes"), HasSubstr("never edited")));
  }
}

TEST_F(LedgerTest, AllocationsMustHaveWoodThatCanBeRead) {
  for (const char* area :
       {"[]", "", "[[[0,0],[9,0],[9,9]]", "[[[0,0],[9,0],[9,9]]]x", "[[[0,0],[9]]]", "{}", "~", "~0,0 9,0 0",
        "~0,0 9,0 0,9;", "~0,0 9,0 0,9x", "~0,0  9,0 0,9", "~900000000,0 900000000,0 0,9"})
    EXPECT_FALSE(execute(cell.database(), fmt::format("INSERT INTO allocations (panel, state, area_um, reason, "
                                                      "changed_at) VALUES ('P-0001', 'scrap', '{}', '', '')",
                                                      area))
                     .ok())
        << area;
  EXPECT_EQ(rows("allocations"), 0);
}

// Every pair of states, with the run open that cutting needs.
TEST_F(LedgerTest, StatesMoveOnlyAsAllowed) {
  const std::vector<std::string> states = {"reserved", "cutting", "cut", "suspect", "scrap", "released"};
  const std::set<std::pair<std::string, std::string>> allowed = {
      {"reserved", "cutting"}, {"reserved", "released"}, {"cutting", "cut"},      {"cutting", "suspect"},
      {"suspect", "cut"},      {"suspect", "scrap"},     {"suspect", "released"}, {"cut", "scrap"},
      {"reserved", "suspect"}, {"cut", "suspect"},       {"scrap", "suspect"}};
  const std::map<std::string, std::vector<std::string>> way = {{"reserved", {}},
                                                               {"cutting", {"cutting"}},
                                                               {"cut", {"cutting", "cut"}},
                                                               {"suspect", {"cutting", "suspect"}},
                                                               {"scrap", {"cutting", "suspect", "scrap"}},
                                                               {"released", {"released"}}};
  const JobId job = must(cell.jobs().create(job_of({square_piece("A1", panel, 10, 10, 14)}), kNow));
  must(cell.jobs().start_run(job, panel, {}, 0.05_mm, kNow));
  const auto attempt = [&](SQLite::Database& connection, const std::string& from, const std::string& to) {
    connection.exec("SAVEPOINT attempt");
    for (const auto& step : way.at(from)) connection.exec("UPDATE allocations SET state = '" + step + "'");
    bool moved = true;
    try {
      connection.exec("UPDATE allocations SET state = '" + to + "'");
    } catch (const SQLite::Exception&) {
      moved = false;
    }
    connection.exec("ROLLBACK TO attempt; RELEASE attempt");
    return moved;
  };
  VENEER_ASSERT_OK(in_transaction(cell.database(), [&](SQLite::Database& connection) -> Status {
    for (const auto& from : states)
      for (const auto& to : states)
        EXPECT_EQ(attempt(connection, from, to), allowed.count({from, to}) > 0) << from << " -> " << to;
    return Ok();
  }));
}

TEST_F(LedgerTest, NothingIsCutOutsideARunOnItsPanel) {
  const PanelId other = cell.new_panel();
  const JobId job = must(
      cell.jobs().create(job_of({square_piece("A1", panel, 10, 10, 14), square_piece("A2", other, 10, 10, 14)}), kNow));
  const auto pieces = must(cell.jobs().pieces(job));
  const Status early = cell.jobs().mark_cutting(pieces[0].id, kNow);
  ASSERT_FALSE(early.ok());
  EXPECT_THAT(early.error().message, HasSubstr("only while its job runs"));
  must(cell.jobs().start_run(job, panel, {}, 0.05_mm, kNow));
  VENEER_EXPECT_OK(cell.jobs().mark_cutting(pieces[0].id, kNow));
  EXPECT_FALSE(cell.jobs().mark_cutting(pieces[1].id, kNow).ok());
}

// Clipper throws beyond its range; nothing may be thrown through SQLite's own frames.
TEST_F(LedgerTest, ACoordinateOutOfThisWorldIsAnError) {
  must(cell.jobs().create(job_of({square_piece("A1", panel, 10, 10, 14)}), kNow));
  tamper(cell.file(),
         "DROP TRIGGER allocations_keep_their_wood; UPDATE allocations SET area_um = "
         "'[[[9000,9000],[9000,5000000000000000000],[24000,24000]]]'");
  const auto book = [&] { return cell.jobs().create(job_of({square_piece("B1", panel, 12, 12, 14)}), kNow); };
  const auto unchecked = book();
  ASSERT_FALSE(unchecked.ok());
  EXPECT_THAT(unchecked.error().message, HasSubstr("another program wrote to it"));
  cell.database().dispel(cell.database().doubts());  // as if a check had found nothing
  const auto refused = book();
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, HasSubstr("cannot be read"));
  EXPECT_EQ(rows("jobs"), 1);
  const auto live = cell.ledger().live_allocations(panel);
  ASSERT_FALSE(live.ok());
  EXPECT_EQ(live.error().code, ErrorCode::kStorage);
}

TEST_F(LedgerTest, TellsWhereWoodMovedSinceAStep) {
  const PanelId other = cell.new_panel();
  const auto changed = [&](std::int64_t after) { return must(cell.ledger().changes_after(after)); };
  EXPECT_EQ(changed(-1).newest, 0);
  must(
      cell.jobs().create(job_of({square_piece("A1", panel, 10, 10, 14), square_piece("A2", panel, 40, 10, 14)}), kNow));
  EXPECT_EQ(changed(0).panels, std::vector{panel});
  EXPECT_EQ(changed(0).newest, 2);
  EXPECT_TRUE(changed(-1).panels.empty());
  EXPECT_TRUE(changed(2).panels.empty());
  VENEER_ASSERT_OK(cell.ledger().write_off(other, Region<PanelFrame>(square(0, 0, 30)), "a knot", kNow));
  EXPECT_EQ(changed(2).panels, std::vector{other});
  VENEER_ASSERT_OK(cell.jobs().cancel({1}, kLater));
  EXPECT_EQ(changed(3).panels, std::vector{panel}) << "once, for both pieces";
  EXPECT_EQ(changed(0).panels.size(), 2U);
}

TEST_F(LedgerTest, AFullDiskLeavesEverythingTrue) {
  const JobId first = must(cell.jobs().create(job_of({square_piece("A1", panel, 10, 10, 14)}), kNow));
  std::vector<PlannedPatch> pieces;
  for (int row = 0; row < 20; ++row)
    for (int column = 0; column < 20; ++column)
      pieces.push_back(square_piece(fmt::format("B{}-{}", row, column), panel, 40 + 5 * column, 5 + 5 * row, 4));
  const int pages = sql().execAndGet("PRAGMA page_count").getInt();
  for (const int more : {0, 1, 2, 5, 10, 20, 40}) {
    VENEER_ASSERT_OK(cell.database().limit_pages_for_test(pages + more));
    const auto refused = cell.jobs().create(job_of(pieces), kNow);
    ASSERT_FALSE(refused.ok()) << more;
    EXPECT_EQ(refused.error().code, ErrorCode::kStorage);
    EXPECT_THAT(refused.error().message, HasSubstr("disk is full"));
    EXPECT_EQ(rows("jobs"), 1);
    EXPECT_EQ(rows("allocations"), 1);
    VENEER_EXPECT_OK(cell.database().check_integrity());
  }
  // Booking needs no new page, and goes on.
  VENEER_EXPECT_OK(cell.jobs().cancel(first, kLater));
  VENEER_ASSERT_OK(cell.database().limit_pages_for_test(100000));
  VENEER_EXPECT_OK(cell.jobs().create(job_of(pieces), kNow));
}

}  // namespace
}  // namespace veneer::db
