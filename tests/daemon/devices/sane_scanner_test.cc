// Scanners as the cell uses them: the shipped veneer-worker, confined, with SANE's own backends for tests.
#include "daemon/devices/sane_scanner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "daemon/stock/scan_service.h"
#include "daemon/wiring.h"
#include "daemon/workers/worker_processes.h"
#include "tests/support/rendered_panel.h"
#include "tests/support/sane_config.h"
#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class SaneScannerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    VENEER_NEEDS_SANE_BACKENDS();
    testing::write_sane_config(settings_.path());
    config_.kind = "sane";
    config_.device = "pnm:0";
    config_.sane_config = settings_.path();
    serve(cv::Mat(40, 50, CV_8UC3, cv::Scalar(10, 20, 30)));
  }
  // What lies on pnm's glass. SANE's settings are what a worker may read besides files that a setting names.
  void serve(const cv::Mat& picture) {
    ASSERT_TRUE(cv::imwrite((pictures_ / "served.ppm").string(), picture));
    config_.options = {{"filename", (pictures_ / "served.ppm").string()}};
  }
  // A scanner that would need minutes: each portion is a byte, and waits.
  void be_slow() {
    config_.device = "test:0";
    config_.options = {{"read-limit", "true"}, {"read-delay", "true"}, {"read-delay-duration", "200000"}};
  }
  SaneScanner scanner(std::chrono::milliseconds deadline = std::chrono::seconds(60)) {
    return {std::make_unique<WorkerProcesses>(
                WorkerProcessOptions{VENEER_WORKER, 0, [this](pid_t pid) { worker_ = pid; }}, make_null_logger()),
            config_, "", data_.path(), deadline};
  }

  testing::TempDirectory settings_, pictures_, data_;
  ScannerConfig config_;
  pid_t worker_ = 0;
};

TEST_F(SaneScannerTest, AScanArrivesAsAFilePixelByPixel) {
  cv::Mat shown(120, 200, CV_8UC3);
  cv::randu(shown, 0, 256);
  serve(shown);
  SaneScanner one = scanner();
  double told = 0;
  const auto scan = one.scan(ScanResolution::from_dpi(300), [&](double f, const std::string&) { told = f; }, {});
  ASSERT_TRUE(scan.ok()) << scan.error().message;
  EXPECT_EQ(scan->device, "sane:pnm:0");
  EXPECT_EQ(scan->make, "Noname PNM file reader");
  EXPECT_DOUBLE_EQ(scan->nominal.dpi(), 300);
  EXPECT_DOUBLE_EQ(told, 1);
  EXPECT_EQ(cv::norm(cv::imread(scan->file.string()), shown, cv::NORM_INF), 0);
  // Until the next one.
  const auto again = one.scan(ScanResolution::from_dpi(300), {}, {});
  ASSERT_TRUE(again.ok());
  EXPECT_FALSE(std::filesystem::exists(scan->file));
}

