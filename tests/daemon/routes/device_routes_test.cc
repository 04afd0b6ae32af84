// Choosing laser, scanner and camera for the next start.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <thread>

#include "base/files.h"
#include "db/audit.h"
#include "tests/support/routed_cell.h"

namespace veneer::daemon {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

const json kSure = {"a laser is at this port"}, kSimulate = {"a simulation takes its place"};

// Its devices may be chosen. A GRBL controller and a Lihuiyu board are plugged in.
class DeviceRoutes : public testing::RoutedCell {
 protected:
  DeviceRoutes()
      : RoutedCell([this](const fs::path& data_dir) {
          config.file = directory / "veneerd.toml";
          config.devices.choose = true;
          config.scanner.kind = config.camera.kind = "sim";
          fs::create_directories(data_dir);
          write_file(config, "");
        }) {
    std::ofstream(picture()) << "a picture";
    plug_in("ttyUSB0", "1-1", "AQ00ABCD");
    link("veneer/laser0", "ttyUSB0");
    link("veneer/laser-AQ00ABCD", "ttyUSB0");
    plug_in_board("1-2.4");
    fs::create_directories(directory / "sys/class/tty/ttyS0");
    cell->device_roots = {directory / "dev", directory / "sys"};
    cell->restart = [this] { ++restarts; };
    again.emplace();
    again->on_change([this](const Router::Change& change) { cell->change_audit->note(change); });
    bind_routes(*again, *cell);
  }
  // The configuration file.
  void write(const std::string& more, bool choose = true) const { write_file(config, more, choose); }
  static void write_file(const Config& config, const std::string& more, bool choose = true) {
    std::ofstream(config.file) << "[devices]\nchoose = " << (choose ? "true" : "false") << "\n[store]\ndata_dir = \""
                               << config.store.data_dir.string() << "\"\n"
                               << more;
  }
  void plug_in(const std::string& tty, const std::string& socket, const std::string& serial) const {
    const fs::path usb = directory / "sys/devices" / socket, at = usb / (socket + ":1.0") / "tty" / tty;
    fs::create_directories(at);
    std::ofstream(usb / "idVendor") << "0403\n";
    std::ofstream(usb / "manufacturer") << "FTDI\n";
    std::ofstream(usb / "product") << "USB Serial\n";
    if (!serial.empty()) std::ofstream(usb / "serial") << serial << "\n";
    fs::create_directory_symlink(usb / (socket + ":1.0"), at / "device");
    fs::create_directories(directory / "sys/class/tty");
    fs::create_directory_symlink(at, directory / "sys/class/tty" / tty);
    fs::create_directories(directory / "dev");
    std::ofstream(directory / "dev" / tty) << "";
  }
  void plug_in_board(const std::string& socket) const {
    const fs::path board = directory / "sys/bus/usb/devices" / socket;
    fs::create_directories(board);
    std::ofstream(board / "idVendor") << "1a86\n";
    std::ofstream(board / "idProduct") << "5512\n";
  }
  // Its name that lasts.
  std::string plug_in_camera() const {
    const fs::path usb = directory / "sys/devices/1-7", at = usb / "1-7:1.0/video4linux/video0";
    fs::create_directories(at);
    std::ofstream(usb / "idVendor") << "046d\n";
    std::ofstream(usb / "serial") << "A1B2C3D4\n";
    std::ofstream(at / "index") << "0\n";
    fs::create_directory_symlink(usb / "1-7:1.0", at / "device");
    fs::create_directories(directory / "sys/class/video4linux");
    fs::create_directory_symlink(at, directory / "sys/class/video4linux/video0");
    std::ofstream(directory / "dev/video0") << "";
    link("v4l/by-id/usb-Cam_A1B2C3D4-video-index0", "video0");
    return (directory / "dev/v4l/by-id/usb-Cam_A1B2C3D4-video-index0").string();
  }
  // As somebody saw who tried it.
  static CameraTrial tried(std::int64_t task, const std::string& device) {
    CameraTrial out;
    out.task = task;
    out.camera.kind = "v4l2", out.camera.device = device;
    out.camera.width = 1280, out.camera.height = 720, out.camera.format = "MJPG";
    out.camera.options = {{"exposure_time_absolute", "200"}, {"focus_absolute", "35"}};
    out.jpeg = "a picture";
    return out;
  }
  // A name that udev gives.
  void link(const std::string& name, const std::string& tty) const {
    const fs::path at = directory / "dev" / name;
    fs::create_directories(at.parent_path());
    fs::remove(at);
    fs::create_symlink(directory / "dev" / tty, at);
  }
  void unlink_names() const {
    for (const char* folder : {"veneer", "serial"}) fs::remove_all(directory / "dev" / folder);
  }
  // As somebody found who looked.
  void find_scanners(const std::vector<std::string>& makes) {
    json list = json::array();
    for (const std::string& make : makes) list.push_back({{"name", "epson2:libusb:001:004"}, {"make", make}});
    cell->tasks.start("find scanners", "looking").done({{"scanners", list}});
    reactor.restart();
    reactor.poll();
  }
  // By the routes as they were bound at last.
  json answer(const std::string& method, const std::string& target, const json& body = json::object()) {
    std::swap(router, *again);
    const ApiReply reply = ask(method, target, body);
    std::swap(router, *again);
    status = reply.status;
    return body_of(reply);
  }
  json choose(const std::string& device, const json& body) { return answer("POST", "/api/v1/devices/" + device, body); }
  json asked_by(Role asking, const std::string& target) {
    const auto answer = std::make_shared<std::optional<ApiReply>>();
    ApiRequest request;
    request.method = "GET", request.path = target, request.caller = {asking, "uid 7", TransportKind::kUnix};
    again->match("GET", target).route->handler(request, [this, answer](const ApiReply& reply) {
      boost::asio::post(reactor, [answer, reply] { *answer = reply; });
    });
    reactor.restart();
    while (!*answer && reactor.run_one_for(std::chrono::seconds(10)) > 0) {
    }
    return *answer ? body_of(**answer) : json();
  }
  json first_laser() { return answer("GET", "/api/v1/devices/found")["lasers"][0]; }
  std::string kept() const { return read_whole(config.store.data_dir / kChosenDevicesName).value_or(""); }
  std::string port_of(const std::string& name) const {
    return "serial:" + (directory / "dev" / name).string() + "?baud=115200";
  }
  std::string picture() const { return (camera_folder(config.store.data_dir) / "bed.jpg").string(); }
  json real_laser() const {
    return {{"kind", "grbl"}, {"port", port_of("veneer/laser-AQ00ABCD")}, {"confirmed", kSure}};
  }
  std::vector<db::AuditEntry> audited() {
    return *cell->database->call([](Repositories& r) { return r.audit.latest(100); });
  }

