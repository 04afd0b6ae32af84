// The plan service on a small stock: what it keeps and drops beside the plan.
#include "daemon/plan_service.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "daemon/calibration.h"
#include "tests/support/synthetic_wood.h"
#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

class PlanServiceTest : public ::testing::Test {
 protected:
  void SetUp() override {
    auto opened = DatabaseThread::open(folder_ / "test.db", reactor_);
    ASSERT_TRUE(opened.ok());
    database_ = std::move(*opened);
    db::CertificateRecord certificate;
    certificate.kind = db::CertificateKind::kKerf;
    certificate.issued_at = "2026-01-01T00:00:00.000Z";
    certificate.expires_at = "2999-01-01T00:00:00.000Z";
    calib::KerfMeasurement kerf;
    kerf.mean = Millimetres(0.1);
    certificate.payload = to_payload(kerf).dump();
    ASSERT_TRUE(database_->call([&](Repositories& r) { return r.certificates.issue(certificate); }).ok());
  }
  // A panel of 17 x 17 mm; all of its wood is free, or none.
  void add_panel(const std::string& id, int free) {
    const planner::StockPanel wood = planner::test::wood_panel(id, 200, 200, 300, 7);
    const auto map = library_.store_picture(wood.picture.pixels, "panels/" + id, "map");
    const auto mask = library_.store_picture(cv::Mat(200, 200, CV_8UC1, cv::Scalar(free)), "panels/" + id, "mask");
    ASSERT_TRUE(map.ok() && mask.ok());
    db::PanelRecord panel;
    panel.id = PanelId{id};
    panel.name = id;
    panel.width = panel.height = wood.picture.width();
    panel.map_file = map->file, panel.mask_file = mask->file, panel.map_hash = map->sha256;
    panel.created_at = "2026-01-01T00:00:00.000Z";
    const Status added = database_->call([&](Repositories& r) { return r.panels.add(panel, {}, {}); });
    ASSERT_TRUE(added.ok()) << added.error().message;
  }
  std::filesystem::path leave_index(const std::string& panel) {
    const std::filesystem::path file = library_.index_dir() / (panel + "-0-3.index");
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << "of an earlier plan";
    return file;
  }
  Result<JobOutcome> plan(bool fine_rotation = false) {
    JobRequest request;
    request.name = "test";
    std::vector<unsigned char> bytes;
    cv::imencode(".png", planner::test::blob_artwork("A", 20, 20, 6_mm, 3).picture, bytes);
    request.picture.assign(bytes.begin(), bytes.end());
    request.size = Millimetres(6);
    request.options.patch = Millimetres(3), request.options.rotations = 2, request.options.threads = 1;
    request.options.fine_rotation = fine_rotation;
    const RecipeConfig recipe;
    PlanService service(*database_, library_, recipe, Millimetres(0.2), make_null_logger());
    return service.make_job(request, [](double, const std::string&) {}, {});
  }

  testing::TempDirectory folder_;
  boost::asio::io_context reactor_;
  std::unique_ptr<DatabaseThread> database_;
  PanelLibrary library_{folder_.path()};
};

TEST_F(PlanServiceTest, RemovesTheIndexesOfPanelsThatAreUsedUpOrGone) {
  add_panel("P-0001", 0);
  add_panel("P-0002", 255);
  const auto used_up = leave_index("P-0001"), in_stock = leave_index("P-0002"), gone = leave_index("P-0000");
  const auto job = plan();
  ASSERT_TRUE(job.ok()) << job.error().message;
  EXPECT_FALSE(std::filesystem::exists(used_up));
  EXPECT_FALSE(std::filesystem::exists(gone));
  EXPECT_TRUE(std::filesystem::exists(in_stock));
  EXPECT_TRUE(std::filesystem::exists(library_.index_dir() / "P-0002-0-1.index")) << "what this plan measured";
}

TEST_F(PlanServiceTest, ReservesPiecesThatLieBetweenTheRotations) {
  add_panel("P-0001", 255);
  const auto job = plan(true);
  ASSERT_TRUE(job.ok()) << job.error().message;
  const auto pieces = database_->call([&](Repositories& r) { return r.jobs.pieces(job->job); });
  ASSERT_TRUE(pieces.ok());
  std::size_t between = 0;
  for (const auto& piece : *pieces) {
    ASSERT_TRUE(piece.panel);
    between += std::abs(std::sin(piece.panel_from_artwork.angle().count())) > 1e-3 ? 1 : 0;
    for (std::size_t i = 0; i < piece.artwork_outline.size(); ++i)
      EXPECT_LT(distance(piece.panel_outline[i], piece.panel_from_artwork * piece.artwork_outline[i]).count(), 1e-3);
  }
  EXPECT_GT(between, 0U);
}

}  // namespace
}  // namespace veneer::daemon
