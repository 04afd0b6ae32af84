// The first day's operations, on a cell that is not simulated; alarms and figures.
#include <gmock/gmock.h>

#include "tests/support/routed_cell.h"

namespace veneer::daemon {
namespace {

using ::testing::HasSubstr;

class SetupRoutes : public testing::RoutedCell {};

TEST_F(SetupRoutes, TellWhichDevicesThereAre) {
  const ApiReply reply = ask("GET", "/api/v1/setup");
  ASSERT_EQ(reply.status, 200) << reply.body;
  const auto setup = body_of(reply);
  EXPECT_EQ(setup["devices"]["scanner"]["kind"], "file");
  EXPECT_EQ(setup["devices"]["laser"]["kind"], "lihuiyu");
  EXPECT_EQ(setup["hands"], false);
  EXPECT_TRUE(setup["collected"]["view_heights_mm"].empty());
}

TEST_F(SetupRoutes, ARealCellHasNoHandsToBePlayed) {
  const ApiReply reply = ask("POST", "/api/v1/sim/lay", {{"sheet", "grid"}, {"on", "bed"}});
  EXPECT_EQ(reply.status, 409) << reply.body;
  EXPECT_THAT(reply.body, HasSubstr("not a simulated one"));
  EXPECT_EQ(ask("GET", "/api/v1/sim/sheets").status, 409);
  EXPECT_EQ(ask("POST", "/api/v1/sim/lid", {{"open", true}}).status, 409);
}

TEST_F(SetupRoutes, AFailedTaskIsAnAlarmUntilSomebodyHasSeenIt) {
  cell->tasks.start("scan", "scanning").fail({ErrorCode::kUnavailable, "the scanner does not answer"});
  reactor.restart();
  reactor.poll();
  const auto alarms = body_of(ask("GET", "/api/v1/alarms"))["alarms"];
  ASSERT_EQ(alarms.size(), 1U) << alarms;
  EXPECT_EQ(alarms[0]["state"], "returned");
  EXPECT_EQ(alarms[0]["sentence"], "scan: the scanner does not answer");
  EXPECT_EQ(body_of(ask("GET", "/api/v1/status"))["alarms"]["returned"], 1);
  EXPECT_EQ(ask("POST", "/api/v1/alarms/1/acknowledge").status, 200);
  EXPECT_EQ(ask("POST", "/api/v1/alarms/1/acknowledge").status, 409);
  EXPECT_EQ(body_of(ask("GET", "/api/v1/alarms"))["alarms"][0]["acknowledged_by"], "uid 1000");
}

TEST_F(SetupRoutes, FiguresComeAsText) {
  const ApiReply reply = ask("GET", "/metrics");
  EXPECT_EQ(reply.status, 200);
  EXPECT_THAT(reply.body, HasSubstr("veneerd_state{state=\"Stopped\"} 1\n"));
}

}  // namespace
}  // namespace veneer::daemon
