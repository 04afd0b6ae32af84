// Choosing laser, scanner and camera for the next start.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "base/files.h"
#include "tests/support/routed_cell.h"

namespace veneer::daemon {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;

// Its laser is written down by hand, scanner and camera are not. A GRBL controller and a Lihuiyu board are plugged in.
class DeviceRoutes : public testing::RoutedCell {
 protected:
  DeviceRoutes()
      : RoutedCell([this](const fs::path& data_dir) {
          config.file = directory / "veneerd.toml";
          config.laser.set_by = SetBy::kFile;
          config.scanner.kind = config.camera.kind = "sim";
          write("");
          fs::create_directories(data_dir / "camera");
          std::ofstream(data_dir / "camera" / "bed.jpg") << "a picture";
        }) {
    plug_in();
    cell->device_roots = {directory / "dev", directory / "sys"};
    cell->restart = [this] { ++restarts; };
    again.emplace();
    bind_routes(*again, *cell);
  }
  // The configuration file, with its laser as `laser` says.
  void write(const std::string& more) const {
    std::ofstream(config.file) << "[laser]\nkind = \"lihuiyu\"\nport = \"" << config.laser.port
                               << "\"\n[store]\ndata_dir = \"" << config.store.data_dir.string() << "\"\n"
                               << more;
  }
  void leave_open() const {
    std::ofstream(config.file) << "[store]\ndata_dir = \"" << config.store.data_dir.string() << "\"\n";
  }
  void plug_in() const {
    const fs::path usb = directory / "sys/devices/usb1/1-1", board = directory / "sys/bus/usb/devices/1-2.4";
    const fs::path tty = usb / "1-1:1.0/tty/ttyUSB0";
    fs::create_directories(tty);
    fs::create_directories(board);
    std::ofstream(usb / "idVendor") << "1a86\n";
    std::ofstream(usb / "manufacturer") << "QinHeng\n";
    std::ofstream(usb / "product") << "USB Serial\n";
    fs::create_directory_symlink(usb / "1-1:1.0", tty / "device");
    fs::create_directories(directory / "sys/class/tty");
    fs::create_directory_symlink(tty, directory / "sys/class/tty/ttyUSB0");
    fs::create_directories(directory / "sys/class/tty/ttyS0");
    fs::create_directories(directory / "dev/veneer");
    std::ofstream(directory / "dev/ttyUSB0") << "";
    fs::create_symlink("../ttyUSB0", directory / "dev/veneer/laser0");
    fs::create_symlink("../ttyUSB0", directory / "dev/veneer/laser-A1");
    std::ofstream(board / "idVendor") << "1a86\n";
    std::ofstream(board / "idProduct") << "5512\n";
  }
  // By the routes as they were bound at last.
  json answer(const std::string& method, const std::string& target, const json& body = json::object()) {
    std::swap(router, *again);
    const ApiReply reply = ask(method, target, body);
    std::swap(router, *again);
    status = reply.status;
    return body_of(reply);
  }
  std::string kept() const { return read_whole(config.store.data_dir / kChosenDevicesName).value_or(""); }
  std::string serial_port() const { return "serial:" + (directory / "dev/veneer/laser-A1").string() + "?baud=115200"; }

