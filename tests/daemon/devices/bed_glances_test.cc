// Who gets a picture of the bed to watch, and when one is taken.
#include "daemon/devices/bed_glances.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/asio/executor_work_guard.hpp>
#include <functional>
#include <future>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <thread>

#include "tests/support/hand_timer.h"
#include "tests/support/temp_directory.h"
#include "tests/support/work_here.h"

namespace veneer::daemon {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

class WatchedCamera final : public CameraDriver {
 public:
  Result<std::filesystem::path> capture() override {
    ADD_FAILURE() << "a capture is a look's";
    return file;
  }
  Result<std::filesystem::path> glance(const std::stop_token& stop) override {
    ++glances;
    if (during) during(stop);
    if (heeds_stop && stop.stop_requested()) return Error{ErrorCode::kCancelled, "broken off"};
    if (dead) return Error{ErrorCode::kUnavailable, "the camera does not answer"};
    EXPECT_TRUE(cv::imwrite(file.string(), cv::Mat(30, 40, CV_8UC3, cv::Scalar(glances, 60, 90))));
    return file;
  }
  std::optional<std::chrono::system_clock::time_point> taken_at() const override { return taken; }
  std::string device() const override { return "watched"; }

  std::filesystem::path file;
  std::function<void(const std::stop_token&)> during;
  std::optional<std::chrono::system_clock::time_point> taken;
  bool dead = false, heeds_stop = true;
  int glances = 0;
};

class BedGlancesTest : public ::testing::Test {
 protected:
  using Answer = std::shared_ptr<std::optional<Result<BedGlances::Picture>>>;

  void SetUp() override {
    config_.store.data_dir = folder_ / "data";
    camera_.file = folder_ / "bed.ppm";
    worker_ = std::make_unique<Worker>("camera");
    glances_ = std::make_unique<BedGlances>(BedGlances::Parts{io_, camera_, *worker_, workers_, config_, clock_,
                                                              std::make_unique<testing::HandTimer>(&timer_)},
                                            [this] { return may_; });
  }
  Answer begin(std::stop_token gone = {}) {
    const auto answer = std::make_shared<std::optional<Result<BedGlances::Picture>>>();
    glances_->ask(std::move(gone), [answer](const Result<BedGlances::Picture>& seen) { *answer = seen; });
    return answer;
  }
  // Runs the reactor until it is there.
  Result<BedGlances::Picture> end(const Answer& answer) {
    io_.restart();
    while (!*answer && io_.run_one_for(std::chrono::seconds(30)) > 0) {
    }
    return answer->value_or(Error{ErrorCode::kInternal, "no reply"});
  }
  Result<BedGlances::Picture> ask() { return end(begin()); }

  // A glance that takes a second: the next one begins 7 s after its end.
  void expect_an_eighth_of_eight_seconds() {
    ASSERT_TRUE(ask());
    clock_.advance(std::chrono::milliseconds(6999));
    ASSERT_TRUE(ask());
    EXPECT_EQ(camera_.glances, 1);
    clock_.advance(std::chrono::milliseconds(1));
    ASSERT_TRUE(ask());
    EXPECT_EQ(camera_.glances, 2);
  }

  const testing::TempDirectory folder_;
  boost::asio::io_context io_;
  // The reactor waits for what the worker will post.
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> stays_ = boost::asio::make_work_guard(io_);
  Config config_;
  ManualClock clock_;
  WatchedCamera camera_;
  testing::WorkHere workers_;
  Status may_ = Ok();
  testing::HandTimer* timer_ = nullptr;  // for the camera's silence
  std::unique_ptr<BedGlances> glances_;
  std::unique_ptr<Worker> worker_;  // ends first
};

TEST_F(BedGlancesTest, OnePictureIsForAllWhoWatch) {
  const Answer first = begin(), second = begin();
  const auto one = end(first), other = end(second);
  ASSERT_TRUE(one && other);
  EXPECT_EQ(one->get(), other->get());
  EXPECT_EQ(camera_.glances, 1);
  EXPECT_THAT((*one)->jpeg, StartsWith("\xFF\xD8"));
  EXPECT_EQ(workers_.orders.at(0).readable.at(0), camera_.file) << "a worker reads it";
}

TEST_F(BedGlancesTest, TheNextOneIsTakenTwoSecondsLater) {
  const auto first = ask();
  clock_.advance(std::chrono::milliseconds(1999));
  const auto same = ask();
  ASSERT_TRUE(first && same);
  EXPECT_EQ(first->get(), same->get());
  EXPECT_EQ(glances_->age(**same), std::chrono::milliseconds(1999));
  clock_.advance(std::chrono::milliseconds(1));
  const auto next = ask();
  ASSERT_TRUE(next);
  EXPECT_NE(first->get(), next->get());
  EXPECT_EQ(glances_->age(**next), Duration(0));
  EXPECT_EQ(camera_.glances, 2) << "and none while nobody asks";
}

// What the camera needs is what a look may have to wait for; what the reading needs is the computer's, which cuts.
TEST_F(BedGlancesTest, ASlowComputerIsAskedLessOften) {
  workers_.spoil = [this](const std::string&, const nlohmann::json&) { clock_.advance(std::chrono::seconds(1)); };
  expect_an_eighth_of_eight_seconds();
}

TEST_F(BedGlancesTest, ASlowCameraIsAskedLessOften) {
  camera_.during = [this](const std::stop_token&) { clock_.advance(std::chrono::seconds(1)); };
  expect_an_eighth_of_eight_seconds();
}

TEST_F(BedGlancesTest, ThereIsNoneWhileTheUnitLooksByItself) {
  ASSERT_TRUE(ask());
  may_ = Error{ErrorCode::kConflict, "the cell waits for a panel and looks by itself"};
  EXPECT_FALSE(ask()) << "what the newest one shows may have moved";
  clock_.advance(std::chrono::seconds(2));
  const auto refused = ask();
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kConflict);
  EXPECT_EQ(refused.error().message, "the cell waits for a panel and looks by itself");
  EXPECT_EQ(camera_.glances, 1);
}

