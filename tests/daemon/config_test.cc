#include "daemon/config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "calib/veneer_mask.h"

namespace veneer::daemon {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class ConfigTest : public ::testing::Test {
 protected:
  Result<Config> parse(const std::string& text) {
    std::ofstream(file_) << text;
    return load_config(file_);
  }
  void TearDown() override { std::filesystem::remove(file_); }
  std::filesystem::path file_ =
      std::filesystem::temp_directory_path() / ("veneer-config-" + std::to_string(getpid()) + ".toml");
};

TEST_F(ConfigTest, AnEmptyFileIsTheSimulatedCell) {
  const auto config = parse("");
  ASSERT_TRUE(config.ok());
  EXPECT_EQ(config->laser.kind, "sim");
  EXPECT_EQ(config->api.listen, "127.0.0.1:8765");
  EXPECT_DOUBLE_EQ(parse("[sim]\ntime_scale = 40\n")->sim.time_scale, 40);
}

TEST_F(ConfigTest, TheMaskKeepsTheMarginsThatAreWritten) {
  const auto usual = parse("");
  ASSERT_TRUE(usual.ok());
  EXPECT_EQ(usual->mask.edge_margin, calib::MaskOptions{}.edge_margin);
  EXPECT_EQ(usual->mask.round_margin, calib::MaskOptions{}.screw_margin);
  const auto wider = parse("[mask]\nedge_margin_mm = 1.5\nround_margin_mm = 2\n");
  ASSERT_TRUE(wider.ok()) << wider.error().message;
  EXPECT_EQ(wider->mask.edge_margin, 1.5_mm);
  EXPECT_EQ(wider->mask.round_margin, 2_mm);
  EXPECT_FALSE(parse("[mask]\nedge_margin_mm = 0.1\n").ok()) << "a strip's outermost pixels show the board as well";
  EXPECT_FALSE(parse("[mask]\nedge_margin_mm = 3\n").ok()) << "no wood would reach the edge of a scan that broke off";
  EXPECT_FALSE(parse("[mask]\nround_margin_mm = 20\n").ok());
}

TEST_F(ConfigTest, ReadsWhatIsWritten) {
  const auto config = parse(R"(
[laser]
kind = "grbl"
port = "tcp:192.0.2.1:23"
focus_z_mm = -40
[recipe]
cut_speed_mm_s = 12
cut_power = 0.5
)");
  ASSERT_TRUE(config.ok());
  EXPECT_EQ(config->laser.port, "tcp:192.0.2.1:23");
  EXPECT_EQ(config->laser.focus_z, Millimetres(-40));
  EXPECT_DOUBLE_EQ(config->recipe.cut_speed.count(), 12);
  EXPECT_DOUBLE_EQ(config->recipe.cut_power.count(), 0.5);
}

// ---- Devices that are chosen --------------------------------------------------------------------------------------

constexpr const char* kOpen = "[devices]\nchoose = true\n";
constexpr const char* kPort = "serial:/dev/veneer/laser-A50285BI?baud=115200";

ChosenDevices real_laser() {
  ChosenDevices chosen;
  chosen.laser.kind = "grbl";
  chosen.laser.port = kPort;
  return chosen;
}

class ChosenDevicesTest : public ConfigTest {
 protected:
  ChosenDevicesTest() { std::filesystem::create_directories(data_dir_); }
  ~ChosenDevicesTest() override { std::filesystem::remove_all(data_dir_); }
  Result<Config> with(const std::string& by_hand, const ChosenDevices& chosen = real_laser()) {
    std::ofstream(file_) << by_hand;
    return load_config(file_, chosen_devices_text(chosen));
  }
  // As the daemon starts, with this content of the file in its data folder.
  Result<Config> start(const std::string& chosen) {
    std::ofstream(kept_) << chosen;
    return start();
  }
  Result<Config> start() { return parse(std::string(kOpen) + "[store]\ndata_dir = \"" + data_dir_.string() + "\"\n"); }
  const std::filesystem::path data_dir_ =
      std::filesystem::temp_directory_path() / ("veneer-chosen-" + std::to_string(getpid()));
  const std::filesystem::path kept_ = data_dir_ / kChosenDevicesName;
};

TEST_F(ChosenDevicesTest, TakeThePlaceOfSimulatedOnesOnlyWhereTheFileSaysSo) {
  for (const char* open : {"", "[laser]\nkind = \"sim\"\n"}) {
    const auto config = with(std::string(kOpen) + open);
    ASSERT_TRUE(config.ok()) << config.error().message;
    EXPECT_EQ(config->laser.set_by, SetBy::kChoice);
    EXPECT_EQ(config->laser.port, kPort);
    EXPECT_EQ(config->scanner.set_by, SetBy::kNobody);
    EXPECT_EQ(config->scanner.kind, "sim");
  }
  for (const char* closed : {"", "[laser]\nkind = \"sim\"\n", "[devices]\nchoose = false\n"}) {
    const auto config = with(closed);
    ASSERT_TRUE(config.ok()) << config.error().message;
    EXPECT_EQ(config->laser.set_by, SetBy::kFile) << closed;
    EXPECT_EQ(config->laser.kind, "sim") << closed;
    EXPECT_FALSE(config->devices.chosen);
  }
  const auto by_hand = with(std::string(kOpen) + "[laser]\nkind = \"lihuiyu\"\nport = \"usb:1a86:5512\"\n");
  ASSERT_TRUE(by_hand.ok()) << by_hand.error().message;
  EXPECT_EQ(by_hand->laser.set_by, SetBy::kFile);
  EXPECT_EQ(by_hand->laser.port, "usb:1a86:5512");
}

TEST_F(ChosenDevicesTest, NothingWrittenBesideASimulatedLaserIsSaidOfAChosenOne) {
  const std::string beside = std::string(kOpen) +
                             "[laser]\nkind = \"sim\"\nfocus_z_mm = -40\n[before_motion]\nconfirm = [\"exhaust\", "
                             "\"goggles\"]\nfocus = false\n";
  const auto simulated = with(beside, {});
  ASSERT_TRUE(simulated.ok()) << simulated.error().message;
  EXPECT_EQ(simulated->laser.focus_z, Millimetres(-40));
  EXPECT_FALSE(simulated->before_motion.focus);
  const auto real = with(beside);
  ASSERT_TRUE(real.ok()) << real.error().message;
  EXPECT_FALSE(real->laser.focus_z) << "no head is driven down to where another one has its focus";
  EXPECT_TRUE(real->before_motion.focus);
  EXPECT_THAT(real->before_motion.confirm, ::testing::ElementsAre("exhaust", "air assist", "cooling", "goggles"));
  EXPECT_EQ(with(std::string(kOpen) + "[before_motion]\nconfirm = []\n")->before_motion.confirm.size(), 3U);
  EXPECT_EQ(controller_at(real->laser), "real");
}

TEST_F(ChosenDevicesTest, AreReadBackAsTheyWereKept) {
  ChosenDevices wanted;
  wanted.laser.kind = "lihuiyu";
  wanted.laser.port = "usb:1a86:5512@1-2.4";
  wanted.laser.board = "m3";
  wanted.laser.travel_x = 320_mm;
  wanted.scanner.kind = "sane";
  wanted.scanner.device = "A \"Scanner\" \\ 3";
  wanted.scanner.dpi = 600;
  wanted.camera.kind = "file";
  wanted.camera.device = "/var/lib/veneerd/camera/bed.jpg";
  const auto read = start(chosen_devices_text(wanted));
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->laser.port, wanted.laser.port);
  EXPECT_EQ(read->laser.board, "m3");
  EXPECT_EQ(read->laser.travel_x, 320_mm);
  EXPECT_EQ(read->scanner.device, wanted.scanner.device);
  EXPECT_DOUBLE_EQ(read->scanner.dpi, 600);
  EXPECT_EQ(read->camera.device, wanted.camera.device);
  ASSERT_TRUE(read->devices.chosen);
  EXPECT_EQ(chosen_devices_text(*read->devices.chosen), chosen_devices_text(wanted));
}

