// What a scan saw of suspect wood tells nothing of wood that became suspect after its pictures were taken.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/stock/scan_proposals.h"
#include "tests/support/stocked_database.h"
#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

class ScanSightings : public ::testing::Test {
 protected:
  void SetUp() override {
    auto opened = DatabaseThread::open(folder_ / "test.db", reactor_);
    ASSERT_TRUE(opened.ok());
    database_ = std::move(*opened);
    ASSERT_TRUE(tests::stock_two_panels(*database_, 2, 1).ok());
    become_suspect("2026-05-02T10:00:00.000Z");
  }
  void become_suspect(const std::string& at) {
    ASSERT_TRUE(database_->call([&](Repositories& r) { return r.jobs.make_suspect({{PieceId{1}}}, at); }).ok());
  }
  // A scan of the first panel, taken then, that saw its first piece whole.
  std::optional<db::Sighting> sighting_of_scan(const std::string& taken_at) {
    const auto panel = database_->call([](Repositories& r) { return r.panels.find({"P-0001"}); });
    const auto wood = database_->call([](Repositories& r) { return r.jobs.find_piece(PieceId{1}); })->allocation;
    SeenSheet seen;
    seen.panel = panel->id, seen.after = panel->mask_version;
    seen.map_file = "panels/P-0001/map-" + taken_at, seen.mask_file = "panels/P-0001/mask-" + taken_at;
    seen.map_sha256 = taken_at;
    seen.read.sheet.add(point<PanelFrame>(0, 0));
    seen.read.sheet.add(point<PanelFrame>(200, 100));
    seen.read.lattices = {"[]"};
    seen.read.suspects_gone = {0};
    seen.tiles = {{"scans/" + taken_at, std::string(64, 'a'), "twin:1", taken_at, 300}};
    seen.suspects = {{wood.value, 1}};
    ScanProposals proposals(*database_, library_, make_null_logger());
    const auto entered = proposals.propose(seen, "uid 7");
    EXPECT_TRUE(entered.ok()) << entered.error().message;
    return database_->call([](Repositories& r) { return r.jobs.find_piece(PieceId{1}); })->sighting;
  }

  testing::TempDirectory folder_;
  boost::asio::io_context reactor_;
  std::unique_ptr<DatabaseThread> database_;
  PanelLibrary library_{folder_.path()};
};

TEST_F(ScanSightings, AreOfTheDayOnWhichThePictureWasTaken) {
  const auto seen = sighting_of_scan("2026-05-03T10:00:00.000Z");
  ASSERT_TRUE(seen);
  EXPECT_EQ(seen->seen, db::Seen::kStillThere);
  EXPECT_EQ(seen->at, "2026-05-03T10:00:00.000Z");
}

// It was cut again meanwhile, and the beam may have burnt what the picture shows whole.
TEST_F(ScanSightings, OfAPictureFromBeforeItBecameSuspectAnewAreNone) {
  ASSERT_TRUE(database_
                  ->call([](Repositories& r) {
                    return r.jobs.settle(PieceId{1}, db::AllocationState::kCut, "2026-05-04T10:00:00.000Z",
                                         "user anna");
                  })
                  .ok());
  become_suspect("2026-05-04T11:00:00.000Z");
  EXPECT_FALSE(sighting_of_scan("2026-05-03T10:00:00.000Z"));
  EXPECT_TRUE(sighting_of_scan("2026-05-05T10:00:00.000Z"));
}

}  // namespace
}  // namespace veneer::daemon