  std::optional<Router> again;
  int restarts = 0, status = 0;
};

// ---- Names ----------------------------------------------------------------------------------------------------------

TEST_F(DeviceRoutes, FindWhatIsPluggedInByTheNameThatLasts) {
  const json found = answer("GET", "/api/v1/devices/found");
  ASSERT_EQ(found["lasers"].size(), 2U) << found;
  EXPECT_EQ(found["lasers"][0]["port"], port_of("veneer/laser-AQ00ABCD"));
  EXPECT_EQ(found["lasers"][0]["name"], "FTDI USB Serial");
  EXPECT_EQ(found["lasers"][0]["named_by"], "serial_number");
  EXPECT_EQ(found["lasers"][0]["refusal"], "");
  EXPECT_EQ(found["lasers"][1]["kind"], "lihuiyu");
  EXPECT_EQ(found["lasers"][1]["port"], "usb:1a86:5512@1-2.4");
  EXPECT_EQ(found["lasers"][1]["named_by"], "socket");
  ASSERT_EQ(found["pictures"].size(), 1U) << found;
  EXPECT_EQ(found["pictures"][0]["device"], picture());
}

TEST_F(DeviceRoutes, APortWithoutALastingNameIsShownAndCannotBeChosen) {
  unlink_names();
  link("veneer/laser0", "ttyUSB0");
  const json laser = first_laser();
  EXPECT_EQ(laser["port"], port_of("ttyUSB0"));
  EXPECT_TRUE(laser["named_by"].is_null());
  EXPECT_THAT(laser["refusal"].get<std::string>(),
              AllOf(HasSubstr("goes to another machine"), HasSubstr("install the udev rules")));
  const json refused = choose("laser", {{"kind", "grbl"}, {"port", laser["port"]}, {"confirmed", kSure}});
  EXPECT_EQ(status, 422) << refused;
  EXPECT_THAT(refused.dump(), HasSubstr("goes to another machine"));
  EXPECT_EQ(kept(), "");
}

TEST_F(DeviceRoutes, ANameWithoutASerialNumberIsNoDevicesOwn) {
  for (const std::string serial : {"", "0001", "000000"}) {
    unlink_names();
    fs::remove(directory / "sys/devices/1-1/serial");
    if (!serial.empty()) std::ofstream(directory / "sys/devices/1-1/serial") << serial << "\n";
    link("serial/by-id/usb-1a86_USB_Serial-if00-port0", "ttyUSB0");
    link("serial/by-id/usb-1a86_USB_Serial_0001-if00-port0", "ttyUSB0");
    EXPECT_NE(first_laser()["refusal"], "") << serial;
    link("serial/by-path/pci-0000:00:14.0-usb-0:1:1.0-port0", "ttyUSB0");
    const json by_socket = first_laser();
    EXPECT_EQ(by_socket["port"], port_of("serial/by-path/pci-0000:00:14.0-usb-0:1:1.0-port0"));
    EXPECT_EQ(by_socket["named_by"], "socket");
    EXPECT_EQ(by_socket["refusal"], "");
  }
}

TEST_F(DeviceRoutes, ASerialNumberThatTwoHaveTellsNothing) {
  plug_in("ttyUSB1", "1-3", "AQ00ABCD");
  const json found = answer("GET", "/api/v1/devices/found");
  ASSERT_EQ(found["lasers"].size(), 3U);
  EXPECT_NE(found["lasers"][0]["refusal"], "");
  EXPECT_NE(found["lasers"][1]["refusal"], "");
  choose("laser", real_laser());
  EXPECT_EQ(status, 404);
}

TEST_F(DeviceRoutes, OneOfTwoBoardsWithoutSerialNumbersCannotBeChosen) {
  const json board = {{"kind", "lihuiyu"},    {"port", "usb:1a86:5512@1-2.4"}, {"board", "m2"},
                      {"travel_x_mm", 320.0}, {"travel_y_mm", 210.0},          {"confirmed", kSure}};
  choose("laser", board);
  EXPECT_EQ(status, 200);
  plug_in_board("1-3");
  EXPECT_THAT(choose("laser", board).dump(), HasSubstr("leave only the laser's in"));
  EXPECT_EQ(status, 422);
}

TEST_F(DeviceRoutes, ABoardsTravelIsNotGuessed) {
  const json refused =
      choose("laser", {{"kind", "lihuiyu"}, {"port", "usb:1a86:5512@1-2.4"}, {"board", "m2"}, {"confirmed", kSure}});
  EXPECT_EQ(status, 400);
  EXPECT_THAT(refused.dump(), HasSubstr("travel_x_mm"));
}

TEST_F(DeviceRoutes, OnlyAScannerThatThisCellFoundCanBeChosenAndByItsMake) {
  const auto refused = [&](const std::string& name) { return choose("scanner", {{"kind", "sane"}, {"device", name}}); };
  refused("EPSON V39");
  EXPECT_EQ(status, 404) << "nobody looked yet";
  find_scanners({"EPSON V39"});
  for (const char* other : {"net:somewhere:test:0", "epson2:libusb:001:004", "", "Canon"}) {
    refused(other);
    EXPECT_GE(status, 400) << other;
  }
  find_scanners({"net:somewhere"});
  refused("net:somewhere");
  EXPECT_EQ(status, 422) << "it would be opened there, found or not";
  find_scanners({"EPSON V39", "EPSON V39"});
  EXPECT_THAT(refused("EPSON V39").dump(), HasSubstr("nothing tells them apart"));
  EXPECT_EQ(kept(), "");
  find_scanners({"EPSON V39"});
  choose("scanner", {{"kind", "sane"}, {"device", "EPSON V39"}});
  EXPECT_EQ(status, 200);
  EXPECT_THAT(kept(), AllOf(HasSubstr("EPSON V39"), Not(HasSubstr("dpi"))));
}

// ---- Choosing -------------------------------------------------------------------------------------------------------

TEST_F(DeviceRoutes, AChoiceIsForTheNextStartAndLeavesTheOthers) {
  EXPECT_EQ(answer("GET", "/api/v1/devices")["choose"], true);
  find_scanners({"EPSON V39"});
  const json told = choose("camera", {{"kind", "file"}, {"device", picture()}});
  ASSERT_EQ(status, 200) << told;
  EXPECT_EQ(told["camera"]["kind"], "sim") << "nothing changes before it";
  EXPECT_EQ(told["next"]["camera"]["device"], picture());
  choose("laser", real_laser());
  ASSERT_EQ(status, 200);
  // Whoever writes a device by hand for a while finds what was chosen before.
  write("[laser]\nkind = \"lihuiyu\"\nport = \"usb:1a86:5512\"\n");
  choose("scanner", {{"kind", "sane"}, {"device", "EPSON V39"}, {"dpi", 600}});
  ASSERT_EQ(status, 200);
  EXPECT_EQ(load_config(config.file)->laser.port, "usb:1a86:5512");
  write("");
  const auto next = load_config(config.file);
  ASSERT_TRUE(next.ok()) << next.error().message;
  EXPECT_EQ(next->camera.device, picture());
  EXPECT_EQ(next->scanner.device, "EPSON V39");
  EXPECT_EQ(next->laser.port, port_of("veneer/laser-AQ00ABCD"));
  choose("camera", {{"kind", "file"}, {"device", "/etc/passwd"}});
  EXPECT_EQ(status, 404) << "only what is a camera's picture";
}

// What is chosen is what somebody saw.
TEST_F(DeviceRoutes, ACameraIsChosenByThePictureThatWasTakenWithIt) {
  const std::string name = plug_in_camera();
  const auto choose_it = [&](std::int64_t trial) {
    return choose("camera", {{"kind", "v4l2"}, {"device", name}, {"trial", trial}}).dump();
  };
  EXPECT_THAT(choose_it(5), HasSubstr("veneerctl camera try"));
  EXPECT_EQ(status, 404) << "nobody has seen anything of it";
  cell->camera_trials.keep(tried(5, name + "-other"));
  choose_it(5);
  EXPECT_EQ(status, 404) << "of another camera";
  cell->camera_trials.keep(tried(6, name));
  EXPECT_THAT(choose("camera", {{"kind", "v4l2"}, {"device", name}}).dump(),
              AllOf(HasSubstr("veneerctl camera try"), HasSubstr("--trial")));
  EXPECT_EQ(status, 400) << "which picture was looked at?";
  EXPECT_THAT(choose_it(5), HasSubstr("another picture"));
  EXPECT_EQ(status, 409);
  EXPECT_EQ(kept(), "");
  const json told = json::parse(choose_it(6));
  ASSERT_EQ(status, 200) << told;
  EXPECT_EQ(told["camera"]["kind"], "sim") << "nothing changes before it";
  EXPECT_FALSE(told["camera"].contains("width"));
  EXPECT_EQ(told["next"]["camera"],
            json({{"kind", "v4l2"},
                  {"set_by", "choice"},
                  {"device", name},
                  {"width", 1280},
                  {"height", 720},
                  {"format", "MJPG"},
                  {"settings", {{"exposure_time_absolute", "200"}, {"focus_absolute", "35"}}}}));
  EXPECT_EQ(asked_by(Role::kViewer, "/api/v1/devices")["next"]["camera"]["device"], "");
  const auto next = load_config(config.file);
  ASSERT_TRUE(next.ok()) << next.error().message;
  EXPECT_EQ(next->camera.options.size(), 2U);
  ASSERT_FALSE(audited().empty());
  EXPECT_THAT(audited().front().detail, HasSubstr("1280 x 720 MJPG, exposure_time_absolute 200, focus_absolute 35"));
  choose("camera", {{"kind", "sim"}});
  EXPECT_EQ(status, 422) << "it is asked first whether that is meant";
}

TEST_F(DeviceRoutes, ACameraMustBeThereUnderANameThatMeansIt) {
  const std::string name = plug_in_camera();
  const auto refused = [&](const std::string& device) {
    cell->camera_trials.keep(tried(7, device));
    return choose("camera", {{"kind", "v4l2"}, {"device", device}, {"trial", 7}}).dump();
  };
  for (const std::string& other : {(directory / "dev/video0").string(), std::string("/dev/null"), std::string()}) {
    refused(other);
    EXPECT_EQ(status, 404) << other;
  }
  fs::remove(directory / "sys/class/video4linux/video0");
  EXPECT_THAT(refused(name), HasSubstr("check its cable"));
  EXPECT_EQ(status, 404);
  EXPECT_EQ(kept(), "");
  choose("camera", {{"kind", "file"}, {"device", picture()}, {"trial", 7}});
  EXPECT_EQ(status, 400) << "a trial is of a camera of this computer";
  choose("camera", {{"kind", "v4l2"}, {"trial", 7}});
  EXPECT_EQ(status, 400);
}

TEST_F(DeviceRoutes, WhatIsWrittenByHandStays) {
  write("[laser]\nkind = \"lihuiyu\"\nport = \"usb:1a86:5512\"\n");
  EXPECT_THAT(choose("laser", {{"kind", "sim"}}).dump(), HasSubstr("set by hand"));
  EXPECT_EQ(status, 409);
  write("", false);
  EXPECT_THAT(choose("laser", real_laser()).dump(), HasSubstr("choose = true under [devices]"));
  EXPECT_EQ(status, 409);
  EXPECT_EQ(kept(), "");
}

TEST_F(DeviceRoutes, ARealLaserIsConfirmedByNameAndMustBeThere) {
  json unsure = real_laser();
  unsure.erase("confirmed");
  EXPECT_THAT(choose("laser", unsure).dump(), HasSubstr("a laser is at this port"));
  EXPECT_EQ(status, 422);
  for (const std::string& elsewhere : {std::string("serial:/dev/null"), "file:" + (directory / "x").string(),
                                       std::string("tcp:10.0.0.1:23"), port_of("veneer/laser0"), port_of("ttyUSB0")}) {
    json other = real_laser();
    other["port"] = elsewhere;
    choose("laser", other);
    EXPECT_EQ(status, 404) << elsewhere;
  }
  EXPECT_EQ(kept(), "");
  choose("laser", real_laser());
  ASSERT_EQ(status, 200);
  EXPECT_EQ(load_config(config.file)->before_motion.confirm.size(), 3U) << "what a real laser asks for";
}

TEST_F(DeviceRoutes, FromARealDeviceToASimulationIsAskedByName) {
  choose("camera", {{"kind", "sim"}});
  EXPECT_EQ(status, 200) << "it is simulated already";
  choose("camera", {{"kind", "file"}, {"device", picture()}});
  const json asked = choose("camera", {{"kind", "sim"}});
  EXPECT_EQ(status, 422);
  EXPECT_THAT(asked.dump(), HasSubstr("a simulation takes its place"));
  EXPECT_THAT(kept(), HasSubstr("bed.jpg"));
  choose("camera", {{"kind", "sim"}, {"confirmed", kSimulate}});
  EXPECT_EQ(status, 200);
  EXPECT_EQ(load_config(config.file)->camera.kind, "sim");
  // This cell's laser, as it began, is no simulated one.
  choose("laser", {{"kind", "sim"}});
  EXPECT_EQ(status, 422);
}

TEST_F(DeviceRoutes, AChoiceThatWouldKeepTheCellFromStartingIsNotKept) {
  write("[sim]\ntime_scale = 40\n");
  const json refused = choose("laser", real_laser());
  EXPECT_EQ(status, 400) << refused;
  EXPECT_EQ(kept(), "");
}

TEST_F(DeviceRoutes, EarlierChoicesThatCannotBeReadAreNotOverwritten) {
  std::ofstream(config.store.data_dir / kChosenDevicesName) << "[laser]\nkind = \"grbl\"\n";
  EXPECT_THAT(choose("camera", {{"kind", "file"}, {"device", picture()}}).dump(), HasSubstr("remove it and choose"));
  EXPECT_EQ(status, 400);
  EXPECT_EQ(kept(), "[laser]\nkind = \"grbl\"\n");
}

// The log is written first: what it cannot hold is not done.
TEST_F(DeviceRoutes, NoChoiceIsKeptThatTheAuditLogCouldNotHold) {
  const auto told = [this] {
    std::vector<std::string> out;
    for (const db::AuditEntry& entry : audited())
      if (entry.what.starts_with("device.")) out.push_back(entry.what);
    return out;
  };
  // A folder in its place: the log says that, too.
  fs::create_directories(config.store.data_dir / kChosenDevicesName);
  choose("camera", {{"kind", "file"}, {"device", picture()}});
  EXPECT_GE(status, 400);
  EXPECT_THAT(told(), ::testing::IsEmpty()) << "what was chosen before cannot be read";
  fs::remove(config.store.data_dir / kChosenDevicesName);
  cell->database->distrust({ErrorCode::kStorage, "the database is damaged"});
  choose("camera", {{"kind", "file"}, {"device", picture()}});
  EXPECT_GE(status, 400);
  EXPECT_EQ(kept(), "");
}

// What was told and not kept is told, and nothing is missed at the next start.
TEST_F(DeviceRoutes, AChoiceThatWasToldAndCouldNotBeKeptIsToldAgain) {
  const auto were_chosen = [this] {
    return *cell->database->call([](Repositories& r) { return r.audit.devices_were_chosen(); });
  };
  const fs::path in_the_way = config.store.data_dir / (std::string(kChosenDevicesName) + ".new");
  fs::create_directories(in_the_way);  // where it is written before it gets its name
  choose("camera", {{"kind", "file"}, {"device", picture()}});
  EXPECT_GE(status, 400);
  EXPECT_EQ(kept(), "");
  std::vector<std::string> told;
  for (const db::AuditEntry& entry : audited())
    if (entry.what.starts_with("device.")) told.push_back(entry.what);
  EXPECT_THAT(told, ::testing::ElementsAre("device.choose.failed", "device.choose")) << "the newest first";
  EXPECT_FALSE(were_chosen());
  fs::remove(in_the_way);
  choose("camera", {{"kind", "file"}, {"device", picture()}});
  EXPECT_EQ(status, 200);
  EXPECT_TRUE(were_chosen());
}

TEST_F(DeviceRoutes, OfTwoChoicesAtOnceNoneIsLost) {
  std::swap(router, *again);
  const auto camera =
      begin_asking("POST", "/api/v1/devices/camera", json{{"kind", "file"}, {"device", picture()}}.dump());
  const auto laser = begin_asking("POST", "/api/v1/devices/laser", real_laser().dump());
  std::swap(router, *again);
  reactor.restart();
  while ((!*camera || !*laser) && reactor.run_one_for(std::chrono::seconds(10)) > 0) {
  }
  ASSERT_TRUE(*camera && *laser);
  EXPECT_EQ((*camera)->status, 200) << (*camera)->body;
  EXPECT_EQ((*laser)->status, 200) << (*laser)->body;
  const auto next = load_config(config.file);
  ASSERT_TRUE(next.ok()) << next.error().message;
  EXPECT_EQ(next->camera.device, picture());
  EXPECT_EQ(next->laser.port, port_of("veneer/laser-AQ00ABCD"));
}

TEST_F(DeviceRoutes, WhatWasChosenStandsInTheAuditLogHoweverLongTheRequestIs) {
  json long_one = {{"confirmed", {std::string(1500, 'x')}}, {"kind", "file"}, {"device", picture()}};
  choose("camera", long_one);
  ASSERT_EQ(status, 200);
  bool named = false;
  for (const db::AuditEntry& entry : audited())
    if (entry.what == "device.choose") {
      named = true;
      EXPECT_EQ(entry.who, "uid 1000");
      EXPECT_EQ(entry.detail, "camera from the next start: file " + picture() + "; before: simulated");
    }
  EXPECT_TRUE(named);
}

// ---- The next start -------------------------------------------------------------------------------------------------

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
  write("");
  std::ofstream(config.store.data_dir / kChosenDevicesName) << "";
  EXPECT_THAT(answer("POST", "/api/v1/restart").dump(), HasSubstr("chosen_devices.toml"));
  EXPECT_EQ(restarts, 0);
  fs::remove(config.store.data_dir / kChosenDevicesName);
  EXPECT_EQ(answer("POST", "/api/v1/restart")["restarting"], true);
  EXPECT_EQ(restarts, 1);
}

