// The data's disk is asked one question at a time, and may answer late.
#include "daemon/unit/disk_watch.h"

#include <gtest/gtest.h>

#include <future>
#include <memory>

#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

class DiskWatchTest : public ::testing::Test {
 protected:
  // What the disk has said until now comes to the reactor. -> how many answers
  std::size_t answers() {
    worker_.call([] {});
    reactor_.restart();
    return reactor_.poll();
  }

  testing::TempDirectory data_;
  ManualClock clock_;
  boost::asio::io_context reactor_;
  Worker worker_{"disk"};
  std::unique_ptr<DiskWatch> watch_ = std::make_unique<DiskWatch>(reactor_, worker_, data_.path(), clock_);
};

TEST_F(DiskWatchTest, ADiskThatHangsIsNotAskedAgain) {
  std::promise<void> hangs;
  worker_.post([woken = hangs.get_future().share()] { woken.wait(); });
  watch_->look();
  watch_->look();
  EXPECT_FALSE(watch_->free_bytes()) << "it has not answered yet";
  hangs.set_value();
  EXPECT_EQ(answers(), 1U);
  EXPECT_TRUE(watch_->free_bytes());
  watch_->look();
  EXPECT_EQ(answers(), 1U) << "it answers again, and so is asked again";
}

TEST_F(DiskWatchTest, OneThatCannotSayIsNotKnown) {
  watch_ = std::make_unique<DiskWatch>(reactor_, worker_, data_.path() / "not there", clock_);
  watch_->look();
  EXPECT_EQ(answers(), 1U);
  EXPECT_FALSE(watch_->free_bytes());
}

TEST_F(DiskWatchTest, AnAnswerThatComesAfterItsEndIsDropped) {
  std::promise<void> hangs;
  worker_.post([woken = hangs.get_future().share()] { woken.wait(); });
  watch_->look();
  watch_.reset();
  hangs.set_value();
  EXPECT_EQ(answers(), 1U);
}

}  // namespace
}  // namespace veneer::daemon
