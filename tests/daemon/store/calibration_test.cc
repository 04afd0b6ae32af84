#include "daemon/store/calibration.h"

#include <gtest/gtest.h>

#include <array>

#include "tests/support/stocked_database.h"
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
  EXPECT_FALSE(load().pattern);
  Box<MachineFrame> area;
  area.add(point<MachineFrame>(12.5, 20));
  area.add(point<MachineFrame>(480, 260));
  issue(db::CertificateKind::kCamera, to_payload(calib::CameraFit{}));
  issue(db::CertificateKind::kAxes, to_payload(calib::MachineAxes{}, CertificateId{1}, {area}, {}));
  ASSERT_TRUE(load().bed);
  ASSERT_TRUE(load().pattern);
  EXPECT_EQ(load().pattern->area.min, area.min);
  EXPECT_EQ(load().pattern->area.max, area.max);
  EXPECT_EQ(load().pattern->spacing, RingSpacing::kUneven);
  // A new lens certificate makes the axes useless, but the board was burnt all the same.
  issue(db::CertificateKind::kCamera, to_payload(calib::CameraFit{}));
  EXPECT_FALSE(load().bed);
  EXPECT_TRUE(load().pattern);
}

// Its rings and kerf lines lie elsewhere than those of a pattern that is burnt today.
TEST_F(CalibrationTest, ReadsABoardThatWasBurntBeforeAsItWasBurnt) {
  Box<MachineFrame> area;
  area.add(point<MachineFrame>(12.5, 20));
  area.add(point<MachineFrame>(480, 260));
  auto old = to_payload(calib::MachineAxes{}, CertificateId{1}, {area}, {});
  old.erase("pattern_spacing");
  issue(db::CertificateKind::kCamera, to_payload(calib::CameraFit{}));
  issue(db::CertificateKind::kAxes, old);
  ASSERT_TRUE(load().pattern);
  EXPECT_EQ(load().pattern->spacing, RingSpacing::kEven);
}

TEST_F(CalibrationTest, CertificatesOfAnotherDeviceAreVoid) {
  const CellDevices twin{"twin at 300 dpi", "twin:camera", "twin"};
  const auto have = [&](const CellDevices& devices) {
    database_->call([&](Repositories& r) {
      r.devices = devices;
      return 0;
    });
    const Calibration loaded = load();
    return std::array{loaded.scanner.has_value(), loaded.camera.has_value(), loaded.bed.has_value(),
                      loaded.kerf.has_value()};
  };
  const auto issue_on_twin = [&](db::CertificateKind kind, nlohmann::json payload) {
    payload["device"] = device_name(kind, twin);
    issue(kind, payload);
  };
  issue_on_twin(db::CertificateKind::kScanner, to_payload(calib::ScannerCertificateData{}));
  issue_on_twin(db::CertificateKind::kCamera, to_payload(calib::CameraFit{}));
  Box<MachineFrame> area;
  area.add(point<MachineFrame>(0, 0));
  area.add(point<MachineFrame>(500, 300));
  issue_on_twin(db::CertificateKind::kAxes, to_payload(calib::MachineAxes{}, CertificateId{2}, {area}, {}));
  issue_on_twin(db::CertificateKind::kKerf, to_payload(calib::KerfMeasurement{}));

  EXPECT_EQ(have(twin), (std::array{true, true, true, true}));
  EXPECT_EQ(have({"twin at 600 dpi", "twin:camera", "twin"}), (std::array{false, true, true, false}));
  EXPECT_EQ(have({"twin at 300 dpi", "file:/bed.jpg", "twin"}), (std::array{true, false, false, true}));
  EXPECT_EQ(have({"twin at 300 dpi", "twin:camera", "grbl serial:/dev/ttyUSB0?baud=115200"}),
            (std::array{true, true, false, false}));
  EXPECT_EQ(have({}), (std::array{true, true, true, true})) << "where devices have no names";
}