TEST_F(BedGlancesTest, ThereIsNoneWhileTheCameraIsAtWork) {
  std::promise<void> begun, go;
  worker_->post([&] {
    begun.set_value();
    go.get_future().wait();
  });
  begun.get_future().wait();
  const auto refused = ask();
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message, "the camera is at work: ask again when it has looked");
  EXPECT_EQ(camera_.glances, 0) << "and none waits in its queue";
  go.set_value();
  worker_->call([] {});  // so that it has done with both promises
}

TEST_F(BedGlancesTest, ALookBreaksItOff) {
  std::promise<void> begun;
  camera_.during = [&](const std::stop_token& stop) {
    std::promise<void> stopped;
    const std::stop_callback told(stop, [&] { stopped.set_value(); });
    begun.set_value();
    stopped.get_future().wait();
  };
  const Answer watching = begin();
  begun.get_future().wait();
  EXPECT_EQ(worker_->call([] { return 7; }), 7) << "it need not wait for the picture";
  const auto seen = end(watching);
  ASSERT_FALSE(seen);
  EXPECT_EQ(seen.error().code, ErrorCode::kConflict);
  EXPECT_THAT(seen.error().message, HasSubstr("needed for more than watching"));
}

// As a run looks, between two pieces: it has to wait for the exposure, if that cannot be broken off, and for nothing
// else.
TEST_F(BedGlancesTest, ALookWaitsForOneExposureAtMost) {
  std::promise<void> begun, exposed;
  camera_.during = [&](const std::stop_token&) {
    if (camera_.glances > 1) return;
    begun.set_value();
    exposed.get_future().wait();
  };
  camera_.heeds_stop = false;
  const Answer watching = begin(), other = begin();
  begun.get_future().wait();
  std::promise<std::size_t> looked;
  worker_->post([&] { looked.set_value(workers_.orders.size()); });
  EXPECT_FALSE(worker_->try_post_giving_way([](const std::stop_token&) {}))
      << "no glance goes before a look that waits";
  exposed.set_value();
  EXPECT_EQ(looked.get_future().get(), 0U) << "nobody reads a picture that nobody gets";
  const auto seen = end(watching);
  ASSERT_FALSE(seen);
  EXPECT_THAT(seen.error().message, HasSubstr("needed for more than watching"));
  EXPECT_FALSE(end(other));
  EXPECT_EQ(camera_.glances, 1);
}

TEST_F(BedGlancesTest, APictureThatSomebodyElseTookIsAsOldAsItIs) {
  camera_.taken = std::chrono::system_clock::now() - std::chrono::hours(3);
  clock_.advance(std::chrono::hours(10));
  const auto seen = ask();
  ASSERT_TRUE(seen);
  EXPECT_GE(glances_->age(**seen), std::chrono::hours(3));
  EXPECT_LT(glances_->age(**seen), std::chrono::hours(4));
}

TEST_F(BedGlancesTest, ADeadCameraIsNotAskedByEachWhoWatches) {
  camera_.dead = true;
  camera_.during = [this](const std::stop_token&) { clock_.advance(std::chrono::milliseconds(100)); };
  EXPECT_EQ(ask().error().message, "the camera does not answer");
  clock_.advance(std::chrono::milliseconds(1899));
  EXPECT_EQ(ask().error().message, "the camera does not answer");
  EXPECT_EQ(camera_.glances, 1);
  camera_.dead = false;
  clock_.advance(std::chrono::milliseconds(1));
  EXPECT_TRUE(ask()) << "as soon as it is well again";
}