TEST_F(SaneScannerTest, AResolutionThatTheDeviceDoesNotHaveIsRefused) {
  const auto scan = scanner().scan(ScanResolution::from_dpi(310), {}, {});
  ASSERT_FALSE(scan.ok());
  EXPECT_EQ(scan.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(scan.error().message, AllOf(HasSubstr("resolution = 310"), HasSubstr("285, 300")));
}

TEST_F(SaneScannerTest, AScannerThatDoesNotComeToAnEndIsGivenUpAtItsDeadline) {
  be_slow();
  // Were its deadline not kept, the scan would be done one day, or this test would never end.
  const auto scan = scanner(std::chrono::seconds(1)).scan(ScanResolution::from_dpi(300), {}, {});
  ASSERT_FALSE(scan.ok());
  EXPECT_EQ(scan.error().code, ErrorCode::kTimeout);
  EXPECT_THAT(scan.error().message, AllOf(HasSubstr("test:0"), HasSubstr("within 1 s"), HasSubstr("off and on")));
  EXPECT_EQ(::kill(worker_, 0), -1) << "its process goes on";
}

TEST_F(SaneScannerTest, AScanIsCancelledInTheMidstAndLeavesNothing) {
  be_slow();
  std::stop_source stop;
  const auto scan = scanner().scan(
      ScanResolution::from_dpi(300),
      [&](double fraction, const std::string& doing) {
        if (doing.empty() && fraction > 0) stop.request_stop();
      },
      stop.get_token());
  ASSERT_FALSE(scan.ok());
  EXPECT_EQ(scan.error().code, ErrorCode::kCancelled);
  EXPECT_EQ(::kill(worker_, 0), -1);
  EXPECT_TRUE(std::filesystem::is_empty(data_ / "work"));
}

TEST_F(SaneScannerTest, FaultsOfTheDeviceAreItsSentences) {
  config_.options.emplace_back("status", "false");
  config_.options.emplace_back("status-coveropen", "true");
  const auto scan = scanner().scan(ScanResolution::from_dpi(300), {}, {});
  ASSERT_FALSE(scan.ok());
  EXPECT_EQ(scan.error().code, ErrorCode::kDeviceFault);
  EXPECT_THAT(scan.error().message, HasSubstr("the scanner pnm:0 has its cover open"));
}

TEST_F(SaneScannerTest, IsNamedByWhatItsScansHangOn) {
  config_.device = "EPSON Perfection V39";
  EXPECT_EQ(scanner().device(), "sane EPSON Perfection V39");
  config_.source = "Flatbed";
  config_.area_mm = {0, 12.5, 200, 200};
  EXPECT_EQ(scanner().device(), "sane EPSON Perfection V39, Flatbed, from 0, 12.5 mm");
}

TEST_F(SaneScannerTest, ThereAreListedWithTheirSettings) {
  Config config;
  config.scanner.sane_config = settings_.path();  // whatever the kind
  config.store.data_dir = data_.path();
  WorkerProcesses workers({VENEER_WORKER, 0, {}}, make_null_logger());
  const auto found = find_scanners(workers, config, {}, {});
  ASSERT_TRUE(found.ok()) << found.error().message;
  std::vector<std::string> names;
  for (const auto& scanner : found->scanners) {
    names.push_back(scanner.found.name);
    EXPECT_FALSE(scanner.options.empty()) << scanner.problem;
  }
  EXPECT_THAT(names, ::testing::UnorderedElementsAre("test:0", "test:1", "pnm:0", "pnm:1"));
}

// Of the kind in the configuration wiring makes the driver.
TEST_F(SaneScannerTest, IsMadeOfTheConfiguration) {
  Config config;
  config.scanner = config_;
  config.store.data_dir = data_.path();
  const SteadyClock clock;
  boost::asio::io_context reactor;
  const auto devices = make_devices(config, clock, reactor, make_null_logger());
  ASSERT_TRUE(devices.ok()) << devices.error().message;
  EXPECT_EQ(devices->scanner->device(), "sane pnm:0");
}

// From the glass into stock: the whole way of `veneerctl panel scan`.
TEST_F(SaneScannerTest, APanelOnTheGlassEntersStock) {
  const auto sheet = rendered::sample_panel();
  rendered::Scanner glass;
  glass.width_mm = 180, glass.height_mm = 140;
  ASSERT_DOUBLE_EQ(glass.dpi, 300);
  serve(scan_panel(sheet, Face::kShow, rendered::lay(sheet.width / 2, sheet.height / 2, 90, 70, 1.5, Face::kShow),
                   glass));
  boost::asio::io_context reactor;
  auto database = DatabaseThread::open(data_ / "cell.db", reactor);
  ASSERT_TRUE(database.ok());
  db::CertificateRecord certificate;
  certificate.kind = db::CertificateKind::kScanner;
  certificate.issued_at = "2026-01-01T00:00:00.000Z";
  certificate.expires_at = "2999-01-01T00:00:00.000Z";
  certificate.payload = to_payload(calib::ScannerCertificateData{}).dump();
  ASSERT_TRUE((*database)->call([&](Repositories& r) { return r.certificates.issue(certificate); }).ok());
  const PanelLibrary library(data_.path());
  const Config config;
  WorkerProcesses workers({VENEER_WORKER, 0, {}}, make_null_logger());
  SaneScanner on_sane = scanner();
  ScanProposals proposals(**database, library, make_null_logger());
  ScanService service(on_sane, **database, library, workers, proposals, config);
  ScanRequest request;
  request.accept = true;
  const auto outcome = service.add_tile(request, [](double, const std::string&) {}, {});
  ASSERT_TRUE(outcome.ok()) << outcome.error().message;
  EXPECT_TRUE(outcome->is_new);
  EXPECT_GT(outcome->zones, 0U);
  const auto panel = (*database)->call([](Repositories& r) { return r.panels.find(PanelId{"P-0001"}); });
  ASSERT_TRUE(panel.ok());
  // As tests/calib hold a first scan to be.
  EXPECT_NEAR(panel->width.count(), sheet.width, 0.3);
  EXPECT_NEAR(panel->height.count(), sheet.height, 0.3);
}

}  // namespace
}  // namespace veneer::daemon
