// Which jobs people are shown: those that are not archived, and of those the ones with something to do.
#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>

#include "tests/db/planned_job.h"

namespace veneer::db {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class JobsInSight : public PlannedJob {
 protected:
  std::vector<JobId> with_work() {
    std::vector<JobId> out;
    for (const JobWork& work : must(jobs.with_work())) out.push_back(work.id);
    return out;
  }
};

TEST_F(JobsInSight, OnlyAJobThatIsOverIsArchivedAndNothingOfItIsRemoved) {
  EXPECT_THAT(jobs.archive(job, true, kLater).error().message, HasSubstr("is planned, and only a job that is over"));
  const RunId run = start(panel);
  cut(0);
  VENEER_ASSERT_OK(jobs.finish_run(run, false, kLater));
  EXPECT_FALSE(jobs.archive(job, true, kLater).ok());
  VENEER_ASSERT_OK(jobs.cancel(job, kLater));
  VENEER_ASSERT_OK(jobs.archive(job, true, kLater));
  VENEER_ASSERT_OK(jobs.archive(job, true, kLater));  // twice is once
  EXPECT_TRUE(must(jobs.find(job)).archived);
  EXPECT_EQ(must(jobs.list()).size(), 1U);
  EXPECT_TRUE(must(jobs.list({0}, 10, false)).empty());
  EXPECT_EQ(must(jobs.pieces(job)).size(), 5U);
  EXPECT_FALSE(jobs.archive(JobId{99}, true, kLater).ok());

  VENEER_ASSERT_OK(jobs.archive(job, false, kLater));
  EXPECT_EQ(must(jobs.list({0}, 10, false)).size(), 1U);
}

TEST_F(JobsInSight, AnArchivedJobComesBackWhenSomethingIsToBeDoneForIt) {
  const RunId run = start(panel);
  cut(0);
  VENEER_ASSERT_OK(jobs.finish_run(run, false, kLater));
  VENEER_ASSERT_OK(jobs.cancel(job, kLater));
  VENEER_ASSERT_OK(jobs.archive(job, true, kLater));
  VENEER_ASSERT_OK(jobs.make_suspect({{pieces[0].id}}, kLater));  // another job's beam strayed
  EXPECT_FALSE(must(jobs.find(job)).archived);
  EXPECT_THAT(jobs.archive(job, true, kLater).error().message, HasSubstr("has suspect pieces"));
  EXPECT_TRUE(must(jobs.archive_done(kLater)).empty());
  VENEER_ASSERT_OK(jobs.settle(pieces[0].id, AllocationState::kCut, kLater, "user anna"));
  EXPECT_THAT(must(jobs.archive_done(kLater)), ElementsAre(job));
  EXPECT_TRUE(must(jobs.archive_done(kLater)).empty()) << "none was left in sight";
  must(jobs.redo(job, made_again({square_piece("A5", other, 40, 40, 14)}), kLater));
  EXPECT_FALSE(must(jobs.find(job)).archived);
}

// Somebody still has to find wood for it.
TEST_F(JobsInSight, AnIncompleteJobIsNotArchivedWithThoseThatAreDone) {
  const RunId run = start(panel);
  cut(0), cut(1), cut(2);
  VENEER_ASSERT_OK(jobs.finish_run(run, true, kLater));
  cut_on_other();
  ASSERT_EQ(state(), JobState::kComplete);
  EXPECT_TRUE(must(jobs.archive_done(kLater)).empty()) << "A5 has no wood";
  VENEER_EXPECT_OK(jobs.archive(job, true, kLater));
}

TEST_F(JobsInSight, WorkIsLeftWherePiecesAreReservedBeingCutOrSuspect) {
  EXPECT_THAT(with_work(), ElementsAre(job));
  const JobWork planned = must(jobs.with_work()).front();
  EXPECT_EQ(planned.open, 4) << "A5 has no wood";
  EXPECT_EQ(planned.suspect, 0);
  EXPECT_EQ(planned.state, JobState::kPlanned);
  const JobId second = must(jobs.create(job_of({square_piece("B1", panel, 70, 10, 14)}), kNow));
  EXPECT_THAT(with_work(), ElementsAre(job, second));
  VENEER_ASSERT_OK(jobs.cancel(job, kLater));
  EXPECT_THAT(with_work(), ElementsAre(second));

  pieces = must(jobs.pieces(second));
  const RunId run = must(jobs.start_run(second, panel, kPose, 0.04_mm, kLater));
  VENEER_ASSERT_OK(jobs.mark_cutting(pieces[0].id, kLater));
  EXPECT_THAT(with_work(), ElementsAre(second));
  VENEER_ASSERT_OK(jobs.book_piece(pieces[0].id, kLater));
  VENEER_ASSERT_OK(jobs.finish_run(run, true, kLater));
  EXPECT_THAT(with_work(), ElementsAre());
  VENEER_ASSERT_OK(jobs.archive(second, true, kLater));
  VENEER_ASSERT_OK(jobs.make_suspect({{pieces[0].id}}, kLater));
  EXPECT_THAT(with_work(), ElementsAre(second)) << "it came back into sight";
  EXPECT_EQ(must(jobs.with_work()).front().open, 0);
  EXPECT_EQ(must(jobs.with_work()).front().suspect, 1);
}

// One that is cut again is what it is by its newest wood.
TEST_F(JobsInSight, ThePiecesToCutAndTheSuspectOnesAreCounted) {
  const RunId run = start(panel);
  cut(0);
  VENEER_ASSERT_OK(jobs.mark_cutting(pieces[1].id, kNow));
  VENEER_ASSERT_OK(jobs.make_suspect({{pieces[0].id}}, kNow));
  const auto counted = [this] {
    const JobWork work = must(jobs.with_work()).front();
    return std::pair(work.open, work.suspect);
  };
  EXPECT_EQ(counted(), std::pair(3, 1)) << "one of the three is being cut";
  VENEER_ASSERT_OK(jobs.book_piece(pieces[1].id, kNow));
  VENEER_ASSERT_OK(jobs.finish_run(run, false, kLater));
  VENEER_ASSERT_OK(jobs.settle(pieces[0].id, AllocationState::kScrap, kLater, "user anna"));
  EXPECT_EQ(counted(), std::pair(2, 0));
  must(jobs.redo(job, made_again({square_piece("A1", other, 60, 60, 14)}), kLater));
  EXPECT_EQ(counted(), std::pair(3, 0));
}

// It is asked for at each change of the cell's state, among a million pieces that are over.
TEST_F(JobsInSight, WorkIsFoundWithoutAWalkThroughAllPieces) {
  const auto pages = [this] { return cell.pages_for([this] { must(jobs.with_work()); }); };
  const int before = pages();
  std::vector<PlannedPatch> many;
  for (int i = 0; i < 40; ++i) {
    const int column = i % 8, row = i / 8;
    many.push_back(square_piece("B" + std::to_string(i), other, 40 + 8 * column, 40 + 8 * row, 5));
  }
  const JobId second = must(jobs.create(job_of(many), kNow));
  EXPECT_LT(pages() - before, 20) << "not a page and more for each of its 40 pieces, but their index";
  VENEER_ASSERT_OK(jobs.cancel(second, kLater));
  EXPECT_LE(pages(), before);
}

}  // namespace
}  // namespace veneer::db