TEST_F(ChosenDevicesTest, AResolutionThatNobodyChoseIsTheFiles) {
  ChosenDevices scanner;
  scanner.scanner.kind = "sane";
  scanner.scanner.device = "Scanner 3";
  EXPECT_DOUBLE_EQ(with(std::string(kOpen) + "[scanner]\ndpi = 600\n", scanner)->scanner.dpi, 600);
  EXPECT_EQ(chosen_devices_text(scanner).find("dpi"), std::string::npos);
  scanner.scanner.dpi = 400;
  EXPECT_DOUBLE_EQ(with(std::string(kOpen) + "[scanner]\ndpi = 600\n", scanner)->scanner.dpi, 400);
}

TEST_F(ChosenDevicesTest, AFileThatIsNotWholeKeepsTheDaemonFromStarting) {
  EXPECT_TRUE(start().ok()) << "nobody has chosen yet";
  const std::string whole = chosen_devices_text(real_laser());
  ASSERT_TRUE(start(whole).ok());
  const std::string without_camera = whole.substr(0, whole.find("[camera]"));
  std::string without_kind = whole;
  without_kind.erase(without_kind.find("kind = \"grbl\"\n"), std::string("kind = \"grbl\"\n").size());
  const std::string elsewhere = "[laser]\nkind = \"grbl\"\nport = \"file:/tmp/x\"\n";
  for (const std::string& broken :
       {std::string(), std::string("\n"), without_camera, without_kind, whole.substr(0, whole.size() / 2),
        whole + "[sim]\ntime_scale = 1\n", whole + "zoom = 3\n", std::string("[camera\n"), elsewhere}) {
    const auto refused = start(broken);
    ASSERT_FALSE(refused.ok()) << broken;
    EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
    EXPECT_THAT(refused.error().message, HasSubstr(kept_.string()));
    EXPECT_THAT(refused.error().message, HasSubstr("remove it and choose laser, scanner and camera again"));
  }
  EXPECT_TRUE(parse("[store]\ndata_dir = \"" + data_dir_.string() + "\"\n").ok()) << "it takes no part then";
}

