// What the camera over the bed tells of the stock, before anything is burnt there.
#include "daemon/devices/bed_watcher.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <future>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "calib/camera_fit.h"
#include "calib/kerf_meter.h"
#include "calib/machine_axes.h"
#include "daemon/store/calibration.h"
#include "tests/support/exact_camera.h"
#include "tests/support/rendered_bed.h"
#include "tests/support/temp_directory.h"
#include "tests/support/work_here.h"

namespace veneer::daemon {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class StillCamera final : public CameraDriver {
 public:
  Result<std::filesystem::path> capture() override {
    ++pictures;
    if (picture.empty()) return Error{ErrorCode::kUnavailable, "the camera does not answer"};
    if (!hangs) picture.at<uchar>(0, 0) = static_cast<uchar>(pictures);  // as no two pictures are alike
    EXPECT_TRUE(cv::imwrite(file.string(), picture));
    return file;
  }
  std::string device() const override { return "still"; }
  std::optional<std::chrono::system_clock::time_point> taken_at() const override { return taken; }
  std::optional<std::chrono::system_clock::time_point> taken;
  cv::Mat picture;
  std::filesystem::path file;
  bool hangs = false;
  int pictures = 0;
};

// A board with this tag, somewhere on the bed.
cv::Mat board_with_tag(int id) {
  constexpr double kTag = 20;
  return test::photograph(test::TrueCamera{}, {{{150, 100, 12, false}, 2.0, [id](double x, double y) {
                                                  if (x < 0 || y < 0 || x > 120 || y > 80) return test::kNothingHere;
                                                  const float tag =
                                                      test::tag_shade(id, (x - 40) / kTag, (y - 30) / kTag);
                                                  return tag == test::kNothingHere ? 170.0F : tag;
                                                }}});
}

cv::Mat bare_bed() { return test::photograph(test::TrueCamera{}, {}); }

// Of 2.3 pixels a millimetre: quickly drawn.
test::TrueCamera small_camera() {
  test::TrueCamera camera;
  camera.width = 1400, camera.height = 1050;
  camera.focal = 1092, camera.cx = 707.9, camera.cy = 519.9;
  return camera;
}

// A board of 120 x 80 mm that shows no tag, with these holes of 6 mm.
cv::Mat board_with_holes(const std::vector<std::array<double, 2>>& holes) {
  return test::photograph(small_camera(), {{{150, 100, 12, false}, 2.0, [holes](double x, double y) {
                                              if (x < 0 || y < 0 || x > 120 || y > 80) return test::kNothingHere;
                                              for (const auto& [hx, hy] : holes)
                                                if (std::hypot(x - hx, y - hy) < 3) return test::kNothingHere;
                                              return 170.0F;
                                            }}});
}

constexpr int kNoTag = -1;
const std::vector<std::array<double, 2>> kDrilled = {{12, 9}, {95, 11}, {50, 70}, {110, 47}};

constexpr std::chrono::milliseconds kAtOnce{0};

class BedWatcherTest : public ::testing::Test {
 protected:
  void SetUp() override {
    auto opened = DatabaseThread::open(folder_.path() / "cell.db", io_);
    ASSERT_TRUE(opened.ok());
    database_ = std::move(*opened);
    camera_.file = folder_ / "picture.ppm";
    config_.store.data_dir = folder_ / "data";
    watcher_ = std::make_unique<BedWatcher>(
        io_, pictures_, worker_, workers_, *database_, config_, [] {}, std::function<std::unique_ptr<OneShotTimer>()>(),
        kAtOnce);
  }
  static db::FiducialRecord tag(int id, Face face) {
    return {
        db::FiducialKind::kTag,
        id,
        face,
        {point<PanelFrame>(80, 30), point<PanelFrame>(60, 30), point<PanelFrame>(60, 50), point<PanelFrame>(80, 50)}};
  }
  void stock_panel(int back_tag, int show_tag = 100) {
    const Status added = database_->call([=, this](Repositories& r) {
      db::PanelRecord panel;
      panel.id = PanelId{"P-0001"};
      panel.name = "walnut";
      panel.width = Millimetres(120);
      panel.height = Millimetres(80);
      panel.created_at = "2026-01-01T00:00:00.000Z";
      std::vector<db::FiducialRecord> tags;
      if (back_tag != kNoTag) tags.push_back(tag(back_tag, Face::kBack));
      if (show_tag != kNoTag) tags.push_back(tag(show_tag, Face::kShow));
      for (std::size_t i = 0; i < holes_.size(); ++i)
        tags.push_back({db::FiducialKind::kHole,
                        static_cast<int>(i),
                        Face::kShow,
                        {point<PanelFrame>(holes_[i][0], holes_[i][1])}});
      return r.panels.add(panel, {}, tags);
    });
    ASSERT_TRUE(added.ok()) << added.error().message;
  }
  // The one that is stocked next gets them; and the camera its certificate.
  void drill(const std::vector<std::array<double, 2>>& holes) {
    holes_ = holes;
    db::CertificateRecord certificate;
    certificate.kind = db::CertificateKind::kCamera;
    certificate.issued_at = "2026-01-01T00:00:00.000Z";
    certificate.expires_at = "2999-01-01T00:00:00.000Z";
    calib::CameraFit fit;
    fit.model = calib::exact_model(small_camera());
    certificate.payload = to_payload(fit).dump();
    ASSERT_TRUE(database_->call([&](Repositories& r) { return r.certificates.issue(certificate); }).ok());
    config_.panel.thickness = Millimetres(2.0);
  }
  // With the camera's, all that a look stands on.
  void issue_axes() {
    drill({});
    calib::MachineAxes axes;
    axes.model = calib::exact_model(small_camera());
    db::CertificateRecord certificate;
    certificate.kind = db::CertificateKind::kAxes;
    certificate.issued_at = "2026-01-01T00:00:00.000Z";
    certificate.expires_at = "2999-01-01T00:00:00.000Z";
    certificate.payload =
        to_payload(axes, CertificateId{1},
                   PatternLayout{{{Millimetres(0), Millimetres(0)}, {Millimetres(520), Millimetres(380)}}}, {})
            .dump();
    ASSERT_TRUE(database_->call([&](Repositories& r) { return r.certificates.issue(certificate); }).ok());
    certificate.kind = db::CertificateKind::kKerf;
    calib::KerfMeasurement kerf;
    kerf.mean = Millimetres(0.2);
    certificate.payload = to_payload(kerf).dump();
    ASSERT_TRUE(database_->call([&](Repositories& r) { return r.certificates.issue(certificate); }).ok());
  }
  void scan(const std::string& at) {
    db::ScanRecord scan;
    scan.panel = PanelId{"P-0001"};
    scan.device = "test";
    scan.file = at;
    scan.sha256 = std::string(64, '0');
    scan.dpi = 300;
    scan.lattice = "{}";
    scan.taken_at = at;
    const Status added = database_->call([&](Repositories& r) { return r.panels.add_scans(scan.panel, {scan}, {}); });
    ASSERT_TRUE(added.ok()) << added.error().message;
  }
  Result<StockSight> stock_in_sight() {
    std::optional<Result<StockSight>> out;
    watcher_->stock_in_sight([&](Result<StockSight> seen) { out = std::move(seen); });
    worker_.call([] { return 0; });
    io_.restart();
    io_.poll();
    return out ? *out : Error{ErrorCode::kInternal, "no reply"};
  }