// What the next start would end with, where that is known before.
TEST_F(DeviceRoutes, NoRestartIntoAPortOrAFileThatIsNoGood) {
  const auto refused = [this] { return answer("POST", "/api/v1/restart").dump(); };
  write("[laser]\nkind = \"grbl\"\nport = \"serial:/dev/ttyUSB0?bauds=9600\"\n");
  EXPECT_THAT(refused(), HasSubstr("bauds"));
  EXPECT_GE(status, 400);
  write(
      "[api]\nlisten_tls = \"0.0.0.0:8766\"\ntls_certificate = \"/nowhere/cell.pem\"\ntls_key = "
      "\"/nowhere/cell.key\"\n");
  EXPECT_THAT(refused(), HasSubstr("/nowhere/cell"));
  EXPECT_GE(status, 400);
  EXPECT_THAT(answer("GET", "/api/v1/devices")["problem"].get<std::string>(), HasSubstr("/nowhere/cell"));
  write("");
  choose("laser", real_laser());
  ASSERT_EQ(status, 200);
  plug_in("ttyUSB1", "1-3", "AQ00ABCD");
  EXPECT_THAT(refused(), AllOf(HasSubstr("serial number AQ00ABCD"), HasSubstr("leave only the laser's in")));
  EXPECT_GE(status, 400);
  fs::remove_all(directory / "sys/class/tty/ttyUSB1");
  EXPECT_EQ(restarts, 0);
  answer("POST", "/api/v1/restart");
  EXPECT_EQ(restarts, 1);
}

