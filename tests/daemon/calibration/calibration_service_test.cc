// What becomes of the views an operator has collected for a calibration.
#include "daemon/calibration/calibration_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "daemon/orders/bed_json.h"
#include "daemon/orders/bed_work.h"
#include "daemon/orders/calibration_json.h"
#include "daemon/orders/calibration_work.h"
#include "daemon/store/calibration.h"
#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

using ::testing::ElementsAre;

class NoDevice final : public ScannerDriver, public CameraDriver {
 public:
  Result<ScanFile> scan(ScanResolution nominal, const ScanProgress&, std::stop_token) override {
    return ScanFile{scanned, nominal, "test", make};
  }
  Result<std::filesystem::path> capture() override {
    ++captures;
    if (captures > old_ones) taken = std::chrono::system_clock::now();
    return file;
  }
  std::string device() const override { return "test"; }
  std::optional<std::chrono::system_clock::time_point> taken_at() const override { return taken; }
  std::string make;
  std::filesystem::path scanned = "scan.png";
  std::filesystem::path file = "view.png";
  std::optional<std::chrono::system_clock::time_point> taken;
  int captures = 0;
  int old_ones = std::numeric_limits<int>::max();  // pictures until a new one is there
};

// Sees something on every scan, and notes how many of them are to be fitted.
class Fitter final : public WorkRunner {
 public:
  Result<nlohmann::json> run(const WorkOrder& order, const TaskProgress&, std::stop_token stop) override {
    if (stop.stop_requested()) return Error{ErrorCode::kCancelled, "cancelled"};
    if (order.kind == ReadGridScan::kKind) return nlohmann::json(calib::GridScan{});
    if (views && order.kind == ReadGridView::kKind) return nlohmann::json(GridViewRead{});
    if (order.kind == LookAtBed::kKind) {
      BedSeen seen;
      const auto look = order.request.get<LookAtBed>();
      seen.tags = tags_on_bed;
      seen.nothing = lens_covered;
      if (look.camera && look.board && picture_fits) seen.boards = boards_on_bed;
      if (!picture_fits) seen.why_none = "another size", seen.why_code = static_cast<int>(ErrorCode::kRefused);
      return nlohmann::json(seen);
    }
    if (kerf && order.kind == ReadPatternScan::kKind) {
      read = order.request.get<ReadPatternScan>().pattern;
      return nlohmann::json(Fit{{{"kerf_mm", 0.15}}, Millimetres(0)});
    }
    if (order.kind != FitScanner::kKind) return Error{ErrorCode::kNotFound, "no such kind of work"};
    fitted.push_back(order.request.get<FitScanner>().scans.size());
    if (fails_with) return Error{*fails_with, "no fit"};
    return nlohmann::json(Fit{nlohmann::json::object(), Millimetres(0)});
  }
  std::optional<ErrorCode> fails_with;
  std::vector<std::size_t> fitted;
  std::vector<int> tags_on_bed;
  std::vector<calib::FoundBoard> boards_on_bed{
      {point<BedFrame>(260, 190), Millimetres(400), Millimetres(300), 0}};  // in the middle of kTravel
  bool lens_covered = false, picture_fits = true;
  bool views = false;  // can it read them
  bool kerf = false;   // and a burnt board
  PatternLayout read;  // of the board that was read last
};

class CollectedViews : public ::testing::Test {
 protected:
  void SetUp() override {
    auto opened = DatabaseThread::open(folder_ / "cell.db", reactor_);
    ASSERT_TRUE(opened.ok());
    database_ = std::move(*opened);
    config_.store.data_dir = folder_.path();
    service_ = with_patience(std::chrono::milliseconds(0));
  }
  std::unique_ptr<CalibrationService> with_patience(std::chrono::milliseconds patience) {
    return std::make_unique<CalibrationService>(devices_, pictures_, *database_, workers_, config_, make_null_logger(),
                                                patience);
  }
  Result<CalibrationOutcome> scan(bool more) {
    return service_->scanner(more, [](double, const std::string&) {}, {});
  }

  // As somebody has looked.
  static inline const PatternBoard kLaid{Millimetres(2), Millimetres(400), Millimetres(300), true};
  Status ready(const PatternBoard& board = kLaid) {
    return service_->ready_for_pattern(kTravel, board, [](double, const std::string&) {}, {});
  }
  void certify(db::CertificateKind kind, const nlohmann::json& payload) {
    db::CertificateRecord made;
    made.kind = kind;
    made.issued_at = "2026-01-01T00:00:00.000Z", made.expires_at = "2999-01-01T00:00:00.000Z";
    made.payload = payload.dump();
    ASSERT_TRUE(database_->call([&](Repositories& r) { return r.certificates.issue(made); }).ok());
  }
  void certify_camera() { certify(db::CertificateKind::kCamera, to_payload(calib::CameraFit{})); }

