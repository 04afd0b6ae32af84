// What the API and veneerctl tell of certificates, after a device was changed.
#include <fmt/format.h>

#include <cmath>

#include "calib/error_lattice.h"
#include "cli/render.h"
#include "tests/support/routed_cell.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

class CertificateRoutes : public testing::RoutedCell {
 protected:
  void issue_kerf(const std::string& device) {
    db::CertificateRecord certificate;
    certificate.kind = db::CertificateKind::kKerf;
    certificate.issued_at = "2026-01-01T00:00:00.000Z";
    certificate.expires_at = "2999-01-01T00:00:00.000Z";
    certificate.payload = json{{"kerf_mm", 0.2}, {"device", device}}.dump();
    EXPECT_TRUE(cell->database->call([&](Repositories& r) { return r.certificates.issue(certificate); }).ok());
    cell->refresh_counts();
  }
  void issue(db::CertificateKind kind, json payload) {
    db::CertificateRecord certificate;
    certificate.kind = kind;
    certificate.issued_at = "2026-01-01T00:00:00.000Z", certificate.expires_at = "2999-01-01T00:00:00.000Z";
    payload["device"] = cell->database->call([&](Repositories& r) { return device_name(kind, r.devices); });
    certificate.payload = payload.dump();
    EXPECT_TRUE(cell->database->call([&](Repositories& r) { return r.certificates.issue(certificate); }).ok());
  }
  json status() {
    until_counted();
    return body_of(ask("GET", "/api/v1/status"));
  }
  json listed() { return body_of(ask("GET", "/api/v1/certificates")); }
};

TEST_F(CertificateRoutes, ListAndStatusSayTheSame) {
  const std::string here =
      cell->database->call([](Repositories& r) { return device_name(db::CertificateKind::kKerf, r.devices); });
  ASSERT_FALSE(here.empty());
  issue_kerf(here);
  EXPECT_EQ(status()["calibration"]["kerf"], "valid");
  EXPECT_EQ(listed()["certificates"][0]["state"], "valid");

  issue_kerf("twin at 300 dpi, twin");
  EXPECT_EQ(status()["calibration"]["kerf"], "other_device");
  EXPECT_EQ(status()["calibration"]["scanner"], "missing");
  const json list = listed()["certificates"];
  EXPECT_EQ(list[0]["state"], "other_device");
  EXPECT_EQ(list[0]["made_on"], "twin at 300 dpi, twin");
  EXPECT_EQ(list[1]["state"], "replaced") << "an older one never takes the place of the last";

  const std::string table = cli::render_certificates(listed());
  EXPECT_NE(table.find("other device"), std::string::npos) << table;
  EXPECT_NE(table.find("twin at 300 dpi, twin"), std::string::npos) << table;
  EXPECT_NE(cli::render_status(status()).find("scanner MISSING, camera MISSING, axes MISSING, kerf OTHER DEVICE"),
            std::string::npos);
}

// 320 x 300 mm of glass; its upper left corner was measured, its lower right one lies 200 mm away.
calib::ScannerCertificateData measured_above() {
  calib::ScannerCertificateData scanner;
  scanner.scans = 2;
  scanner.predicted = calib::lattice_over(0, 0, 320, 300, 160);
  scanner.predicted->near_mm = 15;
  calib::for_each_place(*scanner.predicted, [&](std::size_t index, double x, double y) {
    scanner.predicted->sigma_mm[index] = 0.01 + (x + y) / 10'000;
    scanner.predicted->measured_mm[index] = x + y;
  });
  return scanner;
}

TEST_F(CertificateRoutes, TellHowFarOffTheyWillBeAtAPlace) {
  issue(db::CertificateKind::kScanner, to_payload(measured_above()));
  const json one = body_of(ask("GET", "/api/v1/certificates/1?x=40&y=60"));
  EXPECT_EQ(one["certificate"]["state"], "valid");
  EXPECT_EQ(one["at"]["frame"], "scan");
  EXPECT_NEAR(one["at"]["predicted_error_mm"].get<double>(), 0.02, 1e-9);
  EXPECT_NEAR(one["at"]["to_measured_mm"].get<double>(), 100, 1e-9);
  const std::string told = cli::render_certificate(one);
  EXPECT_NE(told.find("40, 60 mm right and down from the upper left corner of a scan"), std::string::npos) << told;
  EXPECT_NE(told.find("0.020 mm, one sigma"), std::string::npos) << told;
  EXPECT_NE(told.find("about 100 mm from there"), std::string::npos) << told;

  // The list tells of all the glass.
  const json listed_one = listed()["certificates"][0];
  EXPECT_NEAR(listed_one["worst_predicted_mm"].get<double>(), 0.072, 1e-9);
  EXPECT_GT(listed_one["measured_fraction"].get<double>(), 0);
  EXPECT_LT(listed_one["measured_fraction"].get<double>(), 0.01);
  const std::string table = cli::render_certificates(listed());
  EXPECT_NE(table.find("PREDICTED"), std::string::npos) << table;
  EXPECT_NE(table.find("0.072"), std::string::npos) << table;

  EXPECT_FALSE(body_of(ask("GET", "/api/v1/certificates/1")).contains("at"));
  const auto beyond = ask("GET", "/api/v1/certificates/1?x=321&y=60");
  EXPECT_EQ(beyond.status, 400);
  EXPECT_NE(beyond.body.find("name one from 0, 0 to 320, 300 mm of the scan"), std::string::npos) << beyond.body;
  EXPECT_EQ(ask("GET", "/api/v1/certificates/1?x=40").status, 400);
  EXPECT_EQ(ask("GET", "/api/v1/certificates/2?x=40&y=60").status, 404);
  EXPECT_EQ(ask("GET", "/api/v1/certificates/9223372036854775807?x=40&y=60").status, 404);
}

