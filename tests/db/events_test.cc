// What happened, in one list: what is looked at to tell it.
#include "db/events.h"

#include <gmock/gmock.h>

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
  for (int i = 0; i < 20; ++i)
    must(cell.jobs().create(job_of({square_piece("A1", panel, 10 + 16 * i, 10, 14)}), kNow));
  const JobId last = must(cell.jobs().create(job_of({square_piece("A1", other, 10, 10, 14)}), kNow));
  const PieceId piece = must(cell.jobs().pieces(last)).at(0).id;
  for (const EventFilter& one : {EventFilter{.panel = other}, EventFilter{.job = last}, EventFilter{.piece = piece}}) {
    std::size_t told = 0;
    const int scanned =
        rows_scanned_by(cell.database(), [&] { told = must(events.read(one, {}, 100)).size(); });
    EXPECT_GE(told, 1U);
    EXPECT_LT(scanned, 20) << "of " << (one.panel ? "a panel" : one.job ? "a job" : "a piece");
  }
  EXPECT_TRUE(must(events.read({.job = JobId{1}, .piece = piece}, {}, 100)).empty()) << "it is of another job";
  EXPECT_TRUE(must(events.read({.piece = PieceId{99}}, {}, 100)).empty());
}

}  // namespace
}  // namespace veneer::db
