// What happened, in one list: what is looked at to tell it.
#include "db/events.h"

#include <gmock/gmock.h>

#include <regex>
#include <set>

#include "db/leases.h"
#include "tests/db/counted_statements.h"
#include "tests/db/planned_job.h"

namespace veneer::db {
namespace {

class EventsTest : public ::testing::Test {
 protected:
  CellDatabase cell;
  PanelId panel = cell.new_panel();
  Events events{cell.database()};
};

// The ledger of a cell that has cut for years has millions of rows.
TEST_F(EventsTest, OfAJobAPanelOrAPieceNoRowOfOtherWoodIsLookedAt) {
  const PanelId other = cell.new_panel();
  for (int i = 0; i < 20; ++i) must(cell.jobs().create(job_of({square_piece("A1", panel, 10 + 16 * i, 10, 14)}), kNow));
  const JobId last = must(cell.jobs().create(job_of({square_piece("A1", other, 10, 10, 14)}), kNow));
  const PieceId piece = must(cell.jobs().pieces(last)).at(0).id;
  for (const EventFilter& one : {EventFilter{.panel = other}, EventFilter{.job = last}, EventFilter{.piece = piece}}) {
    std::size_t told = 0;
    const int scanned = rows_scanned_by(cell.database(), [&] { told = must(events.read(one, {}, 100)).size(); });
    EXPECT_GE(told, 1U);
    EXPECT_LT(scanned, 20) << "of " << (one.panel ? "a panel" : one.job ? "a job" : "a piece");
  }
  EXPECT_TRUE(must(events.read({.job = JobId{1}, .piece = piece}, {}, 100)).empty()) << "it is of another job";
  EXPECT_TRUE(must(events.read({.piece = PieceId{99}}, {}, 100)).empty());
}

TEST_F(EventsTest, APageBeginsInTheMiddleWithoutALookAtWhatWasBefore) {
  std::vector<PlannedPatch> many;
  for (int i = 0; i < 100; ++i) {
    const int row = i / 20;
    many.push_back(square_piece(fmt::format("A{}", i), panel, 5 + 10 * (i % 20), 5 + 10 * row, 8));
  }
  must(cell.jobs().create(job_of(many), kNow));
  must(cell.jobs().create(job_of({square_piece("B1", panel, 300, 10, 14)}), kLater));
  for (const EventPlace& after : {EventPlace{}, EventPlace{kLater, "job", 0, 2, ""}}) {
    const EventFilter late{.since = after.at.empty() ? kLater : ""};
    std::vector<EventRecord> told;
    const int scanned = rows_scanned_by(cell.database(), [&] { told = must(events.read(late, after, 100)); });
    EXPECT_EQ(told.back().kind, "wood");
    EXPECT_EQ(told.back().at, kLater);
    EXPECT_LT(scanned, 50);
  }
}

// A renewed lease goes to the time of its renewal, in between two pages too.
TEST_F(EventsTest, APageGoesOnBehindItsLastEventWhateverMovesBeforeIt) {
  Leases leases{cell.database()};
  const std::string next_week = "2026-05-08T07:30:00.000Z", then = "2026-05-09T07:30:00.000Z";
  std::vector<PlanId> plans;
  for (const double x : {10.0, 30.0, 50.0}) {
    plans.push_back(must(Plans(cell.database()).add(job_of({square_piece("A1", panel, x, 10, 14)}), kNow)));
    must(leases.take(plans.back(), "local:1000", kNow, next_week));
  }
  const auto first = must(events.read({.kind = "lease"}, {}, 1));
  ASSERT_EQ(first.size(), 1U);
  EXPECT_EQ(first[0].what, "lease of plan 1 until " + next_week);
  must(leases.take(plans[0], "local:1000", kLater, then));
  std::vector<std::string> rest;
  for (const EventRecord& event : must(events.read({.kind = "lease"}, place_of(first[0]), 10)))
    rest.push_back(event.what);
  EXPECT_THAT(rest, ::testing::ElementsAre("lease of plan 2 until " + next_week, "lease of plan 3 until " + next_week,
                                           "lease of plan 1 until " + then));
}

TEST_F(EventsTest, AreOfTheKindsThatTheViewHas) {
  SQLite::Database reading(cell.file().string(), SQLite::OPEN_READONLY);
  SQLite::Statement view(reading, "SELECT sql FROM sqlite_schema WHERE name = 'events'");
  ASSERT_TRUE(view.executeStep());
  const std::string sql = view.getColumn(0).getString();
  const std::regex kind("'([a-z]+)'(?: AS kind)?, [0-9]");
  std::set<std::string> of_view, of_list;
  for (std::sregex_iterator it(sql.begin(), sql.end(), kind), end; it != end; ++it) of_view.insert((*it)[1]);
  for (const std::string_view one : kEventKinds) of_list.emplace(one);
  EXPECT_EQ(of_view, of_list);
}

}  // namespace
}  // namespace veneer::db