  static inline const Box<MachineFrame> kTravel{{Millimetres(0), Millimetres(0)}, {Millimetres(520), Millimetres(380)}};
  veneer::testing::TempDirectory folder_;
  boost::asio::io_context reactor_;
  Config config_;
  NoDevice devices_;
  BedPictures pictures_{devices_};
  Fitter workers_;
  std::unique_ptr<DatabaseThread> database_;
  std::unique_ptr<CalibrationService> service_;
};

TEST_F(CollectedViews, AreKeptWhenTheProcessThatFitsThemDies) {
  ASSERT_TRUE(scan(true).ok());
  for (const ErrorCode code : {ErrorCode::kUnavailable, ErrorCode::kInternal, ErrorCode::kTimeout,
                               ErrorCode::kCancelled, ErrorCode::kStorage}) {
    workers_.fails_with = code;
    EXPECT_FALSE(scan(false).ok());
  }
  workers_.fails_with.reset();
  EXPECT_TRUE(scan(false).ok());
  EXPECT_THAT(workers_.fitted, ElementsAre(2U, 3U, 4U, 5U, 6U, 7U));
  EXPECT_TRUE(scan(false).ok());
  EXPECT_EQ(workers_.fitted.back(), 1U) << "what was fitted is over";
}

TEST_F(CollectedViews, OfTheScannerAreSeveralPicturesAndNotOneSeveralTimes) {
  devices_.scanned = folder_ / "scan.ppm";
  std::ofstream(devices_.scanned) << "one";
  ASSERT_TRUE(scan(true).ok());
  const auto again = scan(false);
  ASSERT_FALSE(again.ok());
  EXPECT_EQ(again.error().code, ErrorCode::kRefused);
  EXPECT_THAT(again.error().message, ::testing::HasSubstr("was read as a scan already: move the sheet"));
  std::ofstream(devices_.scanned) << "two";
  ASSERT_TRUE(scan(false).ok());
  EXPECT_THAT(workers_.fitted, ElementsAre(2U));
  // What was fitted is over; but its pictures say nothing of another day.
  for (const char* used : {"one", "two"}) {
    std::ofstream(devices_.scanned) << used;
    const auto stale = scan(false);
    ASSERT_FALSE(stale.ok());
    EXPECT_EQ(stale.error().code, ErrorCode::kRefused);
    EXPECT_THAT(stale.error().message, ::testing::HasSubstr("is one that certificate 1 of 20"));
  }
  std::ofstream(devices_.scanned) << "three";
  EXPECT_TRUE(scan(false).ok());
}

TEST_F(CollectedViews, AreOfOneScannerAndTheCertificateNamesIt) {
  devices_.make = "EPSON Perfection V39";
  ASSERT_TRUE(scan(true).ok());
  devices_.make = "Canon LiDE 400";
  const auto made = scan(false);
  ASSERT_TRUE(made.ok()) << made.error().message;
  EXPECT_THAT(workers_.fitted, ElementsAre(1));
  EXPECT_EQ(nlohmann::json::parse(made->payload)["make"], "Canon LiDE 400");
}

TEST_F(CollectedViews, OfTheCameraCanBeGivenUpAsThoseOfTheScanner) {
  std::stop_source asked;
  asked.request_stop();
  const auto silent = [](double, const std::string&) {};
  const auto camera = service_->camera(true, Millimetres(0), silent, asked.get_token());
  ASSERT_FALSE(camera.ok());
  EXPECT_EQ(camera.error().code, ErrorCode::kCancelled);
  EXPECT_EQ(service_->scanner(true, silent, asked.get_token()).error().code, ErrorCode::kCancelled);
}