// Its content is nobody's fault then: to remove it would be the wrong advice.
TEST_F(ChosenDevicesTest, AFileThatMayNotBeReadIsNoneToRemove) {
  const auto loop = data_dir_ / "loop";
  std::filesystem::create_symlink(loop, loop);
  const auto refused = parse(std::string(kOpen) + "[store]\ndata_dir = \"" + loop.string() + "\"\n");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kStorage);
  EXPECT_THAT(refused.error().message, HasSubstr("cannot be read"));
  EXPECT_THAT(refused.error().message, ::testing::Not(HasSubstr("remove")));
}

TEST_F(ChosenDevicesTest, ARestoreNeedsNoneOfThem) {
  EXPECT_FALSE(start("[laser\n").ok());
  const auto written = load_written_config(file_);
  ASSERT_TRUE(written.ok()) << written.error().message;
  EXPECT_EQ(written->store.data_dir, data_dir_);
  EXPECT_FALSE(written->devices.chosen);
}

TEST_F(ChosenDevicesTest, APictureIsNamedByItsWholePath) {
  ChosenDevices wanted;
  wanted.camera.kind = "file", wanted.camera.device = "data/camera/bed.jpg";
  const auto refused = start(chosen_devices_text(wanted));
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, HasSubstr("\"data/camera/bed.jpg\" is no picture's whole path"));
}

ChosenDevices webcam() {
  ChosenDevices chosen;
  chosen.camera = {"v4l2", "/dev/v4l/by-id/usb-Cam_4711-video-index0",
                   1920,   1080,
                   "YUYV", {{"exposure_time_absolute", "200"}, {"focus_absolute", "35"}}};
  return chosen;
}

TEST_F(ChosenDevicesTest, ACameraOfThisComputerIsKeptWithAllThatItsPictureHangsOn) {
  const auto read = start(chosen_devices_text(webcam()));
  ASSERT_TRUE(read.ok()) << read.error().message;
  const CameraConfig& camera = read->camera;
  EXPECT_EQ(camera.set_by, SetBy::kChoice);
  EXPECT_EQ(camera.kind, "v4l2");
  EXPECT_EQ(camera.device, webcam().camera.device);
  EXPECT_EQ(camera.width, 1920);
  EXPECT_EQ(camera.height, 1080);
  EXPECT_EQ(camera.format, "YUYV");
  EXPECT_EQ(camera.options, webcam().camera.options);
  EXPECT_EQ(camera.frames, 4);
  EXPECT_EQ(chosen_devices_text(*read->devices.chosen), chosen_devices_text(webcam()));
  ChosenDevices bare = webcam();
  bare.camera.options.clear();
  EXPECT_TRUE(start(chosen_devices_text(bare)).ok()) << "there are cameras without settings";
}

