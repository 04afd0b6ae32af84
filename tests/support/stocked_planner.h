// The plan service over a small stock that a test fills, its work done in this process.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "daemon/plans/plan_service.h"
#include "daemon/store/calibration.h"
#include "tests/support/synthetic_wood.h"
#include "tests/support/temp_directory.h"
#include "tests/support/work_here.h"

namespace veneer::testing {

class StockedPlanner : public ::testing::Test {
 protected:
  void SetUp() override {
    auto opened = daemon::DatabaseThread::open(folder_ / "test.db", reactor_);
    ASSERT_TRUE(opened.ok());
    database_ = std::move(*opened);
    db::CertificateRecord certificate;
    certificate.kind = db::CertificateKind::kKerf;
    certificate.issued_at = "2026-01-01T00:00:00.000Z";
    certificate.expires_at = "2999-01-01T00:00:00.000Z";
    calib::KerfMeasurement kerf;
    kerf.mean = Millimetres(0.1);
    certificate.payload = daemon::to_payload(kerf).dump();
    ASSERT_TRUE(database_->call([&](daemon::Repositories& r) { return r.certificates.issue(certificate); }).ok());
  }
  // A panel of 17 x 17 mm; all of its wood is free, or none.
  void add_panel(const std::string& id, int free) { add_panel(id, free, planner::test::wood_picture(200, 200, 7)); }
  void add_panel(const std::string& id, int free, const cv::Mat& picture, bool back_scanned = true) {
    const auto map = library_.store_picture(picture, "panels/" + id, "map");
    const auto mask =
        library_.store_picture(cv::Mat(picture.size(), CV_8UC1, cv::Scalar(free)), "panels/" + id, "mask");
    ASSERT_TRUE(map.ok() && mask.ok());
    db::PanelRecord panel;
    panel.id = PanelId{id};
    panel.name = id;
    panel.width = ScanResolution::from_dpi(300).to_mm(Pixels(picture.cols));
    panel.height = ScanResolution::from_dpi(300).to_mm(Pixels(picture.rows));
    panel.map_file = map->file, panel.mask_file = mask->file, panel.map_hash = map->sha256;
    panel.created_at = "2026-01-01T00:00:00.000Z";
    db::FiducialRecord tag;  // beside all wood
    tag.face = back_scanned ? Face::kBack : Face::kShow;
    tag.tag_id = 200 + tags_++;
    tag.corners = {{-30_mm, 0_mm}, {-22_mm, 0_mm}, {-22_mm, 8_mm}, {-30_mm, 8_mm}};
    const Status added = database_->call([&](daemon::Repositories& r) { return r.panels.add(panel, {}, {tag}); });
    ASSERT_TRUE(added.ok()) << added.error().message;
  }
  // A strip of the panel, over all its height, is of this wood.
  void add_zone(const std::string& panel, Millimetres left, Millimetres right, const std::string& material) {
    const Ring<PanelFrame> outline{{left, 0_mm}, {right, 0_mm}, {right, 30_mm}, {left, 30_mm}};
    zones_[panel].push_back({static_cast<int>(zones_[panel].size()) + 1, Region<PanelFrame>(outline), material});
  }
  void store_zones() {
    ASSERT_TRUE(database_->call([&](daemon::Repositories& r) -> Status {
      for (const auto& [panel, zones] : zones_) {
        if (Status added = r.materials.add_zones(PanelId{panel}, zones); !added) return added;
        for (const auto& zone : zones)
          if (Status named = r.materials.set_material(PanelId{panel}, zone.number, zone.material); !named) return named;
      }
      return Ok();
    }));
  }
  // Half of it dark, half of it pale, and to be rebuilt by brightness alone.
  static daemon::JobRequest two_tone_job() {
    daemon::JobRequest request = small_job();
    cv::Mat picture(20, 20, CV_8UC3, cv::Scalar::all(170));
    picture(cv::Rect(0, 0, 10, 20)).setTo(cv::Scalar::all(80));
    request.files = png(picture);
    request.options.w_intensity = 1, request.options.w_edge = 0, request.options.w_hist = 1;
    return request;
  }
  std::filesystem::path leave_index(const std::string& panel) {
    const std::filesystem::path file = library_.index_dir() / (panel + "-0-3.index");
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << "of an earlier plan";
    return file;
  }
  // A picture of 6 x 6 mm in four patches.
  static daemon::JobRequest small_job() {
    daemon::JobRequest request;
    request.name = "test";
    request.files = png(planner::test::blob_artwork("A", 20, 20, 6_mm, 3).picture);
    request.size = Millimetres(6);
    request.options.patch = Millimetres(3), request.options.rotations = 2, request.options.threads = 1;
    return request;
  }
  // With curved borders.
  static daemon::JobRequest refined_job() {
    daemon::JobRequest request = small_job();
    request.size = Millimetres(12);
    request.options.patch = Millimetres(6), request.options.dpi = 100;
    request.options.refine = planner::Refine::kDp;
    return request;
  }
  static std::string png(const cv::Mat& picture) {
    std::vector<unsigned char> bytes;
    cv::imencode(".png", picture, bytes);
    return {bytes.begin(), bytes.end()};
  }
  Result<daemon::JobOutcome> plan(
      const daemon::JobRequest& request, const daemon::TaskProgress& progress = [](double, const std::string&) {},
      const std::stop_token& stop = {}) {
    return service().make_job(request, "local:1000", progress, stop);
  }
  daemon::PlanService service() { return {*database_, library_, workers_, config_, make_null_logger()}; }
  Result<daemon::JobOutcome> stored_plan(const daemon::JobRequest& request) {
    return service().make_plan(request, "uid 1000", [](double, const std::string&) {}, {});
  }
  Result<daemon::JobOutcome> changed(const daemon::PlanService::Change& change) {
    return service().change_plan(change, "uid 1000", [](double, const std::string&) {}, {});
  }
  std::map<std::string, db::PlannedPatch> pieces_of(db::PlanId plan) {
    std::map<std::string, db::PlannedPatch> out;
    const auto pieces = database_->call([&](daemon::Repositories& r) { return r.plans.patches(plan); });
    for (const auto& piece : *pieces) out[piece.mark] = piece;
    return out;
  }
  std::size_t jobs() {
    return database_->call([](daemon::Repositories& r) { return r.jobs.list(); })->size();
  }

  TempDirectory folder_;
  boost::asio::io_context reactor_;
  std::unique_ptr<daemon::DatabaseThread> database_;
  daemon::PanelLibrary library_{folder_.path()};
  WorkHere workers_;
  daemon::Config config_;
  int tags_ = 0;
  std::map<std::string, std::vector<db::ZoneRecord>> zones_;
};

}  // namespace veneer::testing
