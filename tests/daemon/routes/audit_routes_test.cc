// The audit log is asked for by words, kind, job and time, a page at a time.
#include <gmock/gmock.h>

#include "db/audit.h"
#include "tests/support/routed_cell.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

class AuditRoutes : public testing::RoutedCell {
 protected:
  void SetUp() override {
    const Status noted = cell->database->call([](Repositories& r) -> Status {
      for (const db::AuditEntry& row : std::vector<db::AuditEntry>{
               {0, "2026-05-01T07:00:00.000Z", "uid 1000", "job.start", "1"},
               {0, "2026-05-01T07:01:00.000Z", "veneerd", "run.start", "run 3 of job 1 on P-0001"},
               {0, "2026-05-02T07:02:00.000Z", "anna", "api.cancelJob", "POST /api/v1/jobs/12/cancel"},
               {0, "2026-05-02T07:03:00.000Z", "veneerd", "run.end", "run 4 of job 12 on P-0002, done"},
               {0, "2026-05-03T07:04:00.000Z", "veneerd", "alarm.new", "The lid is open 100 % of 50_days"}})
        if (Status done = r.audit.append(row); !done) return done;
      return Ok();
    });
    ASSERT_TRUE(noted.ok()) << noted.error().message;
  }
  // The details of what is found of May 2026; newest first.
  std::vector<std::string> found(const std::string& query) {
    std::vector<std::string> out;
    const json page = body_of(ask("GET", "/api/v1/audit?until=2026-05-31&" + query));
    for (const json& row : page["entries"]) out.push_back(row["detail"]);
    return out;
  }
};

TEST_F(AuditRoutes, AreFoundByTheirWords) {
  EXPECT_THAT(found("text=P-0001"), ElementsAre("run 3 of job 1 on P-0001"));
  EXPECT_THAT(found("text=LID%20open"), ElementsAre("The lid is open 100 % of 50_days"));
  EXPECT_THAT(found("text=anna%20cancel"), ElementsAre("POST /api/v1/jobs/12/cancel")) << "of who and what as well";
  EXPECT_THAT(found("text=lid%20closed"), IsEmpty()) << "every word";
  EXPECT_THAT(found("text=%25"), ElementsAre("The lid is open 100 % of 50_days")) << "no pattern";
  EXPECT_THAT(found("text=0_d"), ElementsAre("The lid is open 100 % of 50_days"));
}

TEST_F(AuditRoutes, AreFoundByKindJobAndTime) {
  EXPECT_THAT(found("kind=run"), ElementsAre("run 4 of job 12 on P-0002, done", "run 3 of job 1 on P-0001"));
  EXPECT_THAT(found("kind=ru"), IsEmpty());
  EXPECT_THAT(found("job=1"), ElementsAre("run 3 of job 1 on P-0001", "1")) << "and not of job 12";
  EXPECT_THAT(found("job=12"), ElementsAre("run 4 of job 12 on P-0002, done", "POST /api/v1/jobs/12/cancel"));
  EXPECT_THAT(found("job=2"), IsEmpty());
  EXPECT_THAT(found("since=2026-05-03"), ElementsAre("The lid is open 100 % of 50_days"));
  const json before = body_of(ask("GET", "/api/v1/audit?until=2026-05-01T07:01"));
  ASSERT_EQ(before["entries"].size(), 1U) << "what came at that time is not before it";
  EXPECT_EQ(before["entries"][0]["what"], "job.start");
}

TEST_F(AuditRoutes, GoOnFromPageToPage) {
  const json first = body_of(ask("GET", "/api/v1/audit?kind=run&limit=1"));
  ASSERT_TRUE(first["next"].is_number());
  const json second = body_of(ask("GET", "/api/v1/audit?kind=run&limit=1&cursor=" + first["next"].dump()));
  EXPECT_EQ(second["entries"][0]["detail"], "run 3 of job 1 on P-0001");
  EXPECT_TRUE(second["next"].is_null());
}

TEST_F(AuditRoutes, RefuseWhatIsNoFilter) {
  for (const char* query : {"kind=run.end", "kind=%25", "job=0", "job=x", "until=yesterday",
                            "text=1%202%203%204%205%206%207%208%209%2010%2011"})
    EXPECT_EQ(ask("GET", std::string("/api/v1/audit?") + query).status, 400) << query;
}

}  // namespace
}  // namespace veneer::daemon