// A guess would be another part of the sensor than the one that is calibrated.
TEST_F(ChosenDevicesTest, EachLineOfACameraIsNeededAndItsNameLasts) {
  const std::string whole = chosen_devices_text(webcam());
  for (const std::string line : {"device", "width", "height", "format"}) {
    std::string without = whole;
    const auto begin = without.find(line + " = ");
    ASSERT_NE(begin, std::string::npos) << line;
    without.erase(begin, without.find('\n', begin) + 1 - begin);
    EXPECT_FALSE(start(without).ok()) << without;
  }
  for (const char* name :
       {"/dev/video0", "v4l/by-id/x", "/dev/v4l/by-id/", "/dev/v4l/by-id/..", "/dev/serial/by-id/x"}) {
    ChosenDevices other = webcam();
    other.camera.device = name;
    EXPECT_THAT(start(chosen_devices_text(other)).error().message, HasSubstr("no lasting name of a camera")) << name;
  }
  ChosenDevices other = webcam();
  other.camera.format = "H264";
  EXPECT_FALSE(start(chosen_devices_text(other)).ok());
}

// A board knows neither what it is nor its travel: a guess would drive the head against its frame.
TEST_F(ChosenDevicesTest, EachLineOfABoardIsNeeded) {
  ChosenDevices wanted;
  wanted.laser.kind = "lihuiyu";
  wanted.laser.port = "usb:1a86:5512@1-2.4";
  const std::string whole = chosen_devices_text(wanted);
  ASSERT_TRUE(start(whole).ok());
  for (const std::string line : {"kind", "port", "board", "travel_x_mm", "travel_y_mm"}) {
    std::string without = whole;
    const auto begin = without.find(line + " = ");
    ASSERT_NE(begin, std::string::npos) << line;
    without.erase(begin, without.find('\n', begin) + 1 - begin);
    EXPECT_FALSE(start(without).ok()) << without;
  }
}

TEST_F(ChosenDevicesTest, AFileThatCannotBeReadIsNotTakenForNone) {
  std::filesystem::create_directory(kept_);
  EXPECT_THAT(start().error().message, HasSubstr("it is no plain file"));
  std::filesystem::remove(kept_);
  std::filesystem::create_symlink(data_dir_ / "gone", kept_);
  EXPECT_THAT(start().error().message, HasSubstr(kept_.string()));
}

TEST_F(ChosenDevicesTest, AChoiceThatDoesNotFitTheFileIsAnError) {
  EXPECT_THAT(with(std::string(kOpen) + "[sim]\ntime_scale = 40\n").error().message,
              HasSubstr("sim.time_scale is 40, but the laser is a real one"));
}

TEST_F(ChosenDevicesTest, AreDescribedWithWhoSaidSo) {
  EXPECT_EQ(describe_devices(*with(kOpen)),
            std::string("laser: grbl ") + kPort +
                ", chosen; scanner: simulated, nothing is chosen; camera: simulated, nothing is chosen");
  EXPECT_EQ(describe_devices(*with("")), "laser: simulated; scanner: simulated; camera: simulated");
}

TEST_F(ConfigTest, ReadsHowAScannerIsSet) {
  const auto config = parse(R"(
[scanner]
kind = "sane"
device = "EPSON Perfection V39"
dpi = 600
mode = "Color"
source = "Flatbed"
depth = 16
area_mm = [0, 5.5, 210, 290]
sane_config_dir = "/tmp"
[scanner.options]
lamp-off-time = 15
"quality-cal" = true
gamma = "User defined"
)");
  ASSERT_TRUE(config.ok()) << config.error().message;
  EXPECT_EQ(config->scanner.device, "EPSON Perfection V39");
  EXPECT_EQ(config->scanner.mode, "Color");
  EXPECT_EQ(config->scanner.source, "Flatbed");
  EXPECT_EQ(config->scanner.depth, 16);
  EXPECT_THAT(config->scanner.area_mm, ::testing::ElementsAre(0, 5.5, 210, 290));
  EXPECT_EQ(config->scanner.sane_config, "/tmp");
  EXPECT_THAT(config->scanner.options, ::testing::UnorderedElementsAre(::testing::Pair("lamp-off-time", "15"),
                                                                       ::testing::Pair("quality-cal", "true"),
                                                                       ::testing::Pair("gamma", "User defined")));
}

