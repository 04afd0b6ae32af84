// The twin's parts put together as its process does: service, socket, pty, and the cell's own drivers at the other end.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <poll.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <thread>

#include "drivers/sim/client/sim_camera.h"
#include "drivers/sim/client/sim_scanner.h"
#include "drivers/sim/laser_port.h"
#include "drivers/sim/twin_config.h"
#include "drivers/sim/twin_server.h"
#include "drivers/sim/twin_service.h"
#include "tests/support/temp_directory.h"

namespace veneer::sim {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

TwinSettings small_cell() {
  TwinSettings settings;
  settings.sheet_dpi = 100;
  settings.scanner.width_mm = 220, settings.scanner.height_mm = 160;
  settings.camera.width_px = 640, settings.camera.height_px = 480;
  return settings;
}

class RunningTwin {
 public:
  RunningTwin()
      : world_(*World::open(small_cell(), dir_.path() / "state", make_null_logger())),
        laser_(io_, clock_, *world_, {dir_.path() / "laser", true, 520, 380, 0.01, 1}, make_null_logger()),
        service_(*world_, laser_, make_null_logger()),
        server_(io_, service_, make_null_logger()) {
    EXPECT_TRUE(laser_.open().ok());
    EXPECT_TRUE(server_.listen(socket()).ok());
    thread_ = std::thread([this] { io_.run(); });
  }
  ~RunningTwin() {
    io_.stop();
    thread_.join();
    server_.stop();
  }
  std::string socket() const { return (dir_.path() / "twin.sock").string(); }
  std::filesystem::path path(const std::string& name) const { return dir_.path() / name; }
  Result<json> ask(const json& request) const { return TwinLink(socket()).request(request); }
  void must(const json& request) const {
    const Result<json> reply = ask(request);
    EXPECT_TRUE(reply.ok()) << reply.error().message;
  }

