#include "cli/audit_log.h"

#include <gmock/gmock.h>

#include "tests/support/api_server.h"

namespace veneer::cli {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

const std::string kHash(64, 'a');

TEST(AuditLog, ARowIsALineAndTheHeadCanBeWrittenDown) {
  const json audit = {{"entries",
                       {{{"id", 18},
                         {"at", "2026-05-01T08:30:00.000Z"},
                         {"who", "veneerd"},
                         {"what", "run.end"},
                         {"detail", "run 1 of job 1 on P-0001, done"},
                         {"hash", kHash}},
                        {{"id", 9},
                         {"at", "2026-05-01T07:30:00.000Z"},
                         {"who", "uid 1000"},
                         {"what", "api.scan"},
                         {"detail", "POST /api/v1/scans {\n\"face\": 1}"},
                         {"hash", kHash}}}},
                      {"head", {{"id", 20}, {"hash", kHash}}},
                      {"next", nullptr}};
  EXPECT_EQ(render_audit(audit),
            "ROW  WHEN                      WHO       WHAT      DETAIL\n"
            " 18  2026-05-01T08:30:00.000Z  veneerd   run.end   run 1 of job 1 on P-0001, done\n"
            "  9  2026-05-01T07:30:00.000Z  uid 1000  api.scan  POST /api/v1/scans { \"face\": 1}\n"
            "\nHead of the log 20:" +
                kHash + "\nWritten down elsewhere, `veneerctl db check --audit-head` compares it.\n");
  EXPECT_EQ(render_audit({{"entries", json::array()}, {"head", {{"id", 0}, {"hash", nullptr}}}}),
            "Nothing like that is in the audit log.\n");
}

// A daemon whose log has 20 rows, each with the hash aaa...
class AuditHeads : public ::testing::Test {
 protected:
  Result<std::string> compare(const std::string& head) {
    return compare_audit_head(ApiClient({server.socket(), {}, 0}), head);
  }
  testing::ApiServer server{
      {}, {}, [](daemon::Router& router) {
        router.bind("getAudit", [](const daemon::ApiRequest& request, const daemon::Reply& reply) {
          const int last = std::min(std::stoi(request.query.at("cursor")) - 1, 20);
          reply(daemon::ApiReply::json({{"entries", {{{"id", last}, {"hash", kHash}}}}, {"head", {{"id", 20}}}}));
        });
      }};
};

TEST_F(AuditHeads, ThatIsStillInTheLogIsFound) {
  const auto same = compare("17:" + kHash);
  ASSERT_TRUE(same.ok()) << same.error().message;
  EXPECT_EQ(*same, "The audit log goes on from row 17 as it was written down; 3 rows were added since.\n");
}

TEST_F(AuditHeads, ThatWasRewrittenOrIsGoneIsTold) {
  const auto rewritten = compare("17:" + std::string(64, 'b'));
  ASSERT_FALSE(rewritten.ok());
  EXPECT_EQ(rewritten.error().code, ErrorCode::kStorage);
  EXPECT_THAT(rewritten.error().message, HasSubstr("row 17 has another hash"));
  const auto gone = compare("21:" + kHash);
  ASSERT_FALSE(gone.ok());
  EXPECT_THAT(gone.error().message, HasSubstr("it has no row 21"));
}

TEST_F(AuditHeads, ThatIsNoneIsRefused) {
  for (const std::string& head : {std::string("17"), std::string("17:abc"), ":" + kHash, "-1:" + kHash, "x:" + kHash,
                                  "0:" + kHash, "99999999999999999999:" + kHash, std::string()}) {
    const auto refused = compare(head);
    ASSERT_FALSE(refused.ok()) << head;
    EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument) << head;
  }
}

}  // namespace
}  // namespace veneer::cli