TEST_F(DeviceRoutes, WhoeverLooksOnIsToldNoPortsAndPaths) {
  choose("camera", {{"kind", "file"}, {"device", picture()}});
  const json all = asked_by(Role::kOperator, "/api/v1/devices"), some = asked_by(Role::kViewer, "/api/v1/devices");
  EXPECT_EQ(all["next"]["camera"]["device"], picture());
  EXPECT_EQ(all["laser"]["port"], config.laser.port);
  EXPECT_EQ(some["next"]["camera"]["kind"], "file");
  EXPECT_THAT(some.dump(), Not(HasSubstr(directory.path().string())));
}

TEST_F(DeviceRoutes, NoRestartOutOfAnAbort) {
  cell->runner->abort("STOP");
  reactor.restart();
  while (cell->runner->view().state != CellState::kAborted && reactor.run_one_for(std::chrono::seconds(10)) > 0) {
  }
  EXPECT_THAT(answer("POST", "/api/v1/restart").dump(), HasSubstr("Clear it"));
  EXPECT_EQ(status, 409);
  EXPECT_THAT(answer("GET", "/api/v1/devices")["restart_refused"].get<std::string>(), HasSubstr("Clear it"));
  EXPECT_EQ(restarts, 0);
}

TEST_F(DeviceRoutes, NobodyRestartsADaemonThatWasStartedByHand) {
  // The first router was bound before there was anybody.
  const ApiReply refused = ask("POST", "/api/v1/restart");
  EXPECT_EQ(refused.status, 409);
  EXPECT_THAT(refused.body, HasSubstr("started by hand"));
}