// Whoever goes by what is named must not be refused again.
TEST_F(CertificateRoutes, NamePlacesThatLieWithin) {
  calib::ScannerCertificateData scanner;
  scanner.scans = 2;
  scanner.predicted = calib::lattice_over(0.4, -0.3, 215.9, 296.7, 20);
  issue(db::CertificateKind::kScanner, to_payload(scanner));
  const auto beyond = ask("GET", "/api/v1/certificates/1?x=400&y=60");
  EXPECT_EQ(beyond.status, 400);
  EXPECT_NE(beyond.body.find("name one from 1, 0 to 215, 296 mm of the scan"), std::string::npos) << beyond.body;
  for (const char* corner : {"x=1&y=0", "x=215&y=296"})
    EXPECT_EQ(ask("GET", fmt::format("/api/v1/certificates/1?{}", corner)).status, 200) << corner;
}

// The axes' places are the bed's, x to the right and y away; what is known of them is known of commanded ones.
TEST_F(CertificateRoutes, TellOfTheBedAsItIsSeen) {
  calib::MachineAxes axes;
  Eigen::Matrix2d sheared;
  sheared << 1, 0.2, 0, 1;
  axes.machine_from_bed = {sheared, Eigen::Vector2d::Zero()};
  axes.error.everywhere = Millimetres(0.01);
  axes.error.open(1, 1) = 1e-8;  // 0.0001 mm for each mm in y
  axes.error.measured = {point<MachineFrame>(300, 0)};
  Box<MachineFrame> reach;
  reach.add({}), reach.add(point<MachineFrame>(400, 300));
  PatternLayout pattern;
  pattern.area.add(point<MachineFrame>(290, 0)), pattern.area.add(point<MachineFrame>(310, 10));
  issue(db::CertificateKind::kAxes, to_payload(axes, CertificateId{0}, pattern, reach));
  struct Told {
    double x, y, error, distance;
  };
  for (const Told& told : {Told{50, 200, std::hypot(0.01, 0.02), std::hypot(300 - 90, 200)},
                           {200, 50, std::hypot(0.01, 0.005), std::hypot(300 - 210, 50)}}) {
    const json at = body_of(ask("GET", fmt::format("/api/v1/certificates/1?x={}&y={}", told.x, told.y)))["at"];
    EXPECT_EQ(at["frame"], "bed");
    EXPECT_NEAR(at["predicted_error_mm"].get<double>(), told.error, 1e-4);
    EXPECT_NEAR(at["to_measured_mm"].get<double>(), told.distance, 1);
  }
  const auto beyond = ask("GET", "/api/v1/certificates/1?x=50&y=-2");
  EXPECT_NE(beyond.body.find("name one from -60, 0 to 400, 300 mm of the bed"), std::string::npos) << beyond.body;
}

TEST_F(CertificateRoutes, SayInWordsWhereNothingIsPredicted) {
  const auto told = [&](db::CertificateKind kind, const json& payload, int number) {
    issue(kind, payload);
    const json one = body_of(ask("GET", fmt::format("/api/v1/certificates/{}?x=4&y=6", number)));
    EXPECT_TRUE(one["at"]["predicted_error_mm"].is_null()) << one;
    return cli::render_certificate(one);
  };
  json old = to_payload(measured_above());
  for (const char* key : {"predicted", "measured_fraction", "worst_predicted_mm"}) old.erase(key);
  EXPECT_NE(told(db::CertificateKind::kScanner, old, 1).find("made before errors were predicted"), std::string::npos);
  old["scans"] = 1;
  EXPECT_NE(told(db::CertificateKind::kScanner, old, 2).find("was made of one scan"), std::string::npos);
  EXPECT_NE(told(db::CertificateKind::kCamera, to_payload(calib::CameraFit{}), 3).find("ask that of the axes"),
            std::string::npos);
  EXPECT_NE(told(db::CertificateKind::kKerf, {{"kerf_mm", 0.2}}, 4).find("has no places"), std::string::npos);
}

}  // namespace
}  // namespace veneer::daemon