  Result<ProvenPose> look() {
    std::optional<Result<ProvenPose>> out;
    watcher_->look([&](Result<ProvenPose> pose) { out = std::move(pose); });
    worker_.call([] { return 0; });
    io_.restart();
    io_.poll();
    return out ? *out : Error{ErrorCode::kInternal, "no reply"};
  }

  std::vector<std::array<double, 2>> holes_;
  veneer::testing::TempDirectory folder_;
  boost::asio::io_context io_;
  Config config_;
  StillCamera camera_;
  BedPictures pictures_{camera_};
  std::unique_ptr<DatabaseThread> database_;
  veneer::testing::WorkHere workers_;
  Worker worker_{"camera"};
  std::unique_ptr<BedWatcher> watcher_;
};

TEST_F(BedWatcherTest, OneTagTellsAPanelOfTheStockWithoutAnyCalibration) {
  stock_panel(215);
  camera_.picture = board_with_tag(215);
  const auto seen = stock_in_sight();
  ASSERT_TRUE(seen.ok()) << seen.error().message;
  EXPECT_THAT(seen->panels, ElementsAre(PanelId{"P-0001"}));
  EXPECT_FALSE(watcher_->picture().empty()) << "people see what was looked at";
}

TEST_F(BedWatcherTest, AStrangersTagLeavesADoubt) {
  stock_panel(215);
  camera_.picture = board_with_tag(300);
  const auto seen = stock_in_sight();
  ASSERT_TRUE(seen.ok()) << seen.error().message;
  EXPECT_THAT(seen->panels, IsEmpty());
  EXPECT_THAT(seen->doubts, ElementsAre("tag 300 of no known panel is in sight"));
}

TEST_F(BedWatcherTest, AnEmptyBedWithAllOfTheStockKnownLeavesNone) {
  stock_panel(215);
  camera_.picture = bare_bed();
  const auto seen = stock_in_sight();
  ASSERT_TRUE(seen.ok()) << seen.error().message;
  EXPECT_THAT(seen->panels, IsEmpty());
  EXPECT_THAT(seen->doubts, IsEmpty());
}

TEST_F(BedWatcherTest, APanelWithHolesOnlyMayLieThereUnseen) {
  stock_panel(215, kNoTag);
  camera_.picture = bare_bed();
  EXPECT_THAT(stock_in_sight()->doubts,
              ElementsAre("panel P-0001 would not be seen with the face up on which no tag is known"));
}

// By scrap that lies over them, or they were torn off.
TEST_F(BedWatcherTest, APanelWhoseTagsAreCoveredIsKnownByItsHoles) {
  drill(kDrilled);
  stock_panel(215);
  camera_.picture = board_with_holes(kDrilled);
  const auto seen = stock_in_sight();
  ASSERT_TRUE(seen.ok()) << seen.error().message;
  EXPECT_THAT(seen->panels, ElementsAre(PanelId{"P-0001"}));
}

TEST_F(BedWatcherTest, APanelWithoutTagsIsKnownByItsHoles) {
  drill(kDrilled);
  stock_panel(kNoTag, kNoTag);
  camera_.picture = board_with_holes(kDrilled);
  const auto seen = stock_in_sight();
  ASSERT_TRUE(seen.ok()) << seen.error().message;
  EXPECT_THAT(seen->panels, ElementsAre(PanelId{"P-0001"}));
}

TEST_F(BedWatcherTest, APanelOfAnotherThicknessIsLookedForAtItsOwnHeight) {
  drill(kDrilled);
  stock_panel(kNoTag, kNoTag);
  camera_.picture = board_with_holes(kDrilled);  // 2.0 mm thick
  config_.panel.thickness = Millimetres(14);
  EXPECT_THAT(stock_in_sight()->panels, IsEmpty());
  const auto note = [&](const db::PanelFacts& facts) {
    const Status noted =
        database_->call([&](Repositories& r) { return r.facts.set_panel(PanelId{"P-0001"}, facts, {}); });
    ASSERT_TRUE(noted.ok()) << noted.error().message;
  };
  note({{}, Millimetres(0.6), {}, "uid 1000", "2026-01-01T00:00:00.000Z"});
  EXPECT_THAT(stock_in_sight()->panels, IsEmpty()) << "nobody said what the veneer lies on";
  note({{}, {}, Millimetres(1.4), "uid 1000", "2026-01-01T00:00:00.000Z"});
  EXPECT_THAT(stock_in_sight()->panels, ElementsAre(PanelId{"P-0001"}));
}

TEST_F(BedWatcherTest, HolesThatAreAnothersSayNothing) {
  drill(kDrilled);
  stock_panel(215);
  camera_.picture = board_with_holes({{20, 20}, {60, 15}, {100, 60}, {30, 55}});
  const auto seen = stock_in_sight();
  ASSERT_TRUE(seen.ok()) << seen.error().message;
  EXPECT_THAT(seen->panels, IsEmpty());
  EXPECT_THAT(seen->doubts, IsEmpty());
}

TEST_F(BedWatcherTest, ThreeOfFourHolesAmongOthersLeaveADoubt) {
  drill(kDrilled);
  stock_panel(215);
  camera_.picture = board_with_holes({{12, 9}, {95, 11}, {50, 70}, {30, 30}, {70, 40}, {25, 60}, {60, 20}});
  EXPECT_THAT(stock_in_sight()->panels, IsEmpty());
  EXPECT_THAT(stock_in_sight()->doubts, ElementsAre("3 holes in sight lie as 3 of the 4 of panel P-0001 do"));
}

TEST_F(BedWatcherTest, WhereNoPanelHasATagAPictureWouldTellNothing) {
  stock_panel(kNoTag, kNoTag);
  const auto seen = stock_in_sight();
  ASSERT_TRUE(seen.ok()) << seen.error().message;
  EXPECT_THAT(seen->doubts, ElementsAre(HasSubstr("panel P-0001 would not be seen")));
  EXPECT_EQ(camera_.pictures, 0);
}

TEST_F(BedWatcherTest, APanelThatWasSeenLastIsThereUntilItIsSeenElsewhere) {
  stock_panel(215);
  camera_.picture = board_with_tag(215);
  ASSERT_THAT(stock_in_sight()->panels, ElementsAre(PanelId{"P-0001"}));
  camera_.picture = bare_bed();  // or scrap that was laid over it
  const std::string there =
      "panel P-0001 lay there when the camera saw a panel last, and nothing tells that it is gone";
  EXPECT_THAT(stock_in_sight()->doubts, ElementsAre(there));
  EXPECT_THAT(stock_in_sight()->doubts, ElementsAre(there)) << "a second look that sees nothing tells no more";
  scan("2020-01-01T00:00:00.000Z");
  EXPECT_THAT(stock_in_sight()->doubts, ElementsAre(there)) << "scanned before it lay on the bed";
  scan("2999-01-01T00:00:00.000Z");
  EXPECT_THAT(stock_in_sight()->doubts, IsEmpty());
}

TEST_F(BedWatcherTest, AfterARestartTheLastRunTellsWhatLayThere) {
  stock_panel(215);
  const Status ran = database_->call([](Repositories& r) -> Status {
    db::NewPlan plan;
    plan.name = "test";
    plan.plan_json = plan.options_json = "{}";
    db::PlannedPatch& piece = plan.pieces.emplace_back();
    piece.mark = "A1-1";
    piece.artwork_outline = {point<ArtworkFrame>(0, 0), point<ArtworkFrame>(10, 0), point<ArtworkFrame>(10, 10)};
    piece.panel = PanelId{"P-0001"};
    piece.panel_outline = {point<PanelFrame>(0, 0), point<PanelFrame>(10, 0), point<PanelFrame>(10, 10)};
    piece.allocation = Region<PanelFrame>(piece.panel_outline);
    plan.planned_on = {{PanelId{"P-0001"}, 1}};
    const auto job = r.jobs.create(plan, "2026-01-01T00:00:00.000Z");
    if (!job) return job.error();
    const auto run = r.jobs.start_run(*job, PanelId{"P-0001"}, {}, Millimetres(0.02), "2026-01-02T00:00:00.000Z");
    if (!run) return run.error();
    return r.jobs.finish_run(*run, false, "2026-01-03T00:00:00.000Z");
  });
  ASSERT_TRUE(ran.ok()) << ran.error().message;
  camera_.picture = bare_bed();
  EXPECT_THAT(stock_in_sight()->doubts, ElementsAre(HasSubstr("panel P-0001 lay there")));
  scan("2026-01-04T00:00:00.000Z");
  EXPECT_THAT(stock_in_sight()->doubts, IsEmpty());
}

TEST_F(BedWatcherTest, WithoutACameraNobodyCanTell) {
  stock_panel(215);
  EXPECT_FALSE(stock_in_sight().ok());
}

TEST_F(BedWatcherTest, APictureFromBeforeHandsWereInProvesNothing) {
  using std::chrono::seconds, std::chrono::system_clock;
  stock_panel(215);
  camera_.picture = board_with_tag(215);
  camera_.taken = system_clock::now() - seconds(10);
  ASSERT_TRUE(stock_in_sight().ok()) << "nobody has been at the bed since";
  watcher_->hands_were_in();
  const auto stale = stock_in_sight();
  ASSERT_FALSE(stale.ok());
  EXPECT_EQ(stale.error().code, ErrorCode::kRefused);
  EXPECT_THAT(stale.error().message, HasSubstr("take a new one"));
  const auto pose = look();
  ASSERT_FALSE(pose.ok());
  EXPECT_THAT(pose.error().message, HasSubstr("take a new one"));
  camera_.taken = system_clock::now();
  EXPECT_TRUE(stock_in_sight().ok());
  EXPECT_THAT(look().error().message, Not(HasSubstr("take a new one")));
}

// The program that takes the pictures hangs, and nothing tells since when.
TEST_F(BedWatcherTest, AnOldPictureLetsNoBeamBegin) {
  stock_panel(215);
  camera_.picture = bare_bed();
  camera_.taken = std::chrono::system_clock::now() - std::chrono::hours(1);
  const auto old = stock_in_sight();
  ASSERT_FALSE(old.ok());
  EXPECT_EQ(old.error().code, ErrorCode::kRefused);
  EXPECT_THAT(old.error().message, HasSubstr("see whether the program that takes it still runs"));
  EXPECT_THAT(look().error().message, HasSubstr("still runs"));
  EXPECT_FALSE(watcher_->picture().empty()) << "people see it all the same";
}

// By the clock of the share it lies on, which is ahead.
TEST_F(BedWatcherTest, APictureOfTheFutureProvesNothing) {
  stock_panel(215);
  camera_.picture = board_with_tag(215);
  camera_.taken = std::chrono::system_clock::now() + std::chrono::hours(1);
  const auto ahead = stock_in_sight();
  ASSERT_FALSE(ahead.ok());
  EXPECT_EQ(ahead.error().code, ErrorCode::kRefused);
  EXPECT_THAT(ahead.error().message, HasSubstr("set the clock"));
  EXPECT_THAT(look().error().message, HasSubstr("set the clock"));
}

TEST_F(BedWatcherTest, ASimulatedCameraTellsNothingOfARealLasersBed) {
  stock_panel(215);
  camera_.picture = board_with_tag(300);
  config_.laser.kind = "grbl";
  config_.laser.port = "serial:/dev/ttyUSB0";
  const auto seen = stock_in_sight();
  ASSERT_FALSE(seen.ok());
  EXPECT_THAT(seen.error().message, HasSubstr("the camera is simulated"));
  config_.laser.test_controller = true;
  EXPECT_TRUE(stock_in_sight().ok());
}

// A camera on a dead network drive neither gives a picture nor an error.
TEST_F(BedWatcherTest, ALookThatNobodyAnswersEndsWithASentence) {
  stock_panel(215);
  std::vector<std::function<void()>> late;
  struct HandTimer final : OneShotTimer {
    explicit HandTimer(std::vector<std::function<void()>>& fired) : fired_(fired) {}
    void after(Duration, std::function<void()> then) override { fired_.push_back(std::move(then)); }
    void cancel() override {}
    std::vector<std::function<void()>>& fired_;
  };
  BedWatcher watcher(
      io_, pictures_, worker_, workers_, *database_, config_, [] {},
      [&late] { return std::make_unique<HandTimer>(late); });
  camera_.picture = board_with_tag(215);
  std::promise<void> dead;
  worker_.post([gate = dead.get_future().share()] { gate.wait(); });
  std::vector<std::string> answers;
  watcher.look([&](const Result<ProvenPose>& pose) { answers.push_back(pose ? "a pose" : pose.error().message); });
  ASSERT_EQ(late.size(), 1U);
  late[0]();
  EXPECT_THAT(answers, ElementsAre(HasSubstr("still gives no picture and no error")));
  dead.set_value();
  worker_.call([] { return 0; });
  io_.restart();
  io_.poll();
  EXPECT_THAT(answers, ::testing::SizeIs(1)) << "what comes later is no answer any more";
  late.clear();
}

// With the lamp off it shows as little of a panel as of an empty bed.
TEST_F(BedWatcherTest, APictureThatShowsNothingTellsNotThatTheBedIsEmpty) {
  stock_panel(215);
  const cv::Mat panel = board_with_tag(215);
  cv::resize(panel, camera_.picture, {small_camera().width, small_camera().height}, 0, 0, cv::INTER_AREA);
  camera_.picture.convertTo(camera_.picture, -1, 0.02);
  const auto seen = stock_in_sight();
  ASSERT_TRUE(seen.ok()) << seen.error().message;
  EXPECT_THAT(seen->doubts, ElementsAre(HasSubstr("see that the light is on and that nothing covers the lens")));
  issue_axes();
  ASSERT_FALSE(look().ok());
  EXPECT_EQ(look().error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(look().error().message, HasSubstr("see that the light is on"));
  camera_.picture = test::photograph(small_camera(), {});
  EXPECT_EQ(look().error().code, ErrorCode::kNotFound) << look().error().message;
}

// A camera that hangs gives its last picture for ever.
TEST_F(BedWatcherTest, TheSamePictureOnceMoreProvesNothing) {
  stock_panel(215);
  camera_.picture = board_with_tag(215);
  camera_.hangs = true;
  ASSERT_TRUE(stock_in_sight().ok());
  const auto again = stock_in_sight();
  ASSERT_FALSE(again.ok());
  EXPECT_EQ(again.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(again.error().message, HasSubstr("gives the same picture again"));
  EXPECT_FALSE(stock_in_sight().ok()) << "nor the third time";
  camera_.hangs = false;
  EXPECT_TRUE(stock_in_sight().ok());
}

TEST_F(BedWatcherTest, TheSamePictureOnceMoreProvesNothingAfterARestartEither) {
  camera_.picture = board_with_tag(215);
  camera_.hangs = true;
  const auto memory = folder_ / "bed_picture.json";
  const auto taken_at_first = [&] {
    const auto picture = BedPictures(camera_, memory).take(BedPictures::For::kBurning);
    EXPECT_TRUE(picture.ok());
    return picture.ok() ? picture->fresh : Status(picture.error());
  };
  EXPECT_TRUE(taken_at_first().ok());
  EXPECT_THAT(taken_at_first().error().message, HasSubstr("gives the same picture again"));
  camera_.taken = std::chrono::system_clock::now() - std::chrono::seconds(10);
  camera_.hangs = false;
  EXPECT_TRUE(taken_at_first().ok());
  camera_.hangs = true;
  EXPECT_TRUE(taken_at_first().ok()) << "a file that stays as it was put there is one picture, of one time";
  std::ofstream(memory) << "nonsense";
  EXPECT_TRUE(taken_at_first().ok());
}

// The program that takes the pictures writes its last one again and again.
TEST_F(BedWatcherTest, AFileThatIsWrittenAnewWithTheSamePictureProvesNothing) {
  using std::chrono::seconds, std::chrono::system_clock;
  stock_panel(215);
  camera_.picture = board_with_tag(215);
  camera_.hangs = true;
  camera_.taken = system_clock::now() - seconds(10);
  EXPECT_TRUE(stock_in_sight().ok());
  EXPECT_TRUE(stock_in_sight().ok()) << "it is one picture, of one time";
  camera_.taken = system_clock::now() - seconds(5);
  EXPECT_FALSE(stock_in_sight().ok());
  EXPECT_FALSE(stock_in_sight().ok());
}

TEST_F(BedWatcherTest, APictureIsAsOldAsItIsSaidToBe) {
  stock_panel(215);
  camera_.picture = board_with_tag(215);
  const auto now = std::chrono::system_clock::now();
  camera_.taken = now - BedPictures::kOldest - std::chrono::milliseconds(120);
  BedPictures pictures(camera_, {}, [now] { return now; });
  const auto picture = pictures.take(BedPictures::For::kBurning);
  ASSERT_TRUE(picture.ok());
  ASSERT_FALSE(picture->fresh.ok());
  EXPECT_THAT(picture->fresh.error().message, HasSubstr("was taken 60.2 s ago, and 60 s is the longest"));
}

TEST_F(BedWatcherTest, WithoutStockNobodyNeedsToLook) {
  const auto seen = stock_in_sight();
  ASSERT_TRUE(seen.ok()) << seen.error().message;
  EXPECT_THAT(seen->panels, IsEmpty());
  EXPECT_THAT(seen->doubts, IsEmpty());
  EXPECT_EQ(camera_.pictures, 0);
}

}  // namespace
}  // namespace veneer::daemon