TEST_F(DeviceRoutes, ThereIsAFolderForACamerasProgramAndItIsNamed) {
  EXPECT_EQ(answer("GET", "/api/v1/devices")["camera_folder"], camera_folder(config.store.data_dir).string());
  const fs::perms group = fs::status(camera_folder(config.store.data_dir)).permissions() & fs::perms::group_write;
  EXPECT_EQ(group, fs::perms::group_write);
  EXPECT_TRUE(camera_folder("data").is_absolute()) << "a choice names a picture by its whole path";
}

TEST_F(DeviceRoutes, TheStatusSaysWhichLaserItIsAndToOperatorsWhere) {
  const json laser = answer("GET", "/api/v1/status")["laser"];
  EXPECT_EQ(laser["kind"], "lihuiyu");
  EXPECT_EQ(laser["port"], config.laser.port);
  EXPECT_EQ(laser["set_by"], "file");
  const json seen = asked_by(Role::kViewer, "/api/v1/status");
  EXPECT_EQ(seen["laser"]["kind"], "lihuiyu");
  EXPECT_TRUE(seen["laser"]["port"].is_null()) << seen;
  EXPECT_THAT(seen.dump(), Not(HasSubstr(directory.path().string())));
  EXPECT_EQ(asked_by(Role::kOperator, "/api/v1/status")["laser"]["port"], config.laser.port);
}