  std::optional<Router> again;
  int restarts = 0, status = 0;
};

TEST_F(DeviceRoutes, FindWhatIsPluggedInByTheNameThatLasts) {
  const json found = answer("GET", "/api/v1/devices/found");
  ASSERT_EQ(found["lasers"].size(), 2U) << found;
  EXPECT_EQ(found["lasers"][0]["port"], serial_port());
  EXPECT_EQ(found["lasers"][0]["name"], "QinHeng USB Serial");
  EXPECT_EQ(found["lasers"][0]["lasting"], true);
  EXPECT_EQ(found["lasers"][1]["kind"], "lihuiyu");
  EXPECT_EQ(found["lasers"][1]["port"], "usb:1a86:5512@1-2.4");
  ASSERT_EQ(found["pictures"].size(), 1U) << found;
  EXPECT_THAT(found["pictures"][0]["device"].get<std::string>(), HasSubstr("camera/bed.jpg"));
  fs::remove(directory / "dev/veneer/laser-A1");
  EXPECT_EQ(answer("GET", "/api/v1/devices/found")["lasers"][0]["lasting"], false);
}

TEST_F(DeviceRoutes, AChoiceIsForTheNextStartAndIsTold) {
  const std::string picture = (config.store.data_dir / "camera" / "bed.jpg").string();
  EXPECT_TRUE(answer("GET", "/api/v1/devices")["next"].is_null());
  const json told = answer("POST", "/api/v1/devices/camera", {{"kind", "file"}, {"device", picture}});
  ASSERT_EQ(status, 200) << told;
  EXPECT_EQ(told["camera"]["kind"], "sim") << "nothing changes before it";
  EXPECT_EQ(told["next"]["camera"]["device"], picture);
  answer("POST", "/api/v1/devices/scanner", {{"kind", "sane"}, {"dpi", 600}});
  ASSERT_EQ(status, 200);
  const auto next = load_config(config.file);
  ASSERT_TRUE(next.ok()) << next.error().message;
  EXPECT_EQ(next->camera.device, picture) << "the second choice left the first one";
  EXPECT_EQ(next->scanner.kind, "sane");
  EXPECT_EQ(next->laser.port, config.laser.port);
  answer("POST", "/api/v1/devices/camera", {{"kind", "file"}, {"device", "/etc/passwd"}});
  EXPECT_EQ(status, 404) << "only what is a camera's picture";
}

TEST_F(DeviceRoutes, WhatIsWrittenByHandStays) {
  const json refused = answer("POST", "/api/v1/devices/laser", {{"kind", "sim"}});
  EXPECT_EQ(status, 409);
  EXPECT_THAT(refused.dump(), HasSubstr("set by hand"));
  EXPECT_EQ(kept(), "");
}

TEST_F(DeviceRoutes, ARealLaserIsConfirmedByNameAndMustBeThere) {
  leave_open();
  const json wanted = {{"kind", "grbl"}, {"port", serial_port()}};
  EXPECT_THAT(answer("POST", "/api/v1/devices/laser", wanted).dump(), HasSubstr("a laser is at this port"));
  EXPECT_EQ(status, 422);
  json confirmed = wanted;
  confirmed["confirmed"] = {"a laser is at this port"};
  for (const std::string& elsewhere :
       {std::string("serial:/dev/null"), "file:" + (directory / "x").string(), std::string("tcp:10.0.0.1:23")}) {
    json other = confirmed;
    other["port"] = elsewhere;
    answer("POST", "/api/v1/devices/laser", other);
    EXPECT_EQ(status, 404) << elsewhere;
  }
  EXPECT_EQ(kept(), "");
  answer("POST", "/api/v1/devices/laser", confirmed);
  ASSERT_EQ(status, 200);
  const auto next = load_config(config.file);
  ASSERT_TRUE(next.ok()) << next.error().message;
  EXPECT_EQ(next->laser.port, serial_port());
  EXPECT_EQ(next->before_motion.confirm.size(), 3U) << "what a real laser asks for";
}

TEST_F(DeviceRoutes, AChoiceThatWouldKeepTheCellFromStartingIsNotKept) {
  leave_open();
  std::ofstream(config.file, std::ios::app) << "[sim]\ntime_scale = 40\n";
  const json refused = answer("POST", "/api/v1/devices/laser",
                              {{"kind", "grbl"}, {"port", serial_port()}, {"confirmed", {"a laser is at this port"}}});
  EXPECT_EQ(status, 400) << refused;
  EXPECT_EQ(kept(), "");
}

TEST_F(DeviceRoutes, RestartOnlyWhileNothingGoesOnAndIntoAGoodConfiguration) {
  {
    const TaskReporter scan = cell->tasks.start("scan", "scanning");
    EXPECT_THAT(answer("POST", "/api/v1/restart").dump(), HasSubstr("would be lost"));
    EXPECT_EQ(status, 409);
    scan.done({});
    reactor.restart();
    reactor.poll();
  }
  write("[nonsense]\n");
  answer("POST", "/api/v1/restart");
  EXPECT_EQ(status, 400);
  EXPECT_THAT(answer("GET", "/api/v1/devices")["problem"].get<std::string>(), HasSubstr("[nonsense]"));
  EXPECT_EQ(restarts, 0);
  write("");
  EXPECT_EQ(answer("POST", "/api/v1/restart")["restarting"], true);
  EXPECT_EQ(restarts, 1);
}

TEST_F(DeviceRoutes, NobodyRestartsADaemonThatWasStartedByHand) {
  // The first router was bound before there was anybody.
  const ApiReply refused = ask("POST", "/api/v1/restart");
  EXPECT_EQ(refused.status, 409);
  EXPECT_THAT(refused.body, HasSubstr("started by hand"));
}

}  // namespace
}  // namespace veneer::daemon
