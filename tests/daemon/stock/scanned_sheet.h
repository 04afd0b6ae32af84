// A sheet on the glass of a scanner, and the scan service that reads it into an empty stock.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <vector>

#include "base/clock.h"
#include "daemon/orders/scan_json.h"
#include "daemon/stock/scan_service.h"
#include "tests/support/one_picture.h"
#include "tests/support/rendered_panel.h"
#include "tests/support/temp_directory.h"
#include "tests/support/work_here.h"

namespace veneer::daemon {

class ScannedSheet : public ::testing::Test {
 protected:
  void SetUp() override {
    lay(rendered::sample_panel());
    auto opened = DatabaseThread::open(folder_ / "test.db", reactor_);
    ASSERT_TRUE(opened.ok());
    database_ = std::move(*opened);
    proposals_.emplace(*database_, library_, make_null_logger());
    db::CertificateRecord certificate;
    certificate.kind = db::CertificateKind::kScanner;
    certificate.issued_at = "2026-01-01T00:00:00.000Z";
    certificate.expires_at = "2999-01-01T00:00:00.000Z";
    nlohmann::json payload = to_payload(calib::ScannerCertificateData{});
    payload["make"] = "EPSON Perfection V39";
    certificate.payload = payload.dump();
    ASSERT_TRUE(database_->call([&](Repositories& r) { return r.certificates.issue(certificate); }).ok());
  }
  // On the glass, in the place of what lay there.
  void lay(const rendered::Panel& sheet, double turned_deg = 1.5, Face face = Face::kShow) {
    rendered::Scanner glass;
    // Fewer than the usual 300, which calib's own tests have: what is asked here is what becomes of masks and records.
    glass.dpi = 200, glass.width_mm = 180, glass.height_mm = 140;
    scanner_.nominal = glass.nominal();
    scanner_.file = folder_ / "scan.ppm";
    const auto pose = rendered::lay(sheet.width / 2, sheet.height / 2, 90, 70, turned_deg, face);
    ASSERT_TRUE(cv::imwrite(scanner_.file.string(), scan_panel(sheet, face, pose, glass)));
  }
  std::vector<db::DifferenceRecord> kept() {
    return *database_->call([](Repositories& r) { return r.differences.of(PanelId{"P-0001"}); });
  }
  // Taken into stock at once where it has no warnings.
  Result<ScanOutcome> scan(ScanRequest request = {}) {
    request.accept = true;
    return look(request);
  }
  Result<ScanOutcome> look(const ScanRequest& request = {}) {
    ScanService service(scanner_, *database_, library_, workers_, *proposals_, config_);
    return service.add_tile(request, [](double, const std::string&) {}, {});
  }
  db::PanelRecord panel() {
    return *database_->call([](Repositories& r) { return r.panels.find(PanelId{"P-0001"}); });
  }

  Config config_;
  testing::TempDirectory folder_;
  boost::asio::io_context reactor_;
  std::unique_ptr<DatabaseThread> database_;
  PanelLibrary library_{folder_.path()};
  testing::OnePicture scanner_;
  testing::WorkHere workers_;
  std::optional<ScanProposals> proposals_;
};

}  // namespace veneer::daemon