TEST_F(CalibrationTest, SaysOfEachKindWhyNoCertificateIsInForce) {
  using State = CertificateState;
  using Kind = db::CertificateKind;
  const auto standing = [&](Kind kind) { return load().standing.at(kind).state; };
  EXPECT_EQ(standing(Kind::kScanner), State::kMissing);
  const CellDevices twin{"twin at 300 dpi", "twin:camera", "twin"};
  const auto on = [&](const CellDevices& devices) {
    database_->call([&](Repositories& r) {
      r.devices = devices;
      return 0;
    });
  };
  on(twin);
  const auto issue_on_twin = [&](Kind kind, nlohmann::json payload) {
    payload["device"] = device_name(kind, twin);
    issue(kind, payload);
  };
  Box<MachineFrame> area;
  area.add(point<MachineFrame>(0, 0));
  area.add(point<MachineFrame>(500, 300));
  issue_on_twin(Kind::kCamera, to_payload(calib::CameraFit{}));
  issue_on_twin(Kind::kAxes, to_payload(calib::MachineAxes{}, CertificateId{1}, {area}, {}));
  issue_on_twin(Kind::kKerf, to_payload(calib::KerfMeasurement{}));
  EXPECT_EQ(standing(Kind::kCamera), State::kValid);
  EXPECT_EQ(standing(Kind::kAxes), State::kValid);
  EXPECT_EQ(load().standing.at(Kind::kAxes).certificate, CertificateId{2});

  on({"twin at 600 dpi", "file:/bed.jpg", "twin"});
  EXPECT_EQ(standing(Kind::kCamera), State::kOtherDevice);
  EXPECT_EQ(standing(Kind::kAxes), State::kOtherDevice);
  EXPECT_EQ(standing(Kind::kKerf), State::kOtherDevice);
  on(twin);
  issue_on_twin(Kind::kCamera, to_payload(calib::CameraFit{}));
  EXPECT_EQ(standing(Kind::kCamera), State::kValid);
  EXPECT_EQ(standing(Kind::kAxes), State::kReplaced) << "the bed frame they start from is gone";

  const auto at = [&](const char* now) {
    return database_->call([&](Repositories& r) { return load_calibration(r, now); })->standing.at(Kind::kKerf);
  };
  EXPECT_EQ(at("2025-01-01T00:00:00.000Z").state, State::kAhead);
  EXPECT_EQ(at("2999-01-01T00:00:00.000Z").state, State::kExpired);
  EXPECT_EQ(at(kNow).at("2999-01-01T00:00:00.000Z"), State::kExpired) << "while nobody looks into the database";
  EXPECT_EQ(standing(Kind::kKerf), State::kValid);

  // The laser behind the port tells that it is another one.
  const auto laser_is = [&](const char* identity) {
    EXPECT_TRUE(database_->call([&](Repositories& r) { return r.certificates.laser_is(identity, kNow); }).ok());
  };
  laser_is("a");
  laser_is("b");
  laser_is("b");
  const auto noted = database_->call([](Repositories& r) { return *r.audit.latest(10); });
  ASSERT_EQ(noted.size(), 2U) << "each once";
  EXPECT_EQ(noted[0].who + " " + noted[0].what + " " + noted[0].detail, "veneerd laser.found b");
  EXPECT_EQ(standing(Kind::kKerf), State::kOtherDevice);
  EXPECT_EQ(standing(Kind::kCamera), State::kValid);
}

TEST_F(CalibrationTest, ACertificateDoesNotExpireUnderTheRunThatBeganWithIt) {
  ASSERT_TRUE(tests::stock_two_panels(*database_, 2, 1).ok());  // with certificates 1, 2 and 3
  constexpr const char* kExpired = "2999-02-01T00:00:00.000Z";
  const auto may_cut = [&] {
    const auto loaded =
        database_->call([](Repositories& r) { return load_calibration_of_run(r, "2999-02-01T00:00:00.000Z"); });
    return loaded.ok() && require_cutting(*loaded).ok();
  };
  EXPECT_FALSE(may_cut()) << "no run is on";
  const auto begin = [&](std::vector<CertificateId> with) {
    return *database_->call([&](Repositories& r) {
      return r.jobs.start_run(JobId{1}, PanelId{"P-0001"}, {}, Millimetres(0.02), kNow, {"uid 1000", with, "[]"});
    });
  };
  const auto end = [&](db::RunId run) {
    ASSERT_TRUE(database_->call([&](Repositories& r) { return r.jobs.abort_run(run, {}, "stop", kNow); }).ok());
  };
  db::RunId run = begin({{1}, {2}, {3}});
  EXPECT_TRUE(may_cut());
  EXPECT_FALSE(require_cutting(*database_->call([&](Repositories& r) { return load_calibration(r, kExpired); })).ok())
      << "for all others";
  end(run);
  EXPECT_FALSE(may_cut()) << "the next run stands on new ones";
  run = begin({{1}, {3}});
  EXPECT_FALSE(may_cut()) << "not on these";
  end(run);
}

// It runs out between the last cut and the look that is owed to it.
TEST_F(CalibrationTest, NorUnderALookThatTheRunStillOwes) {
  ASSERT_TRUE(tests::stock_two_panels(*database_, 2, 1).ok());
  const auto may_look = [&] {
    const auto loaded =
        database_->call([](Repositories& r) { return load_calibration_of_run(r, "2999-02-01T00:00:00.000Z"); });
    return loaded.ok() && require_cutting(*loaded).ok();
  };
  const auto run = database_->call([](Repositories& r) {
    auto begun = r.jobs.start_run(JobId{1}, PanelId{"P-0001"}, {}, Millimetres(0.02), kNow,
                                  {"uid 1000", {{1}, {2}, {3}}, "[]", true});
    EXPECT_TRUE(r.jobs.mark_cutting(PieceId{1}, kNow).ok());
    EXPECT_TRUE(r.jobs.book_piece(PieceId{1}, kNow).ok());
    EXPECT_TRUE(r.jobs.abort_run(*begun, {}, "stop", kNow).ok());
    return *begun;
  });
  EXPECT_TRUE(may_look());
  ASSERT_TRUE(database_->call([&](Repositories& r) { return r.jobs.note_proof(run, kNow); }).ok());
  EXPECT_FALSE(may_look()) << "it is paid";
}