 private:
  testing::TempDirectory dir_;
  boost::asio::io_context io_;
  ScaledClock clock_{200};
  std::unique_ptr<World> world_;
  LaserPort laser_;
  TwinService service_;
  TwinServer server_;
  std::thread thread_;
};

// The cell's end of the pty.
class Line {
 public:
  explicit Line(const std::filesystem::path& port) : fd_(::open(port.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC)) {}
  ~Line() { hang_up(); }
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;
  bool is_open() const { return fd_ >= 0; }
  void hang_up() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }
  void send(std::string_view text) const {
    EXPECT_EQ(::write(fd_, text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  // Reads until `text` came or the other side is silent for 5 s; says what came.
  std::string read_until(std::string_view text) {
    std::string came;
    while (came.find(text) == std::string::npos) {
      pollfd wait{fd_, POLLIN, 0};
      std::array<char, 512> chunk{};
      if (::poll(&wait, 1, 5000) <= 0) break;
      const ssize_t n = ::read(fd_, chunk.data(), chunk.size());
      if (n <= 0) break;
      came.append(chunk.data(), static_cast<std::size_t>(n));
    }
    return came;
  }

 private:
  int fd_;
};

TEST(TwinProcess, GivesTheCellScansAndRecordsTheirTruth) {
  const RunningTwin twin;
  twin.must({{"cmd", "new-panel"}, {"name", "P"}, {"width_mm", 200}, {"height_mm", 140}});
  twin.must({{"cmd", "place"}, {"sheet", "P"}, {"on", "scanner"}, {"face", "show"}});
  SimScanner scanner(twin.socket());
  const Result<ScanFile> scan = scanner.scan(ScanResolution::from_dpi(150), nullptr, {});
  ASSERT_TRUE(scan.ok()) << scan.error().message;
  EXPECT_EQ(scan->device, "twin:capture-1");
  EXPECT_NEAR(scan->nominal.dpi(), 150, 1e-9);
  EXPECT_EQ(cv::imread(scan->file.string()).cols, 1299);
  EXPECT_TRUE(std::filesystem::exists(twin.path("state/truth/capture-1.json")));
}

TEST(TwinProcess, HasTheUsualSheetsLyingAbout) {
  const RunningTwin twin;
  for (const char* sheet : {"grid", "board", "panel"})
    twin.must({{"cmd", "place"}, {"sheet", sheet}, {"on", "bed"}, {"face", "show"}});
  twin.must({{"cmd", "place"}, {"sheet", "panel"}, {"on", "bed"}, {"face", "back"}, {"turn_deg", 2.0}});
  const auto status = twin.ask({{"cmd", "status"}});
  ASSERT_TRUE(status.ok());
  EXPECT_EQ((*status)["sheets"].size(), 3U) << "each is made once";
  EXPECT_THAT(twin.ask({{"cmd", "place"}, {"sheet", "oak"}, {"on", "bed"}, {"face", "show"}}).error().message,
              HasSubstr("there is no sheet oak"));
}

TEST(TwinProcess, GivesTheCellPicturesOfTheBed) {
  const RunningTwin twin;
  SimCamera camera(twin.socket());
  const Result<std::filesystem::path> picture = camera.capture();
  ASSERT_TRUE(picture.ok()) << picture.error().message;
  EXPECT_EQ(cv::imread(picture->string()).cols, 640);
  twin.must({{"cmd", "fault"}, {"name", "camera_dead"}});
  EXPECT_EQ(camera.capture().error().code, ErrorCode::kUnavailable);
}

TEST(TwinProcess, ShowsTheBedInSmallToWhoWatchesAndCountsNoPictureOfIt) {
  const RunningTwin twin;
  SimCamera camera(twin.socket());
  const auto before = cv::imread(camera.capture().value().string());
  for (int i = 0; i < 2; ++i) {
    const auto glance = camera.glance({});
    ASSERT_TRUE(glance.ok()) << glance.error().message;
    const cv::Mat small = cv::imread(glance->string());
    ASSERT_EQ(small.size(), cv::Size(160, 120));
    cv::Mat seen, same;
    cv::GaussianBlur(small, seen, {}, 2);  // the honeycomb is finer than its pixels
    cv::resize(before, same, small.size(), 0, 0, cv::INTER_AREA);
    cv::GaussianBlur(same, same, {}, 2);
    const cv::Rect here(4, 4, 152, 112);
    const double off = cv::norm(seen(here), same(here), cv::NORM_L1);
    for (const cv::Point beside : {cv::Point(2, 0), {-2, 0}, {0, 2}, {0, -2}})
      EXPECT_LT(off, cv::norm(seen(here), same(here + beside), cv::NORM_L1)) << "the bed lies where it does";
  }
  EXPECT_EQ(camera.capture().value().filename(), "camera-2.ppm");
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(camera.glance(stop.get_token()).error().code, ErrorCode::kCancelled);
}

TEST(TwinProcess, TellsACellWithoutTwinWhatToStart) {
  SimScanner scanner("/nonexistent/twin.sock");
  const Result<ScanFile> scan = scanner.scan(ScanResolution::from_dpi(300), nullptr, {});
  EXPECT_EQ(scan.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(scan.error().message, HasSubstr("start veneer-twin"));
}

TEST(TwinProcess, StopsAScanOnRequest) {
  const RunningTwin twin;
  SimScanner scanner(twin.socket());
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(scanner.scan(ScanResolution::from_dpi(300), nullptr, stop.get_token()).error().code, ErrorCode::kCancelled);
}

TEST(TwinProcess, AnswersBadInputWithOneSentence) {
  const RunningTwin twin;
  const std::vector<std::pair<json, std::string>> cases = {
      {json::array({1, 2}), "one JSON object per line"},
      {json::object(), "needs a \"cmd\""},
      {{{"cmd", 5}}, "no command 5"},
      {{{"cmd", "dance"}}, "no command \"dance\""},
      {{{"cmd", "new-panel"}, {"name", "P"}}, "needs \"width_mm\""},
      {{{"cmd", "new-panel"}, {"name", "P"}, {"width_mm", "wide"}, {"height_mm", 2}}, "must be a number"},
      {{{"cmd", "new-panel"}, {"name", "P"}, {"width_mm", 1e9}, {"height_mm", 200}}, "cannot be made"},
      {{{"cmd", "place"}, {"sheet", "P"}, {"on", "roof"}, {"face", "show"}}, "no place \"roof\""},
      {{{"cmd", "place"}, {"sheet", "P"}, {"on", "bed"}, {"face", "edge"}}, "no face \"edge\""},
      {{{"cmd", "lift"}, {"from", "bed"}}, "nothing lies on the bed"},
      {{{"cmd", "lift"}, {"from", "bed"}, {"gently", true}}, "takes no \"gently\""},
      {{{"cmd", "scan"}, {"dpi", 9600}}, "cannot scan at 9600 dpi"},
      {{{"cmd", "fault"}, {"name", "gremlins"}}, "gremlins"},
      {{{"cmd", "fault"}, {"name", "axis_drift"}}, "needs a \"value\""},
      {{{"cmd", "lid"}, {"open", "wide"}}, "true or false"}};
  for (const auto& [request, sentence] : cases) {
    const Result<json> reply = twin.ask(request);
    ASSERT_FALSE(reply.ok()) << request;
    EXPECT_THAT(reply.error().message, HasSubstr(sentence)) << request;
  }
}

TEST(TwinProcess, ResetsTheBoardWhenItsPortIsOpenedAndKeepsItOtherwise) {
  const RunningTwin twin;
  for (int i = 0; i < 2; ++i) {
    Line line(twin.path("laser"));
    ASSERT_TRUE(line.is_open());
    EXPECT_THAT(line.read_until("to unlock]\r\n"), HasSubstr("Grbl 1.1"));
    line.send("$X\n");
    EXPECT_THAT(line.read_until("ok\r\n"), HasSubstr("ok"));
  }
}

TEST(TwinProcess, BurnsWhatComesOverThePtyIntoTheSheetOnTheBed) {
  const RunningTwin twin;
  twin.must({{"cmd", "new-board"}, {"name", "W"}, {"width_mm", 400}, {"height_mm", 300}});
  twin.must({{"cmd", "place"}, {"sheet", "W"}, {"on", "bed"}, {"face", "back"}});
  Line line(twin.path("laser"));
  line.read_until("to unlock]\r\n");
  for (const char* command : {"$H\n", "G21G90G0X-270Y-200\n", "M4S850\n", "G1X-250F900\n", "G1Y-180\n", "G1X-270\n",
                              "G1Y-200\n", "M5\n", "G4P0.01\n"}) {
    line.send(command);
    ASSERT_THAT(line.read_until("ok\r\n"), HasSubstr("ok")) << command;
  }
  twin.must({{"cmd", "lift"}, {"from", "bed"}});
  const Result<json> log = twin.ask({{"cmd", "burn-log"}});
  ASSERT_TRUE(log.ok());
  EXPECT_NEAR(log->at("sheets")[0]["through_mm"].get<double>(), 80, 0.5);
  EXPECT_EQ(log->at("sheets")[0]["pieces"], 1);
}

TEST(TwinProcess, TakesThePortAwayWhenThePlugComesOut) {
  const RunningTwin twin;
  Line line(twin.path("laser"));
  line.read_until("to unlock]\r\n");
  twin.must({{"cmd", "fault"}, {"name", "laser_unplug"}});
  line.hang_up();
  EXPECT_FALSE(Line(twin.path("laser")).is_open());
  twin.must({{"cmd", "fault"}, {"name", "laser_replug"}});
  Line again(twin.path("laser"));
  ASSERT_TRUE(again.is_open());
  EXPECT_THAT(again.read_until("to unlock]\r\n"), HasSubstr("Grbl 1.1"));
}

TEST(TwinProcess, ShowsLidAndPowerInItsStatus) {
  const RunningTwin twin;
  twin.must({{"cmd", "lid"}, {"open", true}});
  EXPECT_EQ(twin.ask({{"cmd", "status"}})->at("lid"), "open");
  twin.must({{"cmd", "power"}, {"laser", false}});
  EXPECT_EQ(twin.ask({{"cmd", "status"}})->at("laser").at("state"), "Off");
}

TEST(TwinProcess, DoesNotTakeTheSocketOfAnotherTwin) {
  const RunningTwin twin;
  boost::asio::io_context io;
  const testing::TempDirectory dir;
  const auto world = *World::open(small_cell(), dir.path(), make_null_logger());
  const ScaledClock clock(1);
  LaserPort laser(io, clock, *world, {dir.path() / "laser", true, 520, 380, 0, 1}, make_null_logger());
  TwinService service(*world, laser, make_null_logger());
  TwinServer server(io, service, make_null_logger());
  EXPECT_EQ(server.listen(twin.socket()).error().code, ErrorCode::kConflict);
}

class TwinConfigFile : public ::testing::Test {
 protected:
  Result<TwinConfig> load(const std::string& text) {
    std::ofstream(dir_.path() / "twin.toml") << text;
    return load_twin_config(dir_.path() / "twin.toml");
  }
  testing::TempDirectory dir_;
};

TEST_F(TwinConfigFile, ReadsItsOwnTablesAndLeavesTheDaemonsAlone) {
  const Result<TwinConfig> config = load(
      "[sim]\ntime_scale = 5\n[twin]\nseed = 42\n[twin.bed]\nwidth_mm = 600\n"
      "[laser]\nkind = \"sim\"\n[api]\nlisten = \"\"\n");
  ASSERT_TRUE(config.ok()) << config.error().message;
  EXPECT_EQ(config->settings.seed, 42U);
  EXPECT_EQ(config->settings.time_scale, 5);
  EXPECT_EQ(config->settings.bed.width_mm, 600);
}

TEST_F(TwinConfigFile, NamesFileLineAndKeyOfAMistake) {
  EXPECT_THAT(load("[twin]\n\nsede = 4\n").error().message, HasSubstr("twin.toml:3: twin.sede is not a setting"));
  EXPECT_THAT(load("[twin.scanner]\nwarp_mm = \"much\"\n").error().message,
              HasSubstr("twin.scanner.warp_mm must be a number"));
  EXPECT_THAT(load("[twin]\nseed = 1.5\n").error().message, HasSubstr("whole number"));
  EXPECT_THAT(load("[tiwn]\nseed = 1\n").error().message, HasSubstr("tiwn is not a setting"));
  EXPECT_THAT(load("[twin.laser]\ncontroller = \"grlb\"\n").error().message,
              HasSubstr("twin.laser.controller must be one of grbl, lihuiyu-m2, lihuiyu-m3"));
  EXPECT_THAT(load("[twin\n").error().message, HasSubstr("twin.toml:1"));
  EXPECT_EQ(load_twin_config("/nonexistent.toml").error().code, ErrorCode::kNotFound);
}

TEST_F(TwinConfigFile, BeginsWithAPresetAndLetsKeysChangeIt) {
  const Result<TwinConfig> config = load("[twin]\npreset = \"workshop\"\n[twin.rough]\nbow_mm = 3\n");
  ASSERT_TRUE(config.ok()) << config.error().message;
  Roughness expected = *roughness_preset("workshop");
  expected.bow_mm = 3;
  EXPECT_EQ(config->settings.rough, expected);
  EXPECT_THAT(load("[twin.rough]\nbelt_period_mm = 1\n").error().message, HasSubstr("a number from 10 to 200"));
  ASSERT_TRUE(load("[twin]\npreset = \"workshop\"\n[twin.rough]\nbow_mm = 3\n").ok());
  // The command line's takes the place of the file's.
  const auto rough = load_twin_config(dir_.path() / "twin.toml", "rough");
  ASSERT_TRUE(rough.ok()) << rough.error().message;
  EXPECT_EQ(rough->settings.rough.soot_mm, roughness_preset("rough")->soot_mm);
  EXPECT_EQ(rough->settings.rough.bow_mm, 3);
  EXPECT_EQ(load("[twin]\nseed = 2\n")->settings.rough, Roughness{});
  EXPECT_THAT(load("[twin]\npreset = \"clean\"\n").error().message, HasSubstr("one of bench, workshop, rough"));
  EXPECT_THAT(load("[twin.rough]\nbacklash_mm = -1\n").error().message, HasSubstr("twin.rough.backlash_mm"));
  EXPECT_THAT(load("[twin.rough]\nwobble = 1\n").error().message, HasSubstr("twin.rough.wobble is not a setting"));
}

TEST_F(TwinConfigFile, AgreesWithTheShippedOne) {
  const Result<TwinConfig> shipped =
      load_twin_config(std::filesystem::path(VENEER_SOURCE_DIR) / "systemd/veneer-twin.toml");
  ASSERT_TRUE(shipped.ok()) << shipped.error().message;
  const TwinSettings defaults;
  EXPECT_EQ(shipped->settings.seed, defaults.seed);
  EXPECT_EQ(shipped->settings.scanner.warp_mm, defaults.scanner.warp_mm);
  EXPECT_EQ(shipped->settings.laser.through_energy, defaults.laser.through_energy);
  EXPECT_EQ(shipped->controller, TwinConfig().controller);
  EXPECT_EQ(shipped->settings.camera.tilt_deg, defaults.camera.tilt_deg);
}

}  // namespace
}  // namespace veneer::sim