TEST_F(DeviceRoutes, AnAlarmSaysWhereToOperatorsOnly) {
  const std::string here = directory.path().string();
  cell->alarms.take({{"laser", true, "there are 2 devices: add the place of the right one, one of 1-2, 1-3"},
                     {"aborted", true, "the serial port " + here + "/tty does not open (gone): check the cable"}},
                    "2026-01-01T00:00:00Z");
  EXPECT_THAT(asked_by(Role::kOperator, "/api/v1/alarms").dump(), AllOf(HasSubstr(here), HasSubstr("1-2, 1-3")));
  const std::string some = asked_by(Role::kViewer, "/api/v1/alarms").dump();
  EXPECT_THAT(some, AllOf(Not(HasSubstr(here)), Not(HasSubstr("1-2, 1-3"))));
  EXPECT_THAT(some, HasSubstr("the serial port (an operator is told where) does not open (gone): check the cable"));
}

TEST_F(DeviceRoutes, AnAbortForWantOfALaserDoesNotSayWhyToViewers) {
  const std::string why = "there are 2 devices: add the place of the right one, one of 1-2, 1-3";
  cell->alarms.take({{"laser", true, why}, {"aborted", true, "the laser was lost, " + why}}, "2026-01-01T00:00:00Z");
  cell->alarms.take({}, "2026-01-01T00:01:00Z");
  EXPECT_THAT(asked_by(Role::kOperator, "/api/v1/alarms").dump(), HasSubstr("the laser was lost"));
  EXPECT_THAT(asked_by(Role::kViewer, "/api/v1/alarms").dump(), Not(HasSubstr("1-2, 1-3")));
}