TEST_F(ConfigTest, NamesWhatIsWrongWithAScanner) {
  const auto why = [this](const std::string& lines) {
    const auto config = parse("[scanner]\n" + lines + "\n");
    EXPECT_FALSE(config.ok()) << lines;
    return config ? "" : config.error().message;
  };
  EXPECT_THAT(why("kind = \"usb\""), HasSubstr("use file, sane, sim"));
  EXPECT_THAT(why("mode = \"Color\""), HasSubstr("scanner.mode is for kind = \"sane\" only"));
  EXPECT_THAT(why("kind = \"file\"\narea_mm = [0, 0, 1, 1]"), HasSubstr("scanner.area_mm is for kind"));
  const std::string sane = "kind = \"sane\"\n";
  EXPECT_THAT(why(sane + "depth = 12"), HasSubstr("scanner.depth = 12 is not possible: use 8 or 16"));
  EXPECT_THAT(why(sane + "area_mm = [0, 0, 100]"), HasSubstr("a list of 4 numbers"));
  EXPECT_THAT(why(sane + "area_mm = [0, -1, 100, 100]"), HasSubstr("a list of 4 numbers"));
  EXPECT_THAT(why(sane + "area_mm = [0, 0, 100, 0]"), HasSubstr("no width or no height"));
  EXPECT_THAT(why(sane + "options = 3"), HasSubstr("write [scanner.options]"));
  EXPECT_THAT(why(sane + "options = {lamp = [1]}"), HasSubstr("scanner.options.lamp must be"));
  EXPECT_THAT(why(sane + "sane_config_dir = \"/nowhere/at/all\""), HasSubstr("is no folder"));
  EXPECT_THAT(why(sane + "resolution = 300"), HasSubstr("scanner.resolution is not a setting"));
}

TEST_F(ConfigTest, ReadsHowACameraIsSet) {
  const auto config = parse(R"(
[camera]
kind = "v4l2"
device = "/dev/v4l/by-id/usb-046d_HD_Pro_Webcam_C920_1234ABCD-video-index0"
width = 1920
height = 1080
frames = 8
format = "YUYV"
options = { focus_absolute = 30, exposure_dynamic_framerate = false }
)");
  ASSERT_TRUE(config.ok()) << config.error().message;
  EXPECT_EQ(config->camera.kind, "v4l2");
  EXPECT_EQ(config->camera.device, "/dev/v4l/by-id/usb-046d_HD_Pro_Webcam_C920_1234ABCD-video-index0");
  EXPECT_EQ(config->camera.width, 1920);
  EXPECT_EQ(config->camera.height, 1080);
  EXPECT_EQ(config->camera.frames, 8);
  EXPECT_EQ(config->camera.format, "YUYV");
  EXPECT_THAT(config->camera.options,
              ::testing::UnorderedElementsAre(::testing::Pair("focus_absolute", "30"),
                                              ::testing::Pair("exposure_dynamic_framerate", "false")));
  EXPECT_EQ(stock_refusal(*config), "");
}

