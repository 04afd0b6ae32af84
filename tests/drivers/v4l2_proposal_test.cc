// Figures for a camera are what its own automatics came to, and the picture is one that was taken with them.
#include "drivers/v4l2/proposed_settings.h"

#include <gmock/gmock.h>

#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/played_webcam.h"

namespace veneer::v4l2 {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::no_jpeg;
using ::testing::Pair;
using testing::PlayedCamera;

// A bed with a black tag on it. The longer it is exposed the brighter it is, and it is sharp at one focus only. The
// automatics go there step by step, one for each frame.
class V4l2ProposalTest : public ::testing::Test {
 protected:
  V4l2ProposalTest() {
    clock.advance(std::chrono::seconds(100));
    wanted.width = wanted.height = PlayedCamera::kSide, wanted.format = "RGB3";
    wanted.options = {{"focus_absolute", "200"}};  // of an earlier one
    camera.on_next = [this](int) { seek(); };
    camera.scene = [this](int x, int) {
      const std::int64_t blur = std::abs(lens - sharp_at) / 5;
      const std::int64_t slope = 96 / (1 + blur);  // of grey levels a pixel, at the tag's edge
      const std::int64_t level = std::clamp<std::int64_t>(128 + (x - 24) * slope, 80, 176);
      return static_cast<int>(std::min<std::int64_t>(255, level * shutter / 200));
    };
  }
  void seek() {
    const auto go = [this](const std::string& name, std::int64_t to, std::int64_t step, bool tells, std::int64_t& at) {
      at += std::clamp(to - at, -step, step);
      if (tells) camera.control(name).value = at;
    };
    if (camera.control("auto_exposure").value == 3)
      go("exposure_time_absolute", bright_at, 20, tells_exposure, shutter);
    else
      shutter = camera.control("exposure_time_absolute").value;
    if (camera.control("focus_automatic_continuous").value == 1)
      go("focus_absolute", sharp_at, 5, tells_focus, lens);
    else
      lens = camera.control("focus_absolute").value;
    std::int64_t white = camera.control("white_balance_temperature").value;
    if (camera.control("white_balance_automatic").value == 1) go("white_balance_temperature", 3300, 100, true, white);
    if (camera.has_control("gain")) {
      std::int64_t gain = camera.control("gain").value;
      if (camera.control("auto_exposure").value == 3) go("gain", 12, 1, true, gain);
    }
  }
  Result<ProposedSettings> propose(const std::stop_token& stop = {}) {
    return propose_settings(camera, wanted, settle, options, clock, no_jpeg, stop);
  }
  std::vector<LookDoubt> doubts() {
    const auto proposed = propose();
    EXPECT_TRUE(proposed.ok()) << proposed.error().message;
    return proposed.ok() ? proposed->doubts : std::vector<LookDoubt>{};
  }

