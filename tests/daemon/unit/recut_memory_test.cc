// Which cuts can be met again, and until when.
#include "daemon/unit/recut_memory.h"

#include <gmock/gmock.h>

#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

using ::testing::HasSubstr;

class RecutMemoryTest : public ::testing::Test {
 protected:
  void SetUp() override {
    auto opened = DatabaseThread::open(dir_.path() / "test.db", io_);
    ASSERT_TRUE(opened.ok());
    database_ = std::move(*opened);
    memory_.emplace(
        *database_, view_, make_null_logger(), [this] { return connected_ ? &laser_ : nullptr; }, [] {});
    laser_.identity = "GRBL 1.1h of serial 7";
  }
  void TearDown() override {
    memory_.reset();
    database_.reset();
  }
  void keep(const std::vector<std::string>& marks) {
    ProvenPose pose;
    pose.panel = PanelId{"P-0001"};
    memory_->cuts().begin(pose, {JobId{4}, {}, laser_.identity});
    for (const std::string& mark : marks) memory_->cuts().add({PieceId{1}, mark, {}, 3});
    memory_->show();
  }
  void expect_forgotten() {
    EXPECT_EQ(view_.can_recut, 0);
    EXPECT_EQ(view_.recut_panel, PanelId{});
    EXPECT_EQ(view_.recut_job, JobId{});
    EXPECT_EQ(memory_->find({"A1-1"}).error().code, ErrorCode::kConflict);
  }

  boost::asio::io_context io_;
  veneer::testing::TempDirectory dir_;
  std::unique_ptr<DatabaseThread> database_;
  CellView view_;
  LaserLimits laser_;
  bool connected_ = false;
  std::optional<RecutMemory> memory_;
};

TEST_F(RecutMemoryTest, FindsWhatWasKeptByItsMarkAndNamesWhatWasNot) {
  EXPECT_EQ(memory_->find({}).error().code, ErrorCode::kConflict) << "nothing was cut";
  keep({"A1-1", "A1-2"});
  EXPECT_EQ(view_.can_recut, 2);
  EXPECT_EQ(view_.recut_panel, PanelId{"P-0001"});
  EXPECT_EQ(view_.recut_job, JobId{4});
  const auto found = memory_->find({"A1-2"});
  ASSERT_TRUE(found.ok());
  ASSERT_EQ(found->size(), 1U);
  EXPECT_EQ(found->front().mark, "A1-2");
  const auto other = memory_->find({"A1-1", "A1-9"});
  ASSERT_FALSE(other.ok());
  EXPECT_EQ(other.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(other.error().message, HasSubstr("piece A1-9 was not cut from panel P-0001"));
  EXPECT_EQ(memory_->find({}).error().code, ErrorCode::kInvalidArgument);
}

TEST_F(RecutMemoryTest, TheSameLaserMeetsItsCutsAgain) {
  keep({"A1-1"});
  connected_ = true;
  memory_->laser_connected();
  EXPECT_TRUE(memory_->find({"A1-1"}).ok());
  EXPECT_EQ(view_.can_recut, 1);
}

TEST_F(RecutMemoryTest, AnotherLaserMeetsNone) {
  keep({"A1-1"});
  connected_ = true;
  laser_.identity = "GRBL 1.1h of serial 8";
  memory_->laser_connected();
  expect_forgotten();
}

TEST_F(RecutMemoryTest, NothingIsMetAgainOnceItIsForgotten) {
  keep({"A1-1"});
  memory_->forget();
  expect_forgotten();
}

// An older panel's look may tell, in the midst of a run, that nothing lies as it did.
TEST_F(RecutMemoryTest, WhatIsCutAfterADoubtIsNotMetAgainUntilARunBegins) {
  keep({"A1-1"});
  memory_->forget();
  memory_->cuts().add({PieceId{2}, "A1-2", {}, 3});
  memory_->show();
  expect_forgotten();
  keep({"A1-3"});
  EXPECT_EQ(view_.can_recut, 1);
}

}  // namespace
}  // namespace veneer::daemon