TEST_F(ConfigTest, NamesWhatIsWrongWithACamera) {
  const auto why = [this](const std::string& lines) {
    const auto config = parse("[camera]\n" + lines + "\n");
    EXPECT_FALSE(config.ok()) << lines;
    return config ? "" : config.error().message;
  };
  EXPECT_THAT(why("kind = \"usb\""), HasSubstr("use file, v4l2, sim"));
  EXPECT_THAT(why("width = 640"), HasSubstr("camera.width is for kind = \"v4l2\" only"));
  EXPECT_THAT(why("kind = \"file\"\noptions = {focus_absolute = 3}"), HasSubstr("camera.options is for kind"));
  const std::string named = "kind = \"v4l2\"\ndevice = \"/dev/v4l/by-path/pci-1-usb-1-video-index0\"\n";
  const std::string whole = named + "width = 640\nheight = 480\nformat = \"YUYV\"\n";
  EXPECT_THAT(why(named + "width = 640"),
              AllOf(HasSubstr("camera.height is missing"), HasSubstr("veneerctl camera list")));
  EXPECT_THAT(why(named + "width = 640\nheight = 480"),
              AllOf(HasSubstr("camera.format is missing"), HasSubstr("veneerctl camera list")));
  EXPECT_THAT(why(named + "width = 20000\nheight = 2501\nformat = \"GREY\""), HasSubstr("more than 50 million pixels"));
  EXPECT_TRUE(parse("[camera]\n" + named + "width = 20000\nheight = 2500\nformat = \"GREY\"\n").ok());
  EXPECT_THAT(why("kind = \"v4l2\"\nwidth = 640\nheight = 480"), HasSubstr("camera.device is missing"));
  EXPECT_THAT(why(whole + "frames = 0"), HasSubstr("camera.frames = 0 is out of range: use 1 to 64"));
  EXPECT_THAT(why(named + "width = 640\nheight = 480\nformat = \"H264\""), HasSubstr("is not known here: use RGB3"));
  EXPECT_THAT(why(whole + "options = 3"), HasSubstr("write [camera.options]"));
  EXPECT_THAT(why(whole + "exposure = 3"), HasSubstr("camera.exposure is not a setting"));
  for (const char* device : {"/dev/video0", "/dev/veneer/laser0", "/dev/v4l/by-id/", "/dev/v4l/by-id/../../ttyUSB0",
                             "/dev/v4l/by-id/..", "/dev/v4l/by-path/.", ""})
    EXPECT_THAT(
        why(std::string("kind = \"v4l2\"\nwidth = 640\nheight = 480\nformat = \"GREY\"\ndevice = \"") + device + "\""),
        HasSubstr("is no lasting name of a camera"))
        << device;
}

TEST_F(ConfigTest, TakesV4lForAnotherNameOfV4l2) {
  const auto config = parse(R"(
[camera]
kind = "v4l"
device = "/dev/v4l/by-id/usb-Cam_4711-video-index0"
width = 1920
height = 1080
format = "YUYV"
)");
  ASSERT_TRUE(config.ok()) << config.error().message;
  EXPECT_EQ(config->camera.kind, "v4l2");
  EXPECT_EQ(config->camera.width, 1920);
}

TEST_F(ConfigTest, ReadsWhoIsToldWhatHappens) {
  const auto config = parse(R"(
[notify]
webhook = "https://[2001:db8::7]/api/webhook/cell?key=1"
webhook_format = "text"
mqtt = "mqtt://broker.example:1884"
mqtt_topic = "workshop/laser"
)");
  ASSERT_TRUE(config.ok()) << config.error().message;
  ASSERT_TRUE(config->notify.webhook && config->notify.mqtt);
  EXPECT_TRUE(config->notify.webhook->tls);
  EXPECT_EQ(config->notify.webhook->host, "2001:db8::7");
  EXPECT_EQ(config->notify.webhook->port, 443);
  EXPECT_EQ(config->notify.webhook->path, "/api/webhook/cell?key=1");
  EXPECT_EQ(config->notify.mqtt->host, "broker.example");
  EXPECT_EQ(config->notify.mqtt->port, 1884);
  EXPECT_FALSE(config->notify.mqtt->tls);
  EXPECT_FALSE(parse("")->notify.webhook);
  for (const char* wrong :
       {"webhook = \"ftp://host/\"", "webhook = \"http://\"", "webhook = \"http://host:x/\"",
        "webhook = \"http://me:secret@host/\"", "webhook = \"http://host/a b\"", "webhook = \"http://host:70000/\"",
        "webhook_format = \"xml\"", "mqtt = \"http://host\"", "mqtt = \"mqtt://host/topic\"", "mqtt_topic = \"all/#\""})
    EXPECT_FALSE(parse(std::string("[notify]\n") + wrong + "\n").ok()) << wrong;
}

