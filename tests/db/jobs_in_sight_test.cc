// Which jobs people are shown: those that are not archived, and of those the ones with something to do.
#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sqlite3.h>

#include <tuple>

#include "tests/db/planned_job.h"
#include "tests/db/stray_sql.h"

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

// The one that is cut next is what people say it is; what nobody spoke of stands behind, by number.
TEST_F(JobsInSight, PeopleChooseInWhichOrderJobsWait) {
  std::vector<JobId> more;
  for (int i = 0; i < 3; ++i)
    more.push_back(must(jobs.create(job_of({square_piece("B1", panel, 70 + 20 * i, 40, 14)}), kNow)));
  const auto [second, third, fourth] = std::tuple(more[0], more[1], more[2]);
  EXPECT_THAT(with_work(), ElementsAre(job, second, third, fourth));
  EXPECT_THAT(must(jobs.put_before(third, job, "user anna", kLater)), ElementsAre(third, job, second, fourth));
  EXPECT_THAT(with_work(), ElementsAre(third, job, second, fourth));
  EXPECT_THAT(must(jobs.put_before(job, std::nullopt, "user anna", kLater)), ElementsAre(third, second, fourth, job));
  const JobId late = must(jobs.create(job_of({square_piece("B1", panel, 150, 40, 14)}), kNow));
  EXPECT_THAT(must(jobs.queue()), ElementsAre(third, second, fourth, job, late));

  const auto noted = [this] {
    return cell.database().connection().execAndGet("SELECT count(*) FROM queue_orders").getInt();
  };
  const int at_first = noted();
  EXPECT_THAT(must(jobs.put_before(third, second, "user anna", kLater)), ElementsAre(third, second, fourth, job, late));
  EXPECT_EQ(noted(), at_first) << "it stands there already";

  VENEER_ASSERT_OK(jobs.cancel(second, kLater));
  EXPECT_THAT(must(jobs.queue()), ElementsAre(third, fourth, job, late));
  for (const auto& [moved, before_whom] : {std::pair(second, job), std::pair(job, second)})
    EXPECT_THAT(jobs.put_before(moved, before_whom, "user anna", kLater).error().message,
                HasSubstr("job 2 is cancelled and has no piece to cut"));
  EXPECT_EQ(jobs.put_before(job, job, "user anna", kLater).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(jobs.put_before(job, JobId{99}, "user anna", kLater).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(jobs.put_before(JobId{99}, job, "user anna", kLater).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(noted(), at_first);
}

// It is under the laser: none can be put before it, and it is not the next. It keeps its place until it is stopped.
TEST_F(JobsInSight, AJobThatIsBeingCutDoesNotWait) {
  const JobId second = must(jobs.create(job_of({square_piece("B1", panel, 70, 40, 14)}), kNow));
  const JobId third = must(jobs.create(job_of({square_piece("B1", panel, 90, 40, 14)}), kNow));
  EXPECT_THAT(must(jobs.put_before(third, second, "user anna", kLater)), ElementsAre(job, third, second));
  const RunId run = start(panel);
  EXPECT_THAT(must(jobs.queue()), ElementsAre(third, second));
  for (const auto& [moved, before] : {std::pair(second, std::optional(job)), std::pair(job, std::optional(second)),
                                      std::pair(job, std::optional<JobId>())}) {
    const auto put = jobs.put_before(moved, before, "user anna", kLater);
    ASSERT_EQ(put.error().code, ErrorCode::kConflict);
    EXPECT_THAT(put.error().message, HasSubstr("job 1 is being cut"));
  }
  EXPECT_THAT(must(jobs.put_before(second, third, "user anna", kLater)), ElementsAre(second, third));
  cut(0);
  VENEER_ASSERT_OK(jobs.finish_run(run, false, kLater));
  EXPECT_THAT(must(jobs.queue()), ElementsAre(job, second, third)) << "where it stood";
}

// What others do meanwhile takes its place from none that comes back.
TEST_F(JobsInSight, AJobWithSuspectPiecesAloneKeepsItsPlace) {
  const JobId second = must(jobs.create(job_of({square_piece("B1", other, 70, 40, 14)}), kNow));
  const JobId third = must(jobs.create(job_of({square_piece("B1", other, 90, 40, 14)}), kNow));
  EXPECT_THAT(must(jobs.put_before(second, job, "user anna", kLater)), ElementsAre(second, job, third));
  pieces = must(jobs.pieces(second));
  const RunId run = must(jobs.start_run(second, other, kPose, 0.04_mm, kLater));
  VENEER_ASSERT_OK(jobs.mark_cutting(pieces[0].id, kLater));
  VENEER_ASSERT_OK(jobs.book_piece(pieces[0].id, kLater));
  VENEER_ASSERT_OK(jobs.finish_run(run, false, kLater));
  VENEER_ASSERT_OK(jobs.make_suspect({{pieces[0].id}}, kLater));
  EXPECT_THAT(must(jobs.queue()), ElementsAre(job, third));
  EXPECT_THAT(must(jobs.put_before(third, job, "user anna", kLater)), ElementsAre(third, job));
  const JobId late = must(jobs.create(job_of({square_piece("B1", other, 110, 40, 14)}), kNow));
  VENEER_ASSERT_OK(jobs.settle(pieces[0].id, AllocationState::kReleased, kLater, "user anna"));
  must(jobs.redo(second, made_again({square_piece("B1", other, 70, 40, 14)}), kLater));
  EXPECT_THAT(must(jobs.queue()), ElementsAre(second, third, job, late));
}

// One that was over stands where the newest order names it; one that came later stands behind, as if it were new.
TEST_F(JobsInSight, AJobThatWasOverComesBackToThePlaceThatTheNewestOrderGivesIt) {
  const JobId second = must(jobs.create(job_of({square_piece("B1", other, 70, 40, 14)}), kNow));
  const JobId third = must(jobs.create(job_of({square_piece("B1", other, 90, 40, 14)}), kNow));
  EXPECT_THAT(must(jobs.put_before(third, job, "user anna", kLater)), ElementsAre(third, job, second));
  VENEER_ASSERT_OK(jobs.cancel(job, kLater));
  const auto again = [this] { must(jobs.redo(job, made_again({square_piece("A5", other, 40, 40, 14)}), kLater)); };
  again();
  EXPECT_THAT(must(jobs.queue()), ElementsAre(third, job, second));
  VENEER_ASSERT_OK(jobs.cancel(job, kLater));
  EXPECT_THAT(must(jobs.put_before(second, third, "user anna", kLater)), ElementsAre(second, third)) << "without it";
  again();
  EXPECT_THAT(must(jobs.queue()), ElementsAre(second, third, job));
}

// It is read for each page of jobs, and at each change of the cell's state.
TEST_F(JobsInSight, TheOrderIsReadInStepsThatGrowAsTheQueueDoes) {
  std::vector<JobId> all{job};
  const auto steps_for = [&](int count) {
    while (static_cast<int>(all.size()) < count) {
      const int column = static_cast<int>(all.size()) % 20, row = static_cast<int>(all.size()) / 20;
      all.push_back(must(jobs.create(job_of({square_piece("B1", other, 10 + 4 * column, 40 + 4 * row, 2)}), kNow)));
    }
    must(jobs.put_before(all.back(), job, "user anna", kLater));
    must(jobs.put_before(all.back(), std::nullopt, "user anna", kLater));
    int steps = 0;
    const auto count_one = [](void* told) { return ++*static_cast<int*>(told), 0; };
    sqlite3_progress_handler(cell.database().connection().getHandle(), 1, count_one, &steps);
    EXPECT_EQ(must(jobs.queue()).size(), all.size());
    sqlite3_progress_handler(cell.database().connection().getHandle(), 0, nullptr, nullptr);
    return steps;
  };
  const int few = steps_for(30), many = steps_for(120);
  EXPECT_GT(few, 30);
  EXPECT_LT(many, 6 * few) << "of four times as many jobs";
}

// Whoever writes to the file by hand.
TEST_F(JobsInSight, AnOrderNamesJobsThatThereAreAndEachOnce) {
  for (const char* jobs_said : {"[1,1]", "[1,9]", "[]", "none", R"(["1",1])", R"(["1"])", "[1.0]", R"({"a":1})", "1"})
    EXPECT_FALSE(execute(cell.database(), fmt::format("INSERT INTO queue_orders (job, jobs, who, at) VALUES (1, '{}', "
                                                      "'x', 't')",
                                                      jobs_said))
                     .ok())
        << jobs_said;
  VENEER_ASSERT_OK(
      execute(cell.database(), "INSERT INTO queue_orders (job, jobs, who, at) VALUES (1, '[1]', 'x', 't')"));
  EXPECT_FALSE(execute(cell.database(), "UPDATE queue_orders SET jobs = '[]'").ok());
  EXPECT_FALSE(execute(cell.database(), "DELETE FROM queue_orders").ok());
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