// A camera that reads files shows an empty bed for as long as the program that takes the pictures hangs.
TEST_F(CollectedViews, OfABedAsItWasOnceAreRefused) {
  using std::chrono::seconds, std::chrono::system_clock;
  using ::testing::HasSubstr;
  certify_camera();
  const auto silent = [](double, const std::string&) {};
  const auto view = [&] { return service_->camera(true, Millimetres(0), silent, {}).error().message; };
  const auto axes = [&] { return service_->axes(Millimetres(2), silent, {}).error().message; };
  service_->note_burnt(kTravel, kLaid);
  devices_.taken = system_clock::now() - seconds(10);
  EXPECT_TRUE(ready().ok());
  pictures_.hands_were_in();
  EXPECT_THAT(ready().error().message, HasSubstr("before hands were last at the bed"));
  EXPECT_THAT(view(), HasSubstr("before hands were last at the bed"));
  EXPECT_THAT(axes(), HasSubstr("before hands were last at the bed"));
  devices_.taken = system_clock::now() + std::chrono::hours(1);
  EXPECT_THAT(ready().error().message, HasSubstr("set the clock"));
  EXPECT_THAT(view(), HasSubstr("set the clock"));
  EXPECT_THAT(axes(), HasSubstr("set the clock"));
}

// A file camera shows the same until somebody puts another picture there, and one that hangs for ever.
TEST_F(CollectedViews, AreSeveralPicturesAndNotOneSeveralTimes) {
  workers_.views = true;
  const auto view = [&] { return service_->camera(true, Millimetres(0), [](double, const std::string&) {}, {}); };
  const auto show = [&](const char* content) {
    devices_.file = folder_ / "view.ppm";
    std::ofstream(devices_.file) << content;
    devices_.taken = std::chrono::system_clock::now();
  };
  show("one");
  ASSERT_TRUE(view().ok());
  const auto again = view();
  ASSERT_FALSE(again.ok());
  EXPECT_EQ(again.error().code, ErrorCode::kRefused);
  EXPECT_THAT(again.error().message, ::testing::HasSubstr("was read as a view already: move the sheet"));
  show("two");
  const auto second = view();
  ASSERT_TRUE(second.ok()) << second.error().message;
  EXPECT_EQ(second->views, 2U);
  show("one");
  EXPECT_FALSE(view().ok()) << "with another time stamp";
}

// The pattern has just been burnt, and the camera's program writes its next picture in a moment: the board is not
// spoilt.
TEST_F(CollectedViews, AreWaitedForWhereTheCameraHasNoneYetOfWhatLiesThere) {
  devices_.taken = std::chrono::system_clock::now() - std::chrono::seconds(10);
  devices_.old_ones = 1;
  pictures_.hands_were_in();
  const auto silent = [](double, const std::string&) {};
  const auto seen = with_patience(std::chrono::minutes(10))->camera(true, Millimetres(0), silent, {});
  EXPECT_EQ(devices_.captures, 2);
  EXPECT_EQ(seen.error().code, ErrorCode::kNotFound) << "it went on to the work, which this runner does not know";
}

TEST_F(CollectedViews, AreNotWaitedForOnceTheTaskIsCancelled) {
  devices_.taken = std::chrono::system_clock::now() - std::chrono::seconds(10);
  pictures_.hands_were_in();
  std::stop_source asked;
  asked.request_stop();
  const auto silent = [](double, const std::string&) {};
  const auto seen = with_patience(std::chrono::minutes(10))->camera(true, Millimetres(0), silent, asked.get_token());
  EXPECT_EQ(seen.error().code, ErrorCode::kCancelled);
  EXPECT_EQ(devices_.captures, 1);
}

TEST_F(CollectedViews, ThatLetAPatternBeBurntAreOfThisMinute) {
  certify_camera();
  devices_.taken = std::chrono::system_clock::now() - std::chrono::hours(1);
  const Status old = ready();
  ASSERT_FALSE(old.ok());
  EXPECT_THAT(old.error().message, ::testing::HasSubstr("see whether the program that takes it still runs"));
}

// It burnt first: through the AprilGrid sheet where that still lay on the bed, and with no certificate to measure with.
TEST_F(CollectedViews, OfThePatternAreLookedForBeforeItIsBurnt) {
  const Status unmeasurable = ready();
  ASSERT_FALSE(unmeasurable.ok());
  EXPECT_EQ(unmeasurable.error().code, ErrorCode::kRefused);
  EXPECT_THAT(unmeasurable.error().message, ::testing::HasSubstr("run veneerctl calibrate camera before"));
  certify_camera();
  workers_.tags_on_bed = {7, 8, 31};
  const Status grid = ready();
  ASSERT_FALSE(grid.ok());
  EXPECT_EQ(grid.error().code, ErrorCode::kRefused);
  EXPECT_THAT(grid.error().message, ::testing::HasSubstr("AprilGrid sheet lies on the bed"));
  workers_.tags_on_bed.clear();
  EXPECT_TRUE(ready().ok());
}