TEST_F(CalibrationTest, EveryCertificateIsListedAsWhatItIs) {
  const auto states = [&] {
    auto list = database_->call([](Repositories& r) { return judged_certificates(r, kNow); });
    EXPECT_TRUE(list.ok());
    std::vector<std::string> out;
    for (const JudgedCertificate& c : *list) out.push_back(std::string(to_string(c.state)) + " " + c.made_on);
    return out;
  };
  nlohmann::json lens = to_payload(calib::CameraFit{});
  issue(db::CertificateKind::kCamera, lens);
  lens["device"] = "twin:camera";
  issue(db::CertificateKind::kCamera, lens);
  EXPECT_EQ(states(), (std::vector<std::string>{"valid twin:camera", "replaced "}));
  database_->call([](Repositories& r) {
    r.devices.camera = "file:/bed.jpg";
    return 0;
  });
  EXPECT_EQ(states(), (std::vector<std::string>{"other_device twin:camera", "replaced "}));
}

TEST_F(CalibrationTest, ACertificateSaysHowWellAndHowLongItWillServe) {
  calib::ScannerCertificateData scanner;
  scanner.scans = 1, scanner.covered_fraction = 0.9;
  issue(db::CertificateKind::kScanner, to_payload(scanner));
  const auto doubts = [&](const char* soon) {
    auto list = database_->call([&](Repositories& r) { return judged_certificates(r, kNow, {}, -1, soon); });
    EXPECT_TRUE(list.ok());
    return list->front().doubts;
  };
  ASSERT_EQ(doubts("").size(), 1U);
  EXPECT_NE(doubts("")[0].find("made of one scan"), std::string::npos);
  // Expires in 2999.
  EXPECT_EQ(doubts("2026-05-08T00:00:00.000Z").size(), 1U);
  ASSERT_EQ(doubts("2999-01-02T00:00:00.000Z").size(), 2U);
  EXPECT_NE(doubts("2999-01-02T00:00:00.000Z")[1].find("expires on 2999-01-01"), std::string::npos);
  scanner.scans = 3, scanner.covered_fraction = 0.5;
  scanner.other_scan_rms = Millimetres(0.045), scanner.other_scan_max = Millimetres(0.12);
  issue(db::CertificateKind::kScanner, to_payload(scanner));
  ASSERT_EQ(doubts("").size(), 2U);
  EXPECT_NE(doubts("")[0].find("0.045 mm rms"), std::string::npos);
  EXPECT_NE(doubts("")[1].find("50 % of the glass"), std::string::npos);
  scanner.covered_fraction = 0.8, scanner.other_scan_rms = Millimetres(0.006);
  issue(db::CertificateKind::kScanner, to_payload(scanner));
  EXPECT_TRUE(doubts("").empty());
}

TEST_F(CalibrationTest, ACertificateThatNamesNoDeviceIsVoidWhereDevicesHaveNames) {
  issue(db::CertificateKind::kCamera, to_payload(calib::CameraFit{}));
  EXPECT_TRUE(load().camera);
  database_->call([](Repositories& r) {
    r.devices.camera = "file:/bed.jpg";
    return 0;
  });
  EXPECT_FALSE(load().camera);
}

TEST_F(CalibrationTest, PicturesOfAnotherSizeAreRefused) {
  calib::CameraParameters lens;
  lens.width_px = 4000, lens.height_px = 3000;
  EXPECT_TRUE(require_picture_size(calib::CameraModel(lens), 4000, 3000).ok());
  const Status turned = require_picture_size(calib::CameraModel(lens), 3000, 4000);
  ASSERT_FALSE(turned.ok());
  EXPECT_EQ(turned.error().code, ErrorCode::kRefused);
  EXPECT_NE(turned.error().message.find("3000 x 4000"), std::string::npos);

  EXPECT_TRUE(require_scan_size(load(), 1, 1).ok()) << "no certificate, nothing to compare with";
  nlohmann::json scanner = to_payload(calib::ScannerCertificateData{});
  scanner["scan_px"] = {2480, 3508};
  issue(db::CertificateKind::kScanner, scanner);
  EXPECT_TRUE(require_scan_size(load(), 2480, 3508).ok());
  EXPECT_FALSE(require_scan_size(load(), 2480, 3507).ok());
}

}  // namespace
}  // namespace veneer::daemon
