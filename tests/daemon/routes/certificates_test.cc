// What the API and veneerctl tell of certificates, after a device was changed.
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

}  // namespace
}  // namespace veneer::daemon
