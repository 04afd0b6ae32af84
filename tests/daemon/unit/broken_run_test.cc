// The end of a run in the database: what is its last word, and what has to be tried again.
#include "daemon/unit/broken_run.h"

#include <gmock/gmock.h>

#include "tests/db/stray_sql.h"

namespace veneer::daemon {
namespace {

using ::testing::HasSubstr;

const std::string kBegun = "2026-05-01T07:31:07.777Z";

class BrokenRunTest : public ::testing::Test {
 protected:
  void SetUp() override {
    auto jobs = cell.jobs();
    const PanelId oak = cell.new_panel();
    const JobId job = db::must(jobs.create(
        db::job_of({db::square_piece("A1", oak, 20, 20, 14), db::square_piece("A2", oak, 60, 20, 14)}), db::kNow));
    piece = db::must(jobs.pieces(job)).front().id;
    run.id = db::must(jobs.start_run(job, oak, Isometry2<BedFrame, PanelFrame>(), 0.04_mm, db::kNow));
    run.pose.panel = oak;
    run.suspects = {piece};
    run.reason = "STOP by the operator";
    VENEER_ASSERT_OK(jobs.mark_cutting(piece, kBegun));
  }

  db::CellDatabase cell;
  PieceId piece;
  BrokenRun run;
};

TEST_F(BrokenRunTest, IsWrittenOnceAndForAll) {
  Repositories repositories(cell.database());
  EXPECT_TRUE(is_written(write_down(repositories, run, db::kLater)));
  EXPECT_EQ(db::must(cell.jobs().find_piece(piece)).state, db::PieceState::kSuspect);
  EXPECT_TRUE(is_written(write_down(repositories, run, db::kLater))) << "that run has ended";
}

// The row of the piece that was being cut is not what was written: the database refuses to end the run.
TEST_F(BrokenRunTest, IsNotWrittenWhileARowThatItNeedsIsDamaged) {
  { const db::Database closed = std::move(cell.database()); }
  ASSERT_NO_FATAL_FAILURE(db::damage_unseen(cell.file(), kBegun, "2027" + kBegun.substr(4)));
  cell.reopen();
  Repositories repositories(cell.database());
  const auto written = write_down(repositories, run, db::kLater);
  ASSERT_FALSE(written.ok());
  EXPECT_EQ(written.error().code, ErrorCode::kStorage);
  EXPECT_THAT(written.error().message, HasSubstr("is damaged"));
  EXPECT_THAT(written.error().message, HasSubstr("put a backup in its place"));
  EXPECT_FALSE(is_written(written));
  EXPECT_EQ(db::must(cell.jobs().find_piece(piece)).state, db::PieceState::kCutting);
}

TEST(BrokenRun, IsNotWrittenWhileTheDatabaseIsBusyOrTheDiskFull) {
  EXPECT_FALSE(is_written(Error{ErrorCode::kUnavailable, "the database is busy: another program holds it"}));
  EXPECT_FALSE(is_written(Error{ErrorCode::kStorage, "the disk is full"}));
  EXPECT_FALSE(is_written(Error{ErrorCode::kInternal, "out of memory"}));
  EXPECT_TRUE(is_written(Error{ErrorCode::kConflict, "run 7 is not on"}));
  EXPECT_TRUE(is_written(3));
}

}  // namespace
}  // namespace veneer::daemon