  ManualClock clock;
  testing::PlayedWebcam camera{clock};
  CameraSettings wanted;
  SettleOptions settle;
  LookOptions options;
  std::int64_t bright_at = 200, sharp_at = 90, shutter = 600, lens = 0;
  bool tells_exposure = true, tells_focus = true;
};

TEST_F(V4l2ProposalTest, FiguresAreWhatTheAutomaticsCameTo) {
  camera.has.push_back({V4L2_CID_GAIN, "gain", CameraControl::Kind::kWhole, 0, 100, 1, 0, 50, true, true, {}});
  const auto proposed = propose();
  ASSERT_TRUE(proposed.ok()) << proposed.error().message;
  EXPECT_THAT(proposed->settings.options,
              ElementsAre(Pair("white_balance_temperature", "3300"), Pair("exposure_time_absolute", "200"),
                          Pair("focus_absolute", "90"), Pair("gain", "12")));
  EXPECT_EQ(proposed->settings.format, "RGB3");
  EXPECT_EQ(proposed->settings.width, PlayedCamera::kSide);
  EXPECT_THAT(proposed->doubts, IsEmpty());
  EXPECT_EQ(camera.starts, 2) << "once seeking, once locked";
  EXPECT_EQ(camera.ends, 2);
}

TEST_F(V4l2ProposalTest, ThePictureIsTakenWithTheFiguresAndNothingSeeksAnyMore) {
  bool locked = false;
  camera.on_start = [&] {
    locked = camera.control("auto_exposure").value == 1 && camera.control("focus_automatic_continuous").value == 0 &&
             camera.control("white_balance_automatic").value == 0 &&
             camera.control("white_balance_temperature").value == 3300 &&
             camera.control("focus_absolute").value == 90 && camera.control("brightness").value == 128;
  };
  const auto proposed = propose();
  ASSERT_TRUE(proposed.ok()) << proposed.error().message;
  EXPECT_TRUE(locked);
  EXPECT_EQ(proposed->look.averaged, 4);
  EXPECT_EQ(proposed->look.picture.width, PlayedCamera::kSide);
}

// What brightness another program left there would be evened out by a wrong exposure.
TEST_F(V4l2ProposalTest, TheAutomaticsSeekWithTheDefaultsOfAllElse) {
  bool first = true, as_it_came = false, seeks = false;
  camera.on_start = [&] {
    if (!std::exchange(first, false)) return;
    as_it_came = camera.control("brightness").value == 128 && camera.control("zoom_absolute").value == 100;
    seeks = camera.control("auto_exposure").value == 3 && camera.control("focus_automatic_continuous").value == 1;
  };
  ASSERT_TRUE(propose().ok());
  EXPECT_TRUE(as_it_came);
  EXPECT_TRUE(seeks);
}

TEST_F(V4l2ProposalTest, AnExposureIsOneByWhichLampsDoNotFlicker) {
  const auto exposure_at = [&](std::int64_t bright) {
    bright_at = bright;
    const auto proposed = propose();
    EXPECT_TRUE(proposed.ok());
    for (const auto& [name, value] : proposed->settings.options)
      if (name == "exposure_time_absolute") return value;
    return std::string();
  };
  EXPECT_EQ(exposure_at(230), "200");
  EXPECT_EQ(exposure_at(270), "300");
  EXPECT_EQ(exposure_at(70), "100");
  EXPECT_EQ(exposure_at(60), "60") << "so much light is hardly a lamp's";
}

TEST_F(V4l2ProposalTest, AFigureIsOneThatTheCameraTakes) {
  sharp_at = 93;
  const auto proposed = propose();
  ASSERT_TRUE(proposed.ok()) << proposed.error().message;
  EXPECT_THAT(proposed->settings.options, Contains(Pair("focus_absolute", "95"))) << "in steps of 5";
}

TEST_F(V4l2ProposalTest, WhatTheCameraDoesNotHaveHasNoFigure) {
  std::erase_if(camera.has, [](const CameraControl& one) { return one.name.starts_with("focus"); });
  camera.on_next = [](int) {};
  const auto proposed = propose();
  ASSERT_TRUE(proposed.ok()) << proposed.error().message;
  EXPECT_THAT(proposed->settings.options,
              ElementsAre(Pair("white_balance_temperature", "4000"), Pair("exposure_time_absolute", "300")));
}

TEST_F(V4l2ProposalTest, ItIsWaitedForUntilNothingChangesAndNotForEver) {
  const TimePoint begun = clock.now();
  ASSERT_THAT(doubts(), IsEmpty());
  EXPECT_LE(clock.now() - begun, std::chrono::seconds(6));
  // A lens that hunts for ever.
  const auto usual = camera.on_next;
  camera.on_next = [&, usual](int number) {
    sharp_at = number % 20 < 10 ? 40 : 140;
    usual(number);
  };
  const TimePoint again = clock.now();
  EXPECT_THAT(doubts(), Contains(LookDoubt::kUnsettled));
  EXPECT_LE(clock.now() - again, settle.most + options.deadline);
}

TEST_F(V4l2ProposalTest, AnAutomaticThatDithersByAStepIsAtRest) {
  camera.has.push_back({V4L2_CID_GAIN, "gain", CameraControl::Kind::kWhole, 0, 100, 1, 0, 12, true, true, {}});
  const auto usual = camera.on_next;
  const auto dither = [&, usual](std::int64_t exposure, std::int64_t gain) {
    camera.on_next = [&, usual, exposure, gain](int number) {
      usual(number);
      if (camera.control("auto_exposure").value != 3) return;
      camera.control("gain").value = 40 + (number % 7 < 3 ? gain : 0);
      camera.control("exposure_time_absolute").value = 200 + (number % 7 < 3 ? exposure : 0);
    };
  };
  dither(4, 1);
  EXPECT_THAT(doubts(), IsEmpty()) << "2 %, or a step where that is more";
  dither(4, 2);
  EXPECT_THAT(doubts(), Contains(LookDoubt::kUnsettled));
  dither(5, 1);
  EXPECT_THAT(doubts(), Contains(LookDoubt::kUnsettled));
}

// Some tell for ever what was set last, not what their automatics came to.
TEST_F(V4l2ProposalTest, APictureThatIsNotTheAutomaticsOwnIsDoubted) {
  tells_exposure = false, camera.control("exposure_time_absolute").usual = 100;
  EXPECT_THAT(doubts(), ElementsAre(LookDoubt::kTooDark));
  camera.control("exposure_time_absolute").usual = 400;
  EXPECT_THAT(doubts(), ElementsAre(LookDoubt::kTooBright));
  tells_exposure = true, tells_focus = false, camera.control("focus_absolute").value = 35;
  EXPECT_THAT(doubts(), ElementsAre(LookDoubt::kBlurred));
}

TEST_F(V4l2ProposalTest, StatedFiguresAreTriedAsTheyAre) {
  wanted.options = {{"exposure_time_absolute", "190"}, {"focus_absolute", "90"}};
  const auto tried = [&] { return try_settings(camera, wanted, options, clock, no_jpeg, {}); };
  auto good = tried();
  ASSERT_TRUE(good.ok()) << good.error().message;
  EXPECT_EQ(good->settings.options, wanted.options);
  EXPECT_THAT(good->doubts, IsEmpty());
  EXPECT_EQ(camera.starts, 1);
  wanted.options.front().second = "50";
  EXPECT_THAT(tried()->doubts, ElementsAre(LookDoubt::kTooDark));
  wanted.options.front().second = "400";
  EXPECT_THAT(tried()->doubts, ElementsAre(LookDoubt::kTooBright));
  wanted.options.front().second = "9999";
  EXPECT_THAT(tried().error().message, HasSubstr("use 3 to 2047"));
}

TEST_F(V4l2ProposalTest, OneThatCannotBeLockedIsRefusedBeforeItIsStarted) {
  camera.has.push_back(
      {V4L2_CID_AUTOGAIN, "gain_automatic", CameraControl::Kind::kYesNo, 0, 1, 1, 1, 1, true, false, {}});
  const auto proposed = propose();
  ASSERT_FALSE(proposed.ok());
  EXPECT_EQ(proposed.error().code, ErrorCode::kRefused);
  EXPECT_THAT(proposed.error().message, AllOf(HasSubstr("gain_automatic"), HasSubstr("use another camera")));
  EXPECT_EQ(camera.starts, 0);
}

TEST_F(V4l2ProposalTest, OneThatGivesNothingIsToldAsItIs) {
  camera.fault = [](int) { return PlayedCamera::Fault::kNoFrame; };
  EXPECT_THAT(propose().error().message, HasSubstr("gave no picture within 10 s"));
  camera.fault = [](int) { return PlayedCamera::Fault::kUnplugged; };
  EXPECT_THAT(propose().error().message, HasSubstr("was unplugged"));
  EXPECT_EQ(camera.starts, camera.ends);
}

TEST_F(V4l2ProposalTest, ItCanBeCancelledWhileItSeeks) {
  std::stop_source stop;
  const auto usual = camera.on_next;
  camera.on_next = [&, usual](int number) {
    usual(number);
    if (number == 5) stop.request_stop();
  };
  const auto proposed = propose(stop.get_token());
  ASSERT_FALSE(proposed.ok());
  EXPECT_EQ(proposed.error().code, ErrorCode::kCancelled);
  EXPECT_EQ(camera.starts, 1) << "it sought to its end";
  EXPECT_EQ(camera.ends, 1);
}

}  // namespace
}  // namespace veneer::v4l2