TEST_F(BedGlancesTest, AnErrorThatTookLongHasNoMoreOfTheTimeThanAPicture) {
  camera_.dead = true;
  camera_.during = [this](const std::stop_token&) { clock_.advance(std::chrono::seconds(5)); };
  EXPECT_FALSE(ask());
  clock_.advance(std::chrono::milliseconds(34'999));
  EXPECT_FALSE(ask());
  EXPECT_EQ(camera_.glances, 1);
  camera_.dead = false;
  clock_.advance(std::chrono::milliseconds(1));
  EXPECT_TRUE(ask());
}

// A computer that has much to do: the reading meets its deadline each time.
TEST_F(BedGlancesTest, AReadingThatDoesNotEndIsNotBegunAgainAtOnce) {
  bool late = true;
  workers_.fails = [&](const std::string&) -> Status {
    if (!late) return Ok();
    clock_.advance(std::chrono::seconds(10));
    return Error{ErrorCode::kTimeout, "watching the bed took longer than 10 s"};
  };
  EXPECT_EQ(ask().error().code, ErrorCode::kTimeout);
  clock_.advance(std::chrono::milliseconds(69'999));
  EXPECT_EQ(ask().error().code, ErrorCode::kTimeout);
  EXPECT_EQ(camera_.glances, 1);
  late = false;
  clock_.advance(std::chrono::milliseconds(1));
  EXPECT_TRUE(ask());
}

TEST_F(BedGlancesTest, WhatALookBrokeOffHadItsTimeToo) {
  std::promise<void> begun, exposed;
  camera_.during = [&](const std::stop_token&) {
    if (camera_.glances > 1) return;
    clock_.advance(std::chrono::seconds(3));
    begun.set_value();
    exposed.get_future().wait();
  };
  camera_.heeds_stop = false;
  const Answer watching = begin();
  begun.get_future().wait();
  worker_->post([] {});
  exposed.set_value();
  EXPECT_FALSE(end(watching));
  clock_.advance(std::chrono::milliseconds(20'999));
  EXPECT_THAT(ask().error().message, HasSubstr("needed for more than watching")) << "and none is begun";
  EXPECT_EQ(camera_.glances, 1);
}

// Of a camera that was silent for long, and is well again.
TEST_F(BedGlancesTest, TheRestAfterOneHasAnEnd) {
  camera_.during = [this](const std::stop_token&) {
    if (camera_.glances == 1) clock_.advance(std::chrono::hours(1));
  };
  EXPECT_TRUE(ask());
  clock_.advance(std::chrono::milliseconds(104'999));
  EXPECT_TRUE(ask());
  EXPECT_EQ(camera_.glances, 1);
  clock_.advance(std::chrono::milliseconds(1));
  EXPECT_TRUE(ask());
  EXPECT_EQ(camera_.glances, 2);
}

TEST_F(BedGlancesTest, ACameraThatIsSilentLeavesNobodyWaiting) {
  const auto silent = HasSubstr("watched has been asked for a picture and gives none");
  std::promise<void> begun, go;
  camera_.during = [&](const std::stop_token&) {
    if (camera_.glances > 1) return;
    begun.set_value();
    go.get_future().wait();
  };
  const Answer first = begin();
  begun.get_future().wait();
  EXPECT_EQ(timer_->wait, std::chrono::seconds(15));
  EXPECT_FALSE(first->has_value());
  timer_->fire();
  EXPECT_TRUE(first->has_value()) << "who asked first is not left waiting either";
  const auto told = first->value_or(BedGlances::Picture()), later = ask();
  go.set_value();
  ASSERT_FALSE(told || later);
  EXPECT_EQ(told.error().code, ErrorCode::kTimeout);
  EXPECT_THAT(told.error().message, silent);
  EXPECT_THAT(later.error().message, silent) << "and nobody waits any more";
  // Its picture never comes to the reactor, as when memory ran out: the next one is taken all the same.
  Answer next = begin();
  while (next->has_value()) {  // the worker is not back yet
    ASSERT_THAT((*next)->error().message, silent);
    std::this_thread::yield();
    next = begin();
  }
  EXPECT_TRUE(end(next));
  EXPECT_EQ(camera_.glances, 2);
}

TEST_F(BedGlancesTest, WhoHasGoneIsNotTold) {
  std::stop_source gone;
  const Answer left = begin(gone.get_token()), stayed = begin();
  gone.request_stop();
  EXPECT_TRUE(end(stayed));
  EXPECT_FALSE(left->has_value());
}

}  // namespace
}  // namespace veneer::daemon