TEST_F(ConfigTest, ReadsWhatWorkersMayTake) {
  const auto config =
      parse("[workers]\nmemory_mb = 2000\nplanning_limit_s = 60\nscan_limit_s = 30\nlook_limit_s = 5\n");
  ASSERT_TRUE(config.ok());
  EXPECT_EQ(config->workers.memory_mb, 2000);
  EXPECT_EQ(config->workers.planning_limit_s, 60);
  EXPECT_EQ(config->workers.scan_limit_s, 30);
  EXPECT_EQ(config->workers.look_limit_s, 5);
  EXPECT_EQ(parse("")->workers.memory_mb, 0) << "as much as the machine has to give";
  EXPECT_FALSE(parse("[workers]\nlook_limit_s = 0\n").ok());
}

TEST_F(ConfigTest, ARealLaserAsksForExhaustAirCoolingAndFocusUnlessTold) {
  EXPECT_TRUE(parse("")->before_motion.confirm.empty());
  EXPECT_FALSE(parse("")->before_motion.focus);
  const std::string real = "[laser]\nkind = \"grbl\"\nport = \"serial:/dev/ttyUSB0\"\n";
  EXPECT_EQ(parse(real)->before_motion.confirm, (std::vector<std::string>{"exhaust", "air assist", "cooling"}));
  EXPECT_TRUE(parse(real)->before_motion.focus);
  const auto told = parse(real + "[before_motion]\nconfirm = [\"fan\"]\nfocus = false\n");
  ASSERT_TRUE(told.ok());
  EXPECT_EQ(told->before_motion.confirm, std::vector<std::string>{"fan"});
  EXPECT_FALSE(told->before_motion.focus);
}

TEST_F(ConfigTest, WhateverIsNotKnownToBeSomethingElseIsARealLaser) {
  const auto at = [&](const std::string& laser) {
    const auto config = parse("[laser]\n" + laser);
    return config ? std::string(controller_at(config->laser)) : config.error().message;
  };
  EXPECT_EQ(at("kind = \"sim\"\n"), "twin");
  EXPECT_EQ(at("kind = \"lihuiyu\"\nport = \"twin:/run/laser\"\n"), "twin");
  EXPECT_EQ(at("kind = \"grbl\"\nport = \"file:/tmp/x.nc\"\n"), "file");
  EXPECT_EQ(at("kind = \"grbl\"\nport = \"serial:/dev/pts/3\"\n"), "real");
  EXPECT_EQ(at("kind = \"grbl\"\nport = \"tcp:127.0.0.1:23\"\n"), "real");
  EXPECT_EQ(at("kind = \"lihuiyu\"\nport = \"usb:1a86:5512\"\n"), "real");
  EXPECT_EQ(at("kind = \"grbl\"\nport = \"serial:/dev/ttyACM0\"\ntest_controller = true\n"), "test");
}

TEST_F(ConfigTest, ARealLaserCutsNoStockByASimulatedEye) {
  const std::string real = "[laser]\nkind = \"grbl\"\nport = \"serial:/dev/ttyUSB0\"\n", eye = "kind = \"file\"\n";
  const std::string scanner = "[scanner]\n" + eye, camera = "[camera]\n" + eye;
  EXPECT_THAT(stock_refusal(*parse(real)), HasSubstr("the scanner and the camera are simulated"));
  EXPECT_THAT(stock_refusal(*parse(real + scanner)), HasSubstr("the camera is simulated"));
  EXPECT_THAT(stock_refusal(*parse(real + camera)), HasSubstr("the scanner is simulated"));
  EXPECT_EQ(stock_refusal(*parse(real + scanner + camera)), "");
  EXPECT_EQ(stock_refusal(*parse(real + "test_controller = true\n")), "");
  EXPECT_EQ(stock_refusal(*parse("")), "");
}

