// The first day's operations, on a cell that is not simulated; alarms and figures.
#include <gmock/gmock.h>

#include <future>

#include "daemon/routes/post_work.h"
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

TEST_F(SetupRoutes, AlarmsComeInPagesAndWhatIsNewerThanAllInSightStays) {
  for (int i = 0; i < 103; ++i) cell->alarms.happened({"task", false, "it failed"}, "2026-05-01T07:30:00.000Z");
  const auto first = body_of(ask("GET", "/api/v1/alarms?limit=1000"));
  EXPECT_EQ(first["alarms"].size(), 100U) << "the loop that answers STOP writes no more at a time";
  EXPECT_EQ(first["alarms"][0]["id"], 103);
  ASSERT_EQ(first["next"], 4);
  const auto second = body_of(ask("GET", "/api/v1/alarms?cursor=4"));
  EXPECT_EQ(second["alarms"].size(), 3U);
  EXPECT_EQ(second["alarms"][0]["id"], 3);
  EXPECT_TRUE(second["next"].is_null());
  EXPECT_EQ(body_of(ask("POST", "/api/v1/alarms/acknowledge-all", {{"up_to", 102}}))["acknowledged"], 102);
  EXPECT_EQ(body_of(ask("GET", "/api/v1/alarms?limit=1"))["alarms"][0]["state"], "returned");
  EXPECT_EQ(body_of(ask("POST", "/api/v1/alarms/acknowledge-all"))["acknowledged"], 1);
}

// What comes of it is its worker's (devices/v4l2_camera_test.cc).
TEST_F(SetupRoutes, CamerasAreLookedForAsATask) {
  cell->device_roots = {directory / "dev", directory / "sys"};
  router = Router();
  bind_routes(router, *cell);
  const ApiReply reply = ask("POST", "/api/v1/cameras");
  ASSERT_EQ(reply.status, 202) << reply.body;
  EXPECT_EQ(cell->tasks.list().back()->kind, "find cameras");
}

TEST_F(SetupRoutes, ACameraIsTriedAsATaskAndItsPictureShown) {
  cell->device_roots = {directory / "dev", directory / "sys"};
  router = Router();
  bind_routes(router, *cell);
  const std::string device = (directory / "dev/v4l/by-id/usb-Cam-index0").string();
  EXPECT_EQ(ask("GET", "/api/v1/cameras/trial.jpg").status, 404) << "nobody tried one";
  for (const json& wrong : std::vector<json>{json::object(),
                                             {{"device", device}, {"width", 640}},
                                             {{"device", device}, {"width", 640}, {"height", 3}},
                                             {{"device", device}, {"format", "H264"}},
                                             {{"device", device}, {"settings", {"focus_absolute"}}},
                                             {{"device", device}, {"settings", {"=30"}}},
                                             {{"device", device}, {"settings", {"gain=1", "gain=2"}}},
                                             {{"device", device}, {"width", 9000}, {"height", 9000}},
                                             {{"device", device}, {"focus", 30}}})
    EXPECT_EQ(ask("POST", "/api/v1/cameras/trial", wrong).status, 400) << wrong;
  const ApiReply reply =
      ask("POST", "/api/v1/cameras/trial", {{"device", device}, {"settings", {"focus_absolute=30"}}});
  ASSERT_EQ(reply.status, 202) << reply.body;
  EXPECT_EQ(cell->tasks.list().back()->kind, "try camera");
  CameraTrial trial;
  trial.task = 12, trial.jpeg = "a picture";
  cell->camera_trials.keep(std::move(trial));
  for (const char* address : {"/api/v1/cameras/trial.jpg", "/api/v1/cameras/trial.jpg?trial=12"}) {
    const ApiReply shown = ask("GET", address);
    EXPECT_EQ(shown.status, 200) << address;
    EXPECT_EQ(shown.body, "a picture");
  }
  const ApiReply gone = ask("GET", "/api/v1/cameras/trial.jpg?trial=11");
  EXPECT_EQ(gone.status, 404) << "another one's";
  EXPECT_THAT(gone.body, HasSubstr("take another one"));
}

// A run that is started meanwhile waits for one of them at most.
TEST_F(SetupRoutes, OneCameraIsTriedOrLookedForAtATime) {
  cell->device_roots = {directory / "dev", directory / "sys"};
  router = Router();
  bind_routes(router, *cell);
  const json trial = {{"device", (directory / "dev/v4l/by-id/usb-Cam-index0").string()}};
  for (const auto& [first, body] : {std::pair{"/api/v1/cameras/trial", trial}, {"/api/v1/cameras", json::object()}}) {
    std::promise<void> begun, go;
    cell->camera_worker->post([&] {
      begun.set_value();
      go.get_future().wait();
    });
    begun.get_future().wait();
    const ApiReply taken = ask("POST", first, body);
    const ApiReply tried = ask("POST", "/api/v1/cameras/trial", trial), sought = ask("POST", "/api/v1/cameras");
    go.set_value();
    EXPECT_EQ(tried.status, 409) << tried.body;
    EXPECT_THAT(tried.body, HasSubstr("wait until that is done, then try again"));
    EXPECT_EQ(sought.status, 409) << sought.body;
    ended(taken);
    EXPECT_EQ(cell->tasks.list().back()->id, body_of(taken)["task"]) << "what is refused is no task";
  }
}

TEST_F(SetupRoutes, ATrialThatHasNoRoomLeavesItToTheNext) {
  const json trial = {{"device", (directory / "dev/v4l/by-id/usb-Cam-index0").string()}};
  std::promise<void> begun, go;
  cell->camera_worker->post([&] {
    begun.set_value();
    go.get_future().wait();
  });
  begun.get_future().wait();
  for (std::size_t i = 0; i < kWaitingRoom.works; ++i) cell->camera_worker->post([] {});
  const ApiReply refused = ask("POST", "/api/v1/cameras/trial", trial);
  go.set_value();
  cell->camera_worker->call([] {});
  EXPECT_EQ(refused.status, 503) << refused.body;
  EXPECT_EQ(ask("POST", "/api/v1/cameras/trial", trial).status, 202);
}

TEST_F(SetupRoutes, WatchingTheBedIsNoTaskAndIsNotedNowhere) {
  const ApiReply reply = ask("GET", "/api/v1/bed/glance.jpg");
  EXPECT_EQ(reply.status, 503) << reply.body;
  EXPECT_THAT(reply.body, HasSubstr("no picture matches"));
  EXPECT_TRUE(cell->tasks.list().empty());
  EXPECT_TRUE(body_of(ask("GET", "/api/v1/audit"))["entries"].empty());
}

TEST_F(SetupRoutes, WatchingTheBedGivesWayToALook) {
  std::promise<void> begun, go;
  cell->camera_worker->post([&] {
    begun.set_value();
    go.get_future().wait();
  });
  begun.get_future().wait();
  const ApiReply reply = ask("GET", "/api/v1/bed/glance.jpg");
  go.set_value();
  cell->camera_worker->call([] {});  // so that it has done with both promises
  EXPECT_EQ(reply.status, 409) << reply.body;
  EXPECT_THAT(reply.body, HasSubstr("the camera is at work"));
}

TEST_F(SetupRoutes, FiguresComeAsText) {
  const ApiReply reply = ask("GET", "/metrics");
  EXPECT_EQ(reply.status, 200);
  EXPECT_THAT(reply.body, HasSubstr("veneerd_state{state=\"Stopped\"} 1\n"));
}

}  // namespace
}  // namespace veneer::daemon