// It burnt into the bed, or past the edges of a board that is smaller than was told.
TEST_F(CollectedViews, OfThePatternShowTheBoardBeforeItIsBurnt) {
  using ::testing::HasSubstr;
  certify_camera();
  EXPECT_TRUE(ready().ok());
  PatternBoard unsaid = kLaid;
  unsaid.is_there = false;
  EXPECT_THAT(ready(unsaid).error().message, HasSubstr("--confirm \"board on the bed\"")) << "its frame is not known";
  PatternBoard one_side = kLaid;
  one_side.height.reset();
  EXPECT_EQ(ready(one_side).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(service_->pattern_for(kTravel, one_side).error().code, ErrorCode::kInvalidArgument);
  workers_.boards_on_bed.clear();
  const Status none = ready();
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().code, ErrorCode::kRefused);
  EXPECT_THAT(none.error().message, HasSubstr("no board of 400 x 300 mm is seen on the bed"));
}

// Whatever somebody says of the board.
TEST_F(CollectedViews, OfThePatternShowTheBedAtAll) {
  using ::testing::HasSubstr;
  certify_camera();
  PatternBoard sure = kLaid;
  sure.is_unseen = true;
  ASSERT_TRUE(ready(sure).ok());
  workers_.picture_fits = false;
  EXPECT_EQ(ready(sure).error().message, "another size") << "and it could not be measured afterwards";
  workers_.picture_fits = true, workers_.lens_covered = true;
  EXPECT_THAT(ready(sure).error().message, HasSubstr("see that the light is on and that nothing covers the lens"));
}

// Last month's board tells last month's kerf.
TEST_F(CollectedViews, OfTheBurntBoardAreNotThoseOfAnotherCertificate) {
  certify(db::CertificateKind::kScanner, to_payload(calib::ScannerCertificateData{}));
  service_->note_burnt(kTravel, kLaid);
  workers_.kerf = true;
  devices_.scanned = folder_ / "board.ppm";
  const auto kerf = [&] { return service_->kerf([](double, const std::string&) {}, {}); };
  std::ofstream(devices_.scanned) << "one";
  const auto first = kerf();
  ASSERT_TRUE(first.ok()) << first.error().message;
  const auto stale = kerf();
  ASSERT_FALSE(stale.ok());
  EXPECT_THAT(stale.error().message, ::testing::HasSubstr("is one that certificate 2 of 20"));
  std::ofstream(devices_.scanned) << "two";
  EXPECT_TRUE(kerf().ok());
}

// The board of an axes certificate from before, whose rings were evenly spaced, until another one is burnt.
TEST_F(CollectedViews, OfTheBurntBoardAreReadByThePatternThatWasBurnt) {
  certify(db::CertificateKind::kScanner, to_payload(calib::ScannerCertificateData{}));
  nlohmann::json axes = to_payload(calib::MachineAxes{}, CertificateId{0}, {kTravel}, {});
  axes.erase("pattern_spacing");
  certify_camera();
  certify(db::CertificateKind::kAxes, axes);
  workers_.kerf = true;
  devices_.scanned = folder_ / "board.ppm";
  std::ofstream(devices_.scanned) << "one";
  const auto kerf = [&] { return service_->kerf([](double, const std::string&) {}, {}); };
  ASSERT_TRUE(kerf().ok());
  EXPECT_EQ(workers_.read.spacing, RingSpacing::kEven);
  EXPECT_EQ(workers_.read.area.max, kTravel.max);
  ASSERT_TRUE(service_->pattern_for(kTravel, kLaid).ok());
  std::ofstream(devices_.scanned) << "two";
  ASSERT_TRUE(kerf().ok());
  EXPECT_EQ(workers_.read.spacing, RingSpacing::kEven) << "a burn that was refused leaves the board that was burnt";
  service_->note_burnt(kTravel, kLaid);
  std::ofstream(devices_.scanned) << "three";
  ASSERT_TRUE(kerf().ok());
  EXPECT_EQ(workers_.read.spacing, RingSpacing::kUneven);
}

TEST_F(CollectedViews, AreTakenAnewWhenTheyAreNoGood) {
  ASSERT_TRUE(scan(true).ok());
  workers_.fails_with = ErrorCode::kRefused;
  EXPECT_FALSE(scan(false).ok());
  EXPECT_FALSE(scan(false).ok());
  EXPECT_THAT(workers_.fitted, ElementsAre(2U, 1U));
}

}  // namespace
}  // namespace veneer::daemon