TEST_F(ConfigTest, ReadsWhereTheHeadMustNotGo) {
  const auto config = parse(R"(
[framing]
max_power = 0.01
[[keep_out]]
name = "clamp"
x_mm = 10
y_mm = 20
width_mm = 30
height_mm = 40
[[keep_out]]
name = "foot"
x_mm = 500
width_mm = 20
height_mm = 380
)");
  ASSERT_TRUE(config.ok()) << config.error().message;
  EXPECT_DOUBLE_EQ(config->framing.max_power.count(), 0.01);
  ASSERT_EQ(config->keep_out.size(), 2U);
  EXPECT_EQ(config->keep_out[0].name, "clamp");
  EXPECT_EQ(config->keep_out[0].area.max, point<MachineFrame>(40, 60));
  EXPECT_EQ(config->keep_out[1].area.min, point<MachineFrame>(500, 0));
  EXPECT_THAT(parse("[[keep_out]]\nwide = 3\n").error().message, HasSubstr("keep_out.wide"));
  EXPECT_THAT(parse("[keep_out]\nname = \"x\"\n").error().message, HasSubstr("[[keep_out]]"));
  EXPECT_THAT(parse("[before_motion]\nconfirm = [1]\n").error().message, HasSubstr("before_motion.confirm"));
}

TEST_F(ConfigTest, ReadsWhatALihuiyuBoardDoesNotKnowOfItself) {
  const auto config =
      parse("[laser]\nkind = \"lihuiyu\"\nport = \"usb:1a86:5512\"\nboard = \"m3\"\ntravel_x_mm = 320\n");
  ASSERT_TRUE(config.ok()) << config.error().message;
  EXPECT_EQ(config->laser.board, "m3");
  EXPECT_DOUBLE_EQ(config->laser.travel_x.count(), 320);
  EXPECT_DOUBLE_EQ(config->laser.travel_y.count(), 200);
}

struct Mistake {
  const char* text;
  const char* names;  // what the sentence must name
};

class BrokenConfig : public ConfigTest, public ::testing::WithParamInterface<Mistake> {};

TEST_P(BrokenConfig, IsRefusedWithOneSentenceThatNamesLineAndKey) {
  const auto config = parse(GetParam().text);
  ASSERT_FALSE(config.ok());
  EXPECT_EQ(config.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(config.error().message, HasSubstr(GetParam().names));
  EXPECT_THAT(config.error().message, HasSubstr(file_.string()));
}

INSTANTIATE_TEST_SUITE_P(
    Mistakes, BrokenConfig,
    ::testing::Values(Mistake{"[laser]\nkidn = \"sim\"\n", ":2: laser.kidn is not a setting"},
                      Mistake{"[lasr]\n", ":1: [lasr] is not a section"},
                      Mistake{"[laser]\nkind = \"laserjet\"\n", "laser.kind = \"laserjet\""},
                      Mistake{"[laser]\nkind = 3\n", "laser.kind must be a text"},
                      Mistake{"[recipe]\ncut_power = 1.5\n", ":2: recipe.cut_power = 1.5 is out of range"},
                      Mistake{"[recipe]\ncut_power = \"high\"\n", "recipe.cut_power must be a number"},
                      Mistake{"[recipe]\ncut_power = nan\n", "recipe.cut_power"},
                      Mistake{"[laser]\nkind = \"grbl\"\n", "laser.port is missing"},
                      Mistake{"[laser]\nkind = \"lihuiyu\"\n", "as in \"usb:1a86:5512\""},
                      Mistake{"[laser]\nkind = \"lihuiyu\"\nport = \"usb:1a86:5512\"\nboard = \"m4\"\n", "laser.board"},
                      Mistake{"[laser]\nkind = \"grbl\"\nport = \"file:/x\"\nboard = \"m2\"\n", ":4: laser.board"},
                      Mistake{"[recipe]\nmark_min_height_mm = 3\n", "larger than recipe.mark_height_mm"},
                      Mistake{"[recipe]\ncut_order = \"long\"\n", ":2: recipe.cut_order"},
                      Mistake{"[laser]\nkind = \"grbl\"\nport = \"file:/x\"\n[sim]\ntime_scale = 40\n",
                              "sim.time_scale"},
                      Mistake{"[laser]\ntest_controller = true\n", "laser.test_controller belongs to"},
                      Mistake{"laser = 3\n", "laser must be a table"}, Mistake{"[laser\n", ":1:"}));

TEST_F(ConfigTest, AMissingFileIsNamed) {
  const auto config = load_config("/nonexistent/veneerd.toml");
  ASSERT_FALSE(config.ok());
  EXPECT_EQ(config.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(config.error().message, HasSubstr("/nonexistent/veneerd.toml"));
}

}  // namespace
}  // namespace veneer::daemon