TEST_F(DeviceRoutes, ATaskSaysWhereItFailedToOperatorsOnly) {
  const TaskReporter scan = cell->tasks.start("scan", "reading /dev/bus/usb/001/004");
  scan.fail({ErrorCode::kStorage, "/var/lib/veneerd/scan.tif cannot be written: make room"});
  while (cell->tasks.find(scan.id())->state == TaskState::kRunning) reactor.restart(), reactor.run_one();
  const auto told = [this](Role asking, const std::string& target) {
    role = asking;
    return body_of(ask("GET", target)).dump();
  };
  for (const std::string& target : {std::string("/api/v1/tasks"), fmt::format("/api/v1/tasks/{}", scan.id())}) {
    EXPECT_THAT(told(Role::kOperator, target), AllOf(HasSubstr("/var/lib"), HasSubstr("/dev/bus"))) << target;
    EXPECT_THAT(told(Role::kViewer, target),
                AllOf(Not(HasSubstr("/var/lib")), Not(HasSubstr("/dev/bus")), HasSubstr("make room")))
        << target;
  }
}

TEST_F(DeviceRoutes, WhoeverLooksOnIsNotToldWhereAGlanceFailed) {
  const std::string all = asked_by(Role::kOperator, "/api/v1/bed/glance.jpg").dump();
  const std::string some = asked_by(Role::kViewer, "/api/v1/bed/glance.jpg").dump();
  EXPECT_THAT(some, HasSubstr("the camera gives no picture; an operator is told why")) << all;
  EXPECT_THAT(all, Not(HasSubstr("an operator is told why")));
}

