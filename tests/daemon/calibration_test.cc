#include "daemon/calibration.h"

#include <gtest/gtest.h>

#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

constexpr const char* kNow = "2026-05-01T00:00:00.000Z";

class CalibrationTest : public ::testing::Test {
 protected:
  void issue(db::CertificateKind kind, const nlohmann::json& payload) {
    db::CertificateRecord certificate;
    certificate.kind = kind;
    certificate.issued_at = "2026-01-01T00:00:00.000Z";
    certificate.expires_at = "2999-01-01T00:00:00.000Z";
    certificate.payload = payload.dump();
    ASSERT_TRUE(database_
                    ->call([&](Repositories& r) -> Status {
                      auto issued = r.certificates.issue(certificate);
                      return issued ? Ok() : Status(issued.error());
                    })
                    .ok());
  }
  Calibration load() {
    auto loaded = database_->call([](Repositories& r) { return load_calibration(r, kNow); });
    EXPECT_TRUE(loaded.ok()) << loaded.error().message;
    return loaded ? *loaded : Calibration{};
  }

  testing::TempDirectory folder_;
  boost::asio::io_context reactor_;
  std::unique_ptr<DatabaseThread> database_ = std::move(*DatabaseThread::open(folder_ / "test.db", reactor_));
};

TEST_F(CalibrationTest, RemembersWhereThePatternWasBurnt) {
  EXPECT_FALSE(load().pattern_area);
  Box<MachineFrame> area;
  area.add(point<MachineFrame>(12.5, 20));
  area.add(point<MachineFrame>(480, 260));
  issue(db::CertificateKind::kCamera, to_payload(calib::CameraFit{}));
  issue(db::CertificateKind::kAxes, to_payload(calib::MachineAxes{}, CertificateId{1}, area));
  ASSERT_TRUE(load().bed);
  ASSERT_TRUE(load().pattern_area);
  EXPECT_EQ(load().pattern_area->min, area.min);
  EXPECT_EQ(load().pattern_area->max, area.max);
  // A new lens certificate makes the axes useless, but the board was burnt all the same.
  issue(db::CertificateKind::kCamera, to_payload(calib::CameraFit{}));
  EXPECT_FALSE(load().bed);
  EXPECT_TRUE(load().pattern_area);
}

}  // namespace
}  // namespace veneer::daemon
