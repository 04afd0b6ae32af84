#include "db/request_keys.h"

#include <gmock/gmock.h>

#include "tests/db/cell_database.h"

namespace veneer::db {
namespace {

using ::testing::HasSubstr;

class RequestKeysTest : public ::testing::Test {
 protected:
  void make_its_job() {
    must(cell.jobs().create(job_of({square_piece("A1", cell.new_panel(), 10, 10, 14)}), kNow, request));
  }

  CellDatabase cell;
  RequestKeys keys{cell.database()};
  const KeyedRequest request{"local:1000", "newJob", "k-1", "hash"};
};

TEST_F(RequestKeysTest, ANewKeyIsOursAndASecondRequestFindsTheFirst) {
  EXPECT_EQ(must(keys.begin(request, kNow)), std::nullopt);
  const auto under_way = must(keys.begin(request, kNow));
  ASSERT_TRUE(under_way);
  EXPECT_EQ(under_way->result, std::nullopt);
  make_its_job();
  EXPECT_EQ(must(keys.begin(request, kLater))->result, "{\"job\":1}");
}

TEST_F(RequestKeysTest, OutliveARestart) {
  must(keys.begin(request, kNow));
  make_its_job();
  cell.reopen();
  EXPECT_EQ(must(keys.begin(request, kLater))->result, "{\"job\":1}");
}

TEST_F(RequestKeysTest, AKeyIsForOneRequestOnly) {
  must(keys.begin(request, kNow));
  KeyedRequest other = request;
  other.request_hash = "another picture";
  const auto refused = keys.begin(other, kNow);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kConflict);
  EXPECT_THAT(refused.error().message, HasSubstr("k-1"));
}

TEST_F(RequestKeysTest, OfOthersAndOtherOperationsDoNotMeet) {
  must(keys.begin(request, kNow));
  EXPECT_EQ(must(keys.begin({"local:1001", "newJob", "k-1", "hash"}, kNow)), std::nullopt);
  EXPECT_EQ(must(keys.begin({"local:1000", "newPlan", "k-1", "hash"}, kNow)), std::nullopt);
}

TEST_F(RequestKeysTest, ARefusedRequestGivesItsKeyBackButNotOneThatDidSomething) {
  must(keys.begin(request, kNow));
  VENEER_ASSERT_OK(keys.forget(request));
  EXPECT_EQ(must(keys.begin(request, kNow)), std::nullopt);
  make_its_job();
  VENEER_ASSERT_OK(keys.forget(request));
  EXPECT_EQ(must(keys.begin(request, kNow))->result, "{\"job\":1}");
}

TEST_F(RequestKeysTest, OldOnesAreDropped) {
  must(keys.begin(request, kNow));
  must(keys.begin({"local:1000", "newJob", "k-2", "hash"}, kLater));
  EXPECT_EQ(must(keys.prune(kLater)), 1);
  EXPECT_EQ(must(keys.begin(request, kLater)), std::nullopt);
  EXPECT_NE(must(keys.begin({"local:1000", "newJob", "k-2", "hash"}, kLater)), std::nullopt);
}

TEST_F(RequestKeysTest, OneRequestMakesOneJob) {
  const PanelId panel = cell.new_panel();
  NewPlan job = job_of({square_piece("A1", panel, 10, 10, 14)});
  EXPECT_FALSE(cell.jobs().create(job, kNow, request).ok()) << "never begun";
  must(keys.begin(request, kNow));
  const JobId made = must(cell.jobs().create(job, kNow, request));
  EXPECT_EQ(must(keys.begin(request, kNow))->result, fmt::format("{{\"job\":{}}}", made.value));
  job.pieces = {square_piece("A1", panel, 100, 10, 14)};
  const auto again = cell.jobs().create(job, kNow, request);
  ASSERT_FALSE(again.ok());
  EXPECT_EQ(again.error().code, ErrorCode::kConflict);
  EXPECT_EQ(must(cell.jobs().list()).size(), 1U);
}

}  // namespace
}  // namespace veneer::db