class LaserThatDoesNotOpen : public testing::RoutedCell {
 protected:
  LaserThatDoesNotOpen()
      : RoutedCell([this](const fs::path&) {
          config.laser.kind = "grbl";
          config.laser.port = "serial:" + (directory / "no-laser").string() + "?baud=115200";
        }) {}
};

// The threads that answer questions refuse some changes themselves; the audit log's lists are the reactor's.
TEST_F(DeviceRoutes, WhatAnotherThreadRefusesIsNotedInTheReactorsTurn) {
  const auto noted = [this] {
    const auto rows = cell->database->call([](Repositories& r) { return r.audit.latest(20); });
    EXPECT_TRUE(rows.ok());
    return rows ? std::ranges::count(*rows, "api.chooseDevice.refused", &db::AuditEntry::what) : -1;
  };
  std::thread([this] {
    const Caller caller{Role::kOperator, "uid 1000", TransportKind::kUnix};
    cell->change_audit->note({caller, "chooseDevice", "no such laser", true});
  }).join();
  EXPECT_EQ(noted(), 0);
  reactor.restart();
  reactor.poll();
  EXPECT_EQ(noted(), 1);
}

TEST_F(LaserThatDoesNotOpen, IsNamedByItsPortToOperatorsOnly) {
  ask("POST", "/api/v1/commands/reset");
  reactor.restart();
  while (cell->runner->view().state != CellState::kAborted && reactor.run_one_for(std::chrono::seconds(10)) > 0) {
  }
  const json all = cell->status(Role::kOperator), some = cell->status(Role::kViewer);
  EXPECT_THAT(all["laser"]["why_not_connected"].get<std::string>(), HasSubstr("no-laser does not open"));
  EXPECT_THAT(all["reason"].get<std::string>(), HasSubstr("no-laser does not open"));
  EXPECT_EQ(some["laser"]["why_not_connected"], "the laser is not connected; an operator is told why");
  EXPECT_EQ(some["reason"], "the laser is not connected; an operator is told why");
  EXPECT_THAT(some.dump(), AllOf(Not(HasSubstr("no-laser")), Not(HasSubstr(directory.path().string()))));
}

}  // namespace
}  // namespace veneer::daemon
