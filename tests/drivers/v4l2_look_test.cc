// A look is one picture of now, or an error in words, whatever a camera delivers.
#include "drivers/v4l2/fixed_look.h"

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "drivers/v4l2/frame_average.h"
#include "tests/support/played_camera.h"

namespace veneer::v4l2 {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::PlayedCamera;
using Fault = PlayedCamera::Fault;

// A frame of this test's own compressed format: a byte that must be there, and RGB.
std::optional<RawPicture> unpacked(std::span<const std::uint8_t> bytes, int, int) {
  constexpr std::size_t kPixels = PlayedCamera::kSide * PlayedCamera::kSide * 3;
  if (bytes.size() != kPixels) return std::nullopt;
  return RawPicture{PlayedCamera::kSide, PlayedCamera::kSide, 3, 8, {bytes.begin(), bytes.end()}};
}

RawPicture mean_of(const std::vector<std::vector<std::uint8_t>>& frames) {
  RawPicture out{PlayedCamera::kSide, PlayedCamera::kSide, 3, 8, {}};
  for (std::size_t i = 0; i < frames.front().size(); ++i) {
    double sum = 0;
    for (const auto& frame : frames) sum += frame[i];
    out.samples.push_back(static_cast<std::uint8_t>(std::floor(sum / static_cast<double>(frames.size()) + 0.5)));
  }
  return out;
}

class V4l2LookTest : public ::testing::Test {
 protected:
  V4l2LookTest() { clock.advance(std::chrono::seconds(100)); }
  Result<AveragedPicture> look() {
    return take_look(camera, camera.format, options, clock, unpacked, stop.get_token());
  }
  Error refusal() {
    const auto taken = look();
    EXPECT_FALSE(taken.ok());
    EXPECT_EQ(camera.ends, 1) << "the camera goes on";
    return taken ? Error{} : taken.error();
  }
  void all_frames(Fault fault) {
    camera.fault = [fault](int) { return fault; };
  }
  // Does it show what was there when it was asked for, within the noise of a frame?
  static void expect_shows(const RawPicture& picture, const std::function<int(int, int)>& scene, int noise) {
    int worst = 0;
    for (int y = 0; y < picture.height; ++y)
      for (int x = 0; x < picture.width; ++x)
        for (int c = 0; c < 3; ++c)
          worst = std::max(worst, std::abs(picture.samples[(y * picture.width + x) * 3 + c] - scene(x, y)));
    EXPECT_LE(worst, noise);
  }

  ManualClock clock;
  PlayedCamera camera{clock};
  LookOptions options;
  std::stop_source stop;
};

TEST_F(V4l2LookTest, FramesAreAveragedOnceTheCameraHasSettled) {
  const TimePoint begun = clock.now();
  const auto taken = look();
  ASSERT_TRUE(taken.ok()) << taken.error().message;
  EXPECT_EQ(taken->averaged, 4);
  EXPECT_EQ(taken->refused, 0);
  std::vector<std::vector<std::uint8_t>> used;
  for (std::size_t i = 0; i < camera.good.size(); ++i)
    if (camera.good_at[i] >= begun + options.settling) used.push_back(camera.good[i]);
  ASSERT_EQ(used.size(), 4U) << "more frames were asked for than are needed";
  EXPECT_EQ(taken->picture.samples, mean_of(used).samples);
  EXPECT_EQ(taken->picture.width, PlayedCamera::kSide);
  EXPECT_EQ(camera.starts, 1);
  EXPECT_EQ(camera.ends, 1);
}

// The exposure of the first frames may have begun before the look, however long the camera needs for one.
TEST_F(V4l2LookTest, ASlowCamerasFirstFramesAreThrownAway) {
  camera.interval = std::chrono::milliseconds(180);
  options.settling = Duration(0);
  options.frames = 1;
  const auto taken = look();
  ASSERT_TRUE(taken.ok()) << taken.error().message;
  ASSERT_EQ(camera.good.size(), 3U);
  EXPECT_EQ(taken->picture.samples, camera.good.back());
}

// What comes when the camera has settled may have waited in its driver since before.
TEST_F(V4l2LookTest, FramesThatWereTakenBeforeTheCameraSettledAreThrownAway) {
  const TimePoint settled = clock.now() + options.settling;
  const auto after = camera.scene;
  camera.scene = [&](int x, int y) { return after(x, y) - (clock.now() < settled ? 7 : 0); };  // less than motion
  camera.queue = 3;
  const auto taken = look();
  ASSERT_TRUE(taken.ok()) << taken.error().message;
  EXPECT_EQ(taken->averaged, 4);
  expect_shows(taken->picture, after, camera.noise);
}

TEST_F(V4l2LookTest, OneFrameIsItself) {
  options.frames = 1;
  const auto taken = look();
  ASSERT_TRUE(taken.ok());
  EXPECT_EQ(taken->picture.samples, camera.good.back());
}

class V4l2FaultyFrameTest : public V4l2LookTest, public ::testing::WithParamInterface<Fault> {};

// Whichever of the frames it is, those that are used are the others.
TEST_P(V4l2FaultyFrameTest, IsNeverUsed) {
  for (const int bad : {0, 5, 12, 13, 14, 15}) {  // the last four are those that would be used
    ManualClock own_clock;
    own_clock.advance(std::chrono::seconds(100));
    PlayedCamera own(own_clock);
    own.fault = [&](int number) { return number == bad ? GetParam() : Fault::kNone; };
    const auto taken = take_look(own, own.format, options, own_clock, unpacked, {});
    ASSERT_TRUE(taken.ok()) << taken.error().message;
    EXPECT_EQ(taken->averaged, 4);
    // There is none that the first could repeat, nor a time to have again.
    const bool is_none = bad == 0 && GetParam() == Fault::kRepeated;
    EXPECT_EQ(taken->refused, GetParam() == Fault::kNoFrame || is_none ? 0 : 1) << bad;
    ASSERT_GE(own.good.size(), 4U);
    EXPECT_EQ(taken->picture.samples, mean_of({own.good.end() - 4, own.good.end()}).samples) << bad;
    expect_shows(taken->picture, own.scene, own.noise);
  }
}

// Of nothing else is there ever a picture.
TEST_P(V4l2FaultyFrameTest, EndsTheLookWhenThereIsNothingElse) {
  all_frames(GetParam());
  const Error why = refusal();
  EXPECT_THAT(why.message, HasSubstr("the camera played"));
  EXPECT_THAT(why.message, HasSubstr(": ")) << "no remedy";
  const std::string expected = [] {
    switch (GetParam()) {
      case Fault::kNoFrame:
        return "no picture within 10 s";
      case Fault::kDamaged:
        return "its own driver calls damaged";
      case Fault::kShort:
        return "lack pixels";
      case Fault::kStale:
        return "from before they were asked for";
      case Fault::kRepeated:
        return "the same to the last bit";
      case Fault::kFutureTime:
        return "in the future";
      default:
        return "without a time";
    }
  }();
  EXPECT_THAT(why.message, HasSubstr(expected));
  EXPECT_EQ(why.code, GetParam() == Fault::kNoFrame ? ErrorCode::kUnavailable : ErrorCode::kDeviceFault);
}

INSTANTIATE_TEST_SUITE_P(Kinds, V4l2FaultyFrameTest,
                         ::testing::Values(Fault::kNoFrame, Fault::kDamaged, Fault::kShort, Fault::kStale,
                                           Fault::kRepeated, Fault::kFutureTime, Fault::kNoTime));

TEST_F(V4l2LookTest, ATimeThatDoesNotGoOnIsRefused) {
  camera.fault = [](int number) { return number == 0 ? Fault::kNone : Fault::kOldTime; };
  EXPECT_THAT(refusal().message, HasSubstr("whose time does not go on"));
}

// An old picture that was refused for its time comes again with a new one.
TEST_F(V4l2LookTest, AStaleFrameDoesNotBecomeFreshByANewTime) {
  camera.fault = [](int number) { return number == 0 ? Fault::kStale : number < 20 ? Fault::kRepeated : Fault::kNone; };
  const auto taken = look();
  ASSERT_TRUE(taken.ok()) << taken.error().message;
  EXPECT_EQ(taken->refused, 20);
  expect_shows(taken->picture, camera.scene, camera.noise);
}

// A driver that gives its few buffers round and round.
TEST_F(V4l2LookTest, FramesThatComeAgainLaterAreRefused) {
  camera.noise = 0;
  int number = 0;
  camera.on_next = [&](int now) { number = now; };
  camera.scene = [&](int x, int) { return 100 + x + number % 3; };
  EXPECT_THAT(refusal().message, HasSubstr("the same to the last bit"));
}

TEST_F(V4l2LookTest, ACameraThatIsUnpluggedEndsTheLook) {
  for (const int last : {0, 3, 15}) {
    ManualClock own_clock;
    PlayedCamera own(own_clock);
    own.fault = [&](int number) { return number >= last ? Fault::kUnplugged : Fault::kNone; };
    const auto taken = take_look(own, own.format, options, own_clock, unpacked, {});
    ASSERT_FALSE(taken.ok());
    EXPECT_EQ(taken.error().code, ErrorCode::kUnavailable);
    EXPECT_THAT(taken.error().message, HasSubstr("unplugged"));
    EXPECT_EQ(own.ends, 1);
  }
}

TEST_F(V4l2LookTest, ACameraThatDoesNotBeginHasNoPicture) {
  camera.start_refusal = Error{ErrorCode::kUnavailable, "the camera played is used by another program"};
  EXPECT_THAT(refusal().message, HasSubstr("another program"));
  EXPECT_TRUE(camera.good.empty());
}

TEST_F(V4l2LookTest, ACameraThatFallsSilentIsGivenUpInTime) {
  camera.fault = [](int number) { return number >= 14 ? Fault::kNoFrame : Fault::kNone; };
  const TimePoint begun = clock.now();
  const Error why = refusal();
  EXPECT_EQ(why.code, ErrorCode::kUnavailable);
  EXPECT_THAT(why.message, HasSubstr("too slow"));
  EXPECT_EQ(clock.now() - begun, options.deadline);
}

TEST_F(V4l2LookTest, ALookIsCancelledBetweenFrames) {
  camera.on_next = [this](int number) {
    if (number == 14) stop.request_stop();
  };
  EXPECT_EQ(refusal().code, ErrorCode::kCancelled);
  EXPECT_LE(camera.good.size(), 15U);
}

// The clock of frames stands still while the computer is suspended, so that one from before seems to be of now.
TEST_F(V4l2LookTest, AComputerThatWasSuspendedHasNoPicture) {
  Duration suspended = std::chrono::hours(3);
  options.time_suspended = [&] { return suspended; };
  EXPECT_TRUE(look().ok()) << "it was long ago";
  camera.ends = 0;
  for (const int when : {0, 14, 15}) {
    ManualClock own_clock;
    own_clock.advance(std::chrono::seconds(100));
    PlayedCamera own(own_clock);
    own.on_next = [&](int number) {
      if (number == when) suspended += std::chrono::seconds(1);
    };
    const auto taken = take_look(own, own.format, options, own_clock, unpacked, {});
    ASSERT_FALSE(taken.ok()) << when;
    EXPECT_EQ(taken.error().code, ErrorCode::kUnavailable);
    EXPECT_THAT(taken.error().message, AllOf(HasSubstr("was suspended"), HasSubstr("look again")));
  }
  camera.on_next = [&](int) { suspended += std::chrono::milliseconds(1); };
  EXPECT_TRUE(look().ok()) << "two clocks are never read at once";
}

TEST(V4l2Look, TheKernelTellsHowLongItWasSuspended) {
  const Duration first = time_suspended(), second = time_suspended();
  EXPECT_GE(first, -std::chrono::milliseconds(1));
  EXPECT_LT(second - first, std::chrono::seconds(60));
}

// ---- what moves -----------------------------------------------------------------------------------------------------

TEST_F(V4l2LookTest, WhatMovedOnceIsShownAsItIsNow) {
  int number = 0;
  camera.on_next = [&](int now) { number = now; };
  const auto after = [](int x, int y) { return x > 20 ? 200 : 60 + y; };
  const auto first = camera.scene;
  camera.scene = [&](int x, int y) { return number < 15 ? first(x, y) : after(x, y); };  // in the midst of the average
  const auto taken = look();
  ASSERT_TRUE(taken.ok()) << taken.error().message;
  EXPECT_EQ(taken->averaged, 4);
  expect_shows(taken->picture, after, camera.noise);
}

TEST_F(V4l2LookTest, WhatDoesNotKeepStillHasNoPicture) {
  int number = 0;
  camera.on_next = [&](int now) { number = now; };
  camera.scene = [&](int x, int) { return (x + number) % 32 < 16 ? 40 : 200; };
  const Error why = refusal();
  EXPECT_EQ(why.code, ErrorCode::kRefused);
  EXPECT_THAT(why.message, HasSubstr("something moves in its sight or the light flickers"));
}

TEST_F(V4l2LookTest, LightThatFadesSlowlyIsSeenAgainstTheFirstFrame) {
  int number = 0;
  camera.on_next = [&](int now) { number = now; };
  camera.scene = [&](int, int) { return 50 + 3 * number; };  // 3 levels a frame, 9 over four
  EXPECT_EQ(refusal().code, ErrorCode::kRefused);
}

// A square's mean, against a sensor that is worse than any that reads tags.
TEST(V4l2Average, NoiseAloneIsNeverMotion) {
  std::normal_distribution<double> scatter(0, 15);
  double worst = 0;
  for (unsigned seed = 0; seed < 5; ++seed) {
    std::mt19937 random(seed);
    const auto shot = [&] {
      RawPicture out{640, 480, 3, 8, {}};
      for (int i = 0; i < 640 * 480; ++i) {
        const auto level = static_cast<std::uint8_t>(std::clamp(std::lround(120 + scatter(random)), 0L, 255L));
        out.samples.insert(out.samples.end(), 3, level);  // all colours alike: the worst
      }
      return out;
    };
    worst = std::max(worst, SquareMeans(shot()).most_change(SquareMeans(shot())));
  }
  EXPECT_LT(worst, LookOptions{}.most_change - 1);
}

TEST(V4l2Average, AnEdgeThatMovedByAPixelIsMotion) {
  const auto edge_at = [](int place) {
    RawPicture out{64, 64, 3, 8, {}};
    for (int y = 0; y < 64; ++y)
      for (int x = 0; x < 64; ++x) out.samples.insert(out.samples.end(), 3, x < place ? 20 : 170);
    return SquareMeans(out);
  };
  EXPECT_GT(edge_at(24).most_change(edge_at(25)), LookOptions{}.most_change);
  EXPECT_DOUBLE_EQ(edge_at(24).most_change(edge_at(24)), 0);
}

RC_GTEST_PROP(V4l2Average, IsTheRoundedMeanOfEachSample, ()) {
  const int count = *rc::gen::inRange(1, 65), width = *rc::gen::inRange(1, 9), height = *rc::gen::inRange(1, 9);
  FrameAverage average;
  std::vector<double> sums(static_cast<std::size_t>(width) * height * 3, 0);
  for (int i = 0; i < count; ++i) {
    RawPicture frame{width, height, 3, 8, {}};
    for (double& sum : sums) {
      frame.samples.push_back(*rc::gen::arbitrary<std::uint8_t>());
      sum += frame.samples.back();
    }
    average.add(frame);
  }
  const RawPicture mean = average.mean();
  RC_ASSERT(mean.width == width && mean.height == height);
  for (std::size_t i = 0; i < sums.size(); ++i)
    RC_ASSERT(mean.samples[i] == static_cast<std::uint8_t>(std::floor(sums[i] / count + 0.5)));
}

// ---- campaign -------------------------------------------------------------------------------------------------------

// Any fault, from any frame on, for any number of frames, some of them through each other: never a picture of anything
// but what is there now.
TEST(V4l2Campaign, NoFaultyFrameEverShows) {
  constexpr std::array kKinds{Fault::kNoFrame,   Fault::kDamaged,     Fault::kShort,      Fault::kStale,
                              Fault::kRepeated,  Fault::kOldTime,     Fault::kFutureTime, Fault::kNoTime,
                              Fault::kUnplugged, Fault::kCannotBeRead};
  int pictures = 0, refusals = 0;
  for (const Fault kind : kKinds)
    for (unsigned seed = 0; seed < 50; ++seed) {
      std::mt19937 random(seed);
      const auto drawn = [&](int least, int most) { return std::uniform_int_distribution<int>(least, most)(random); };
      ManualClock clock;
      clock.advance(std::chrono::seconds(100));
      PlayedCamera camera(clock);
      camera.noise = drawn(1, 6);
      camera.interval = std::chrono::milliseconds(drawn(10, 190));
      const int from = drawn(0, 20), frames = drawn(1, 60), every = drawn(1, 3);
      camera.fault = [&](int number) {
        return number >= from && number < from + frames && number % every == 0 ? kind : Fault::kNone;
      };
      const auto taken = take_look(camera, camera.format, {}, clock, unpacked, {});
      EXPECT_EQ(camera.ends, 1);
      if (!taken) {
        ++refusals;
        EXPECT_THAT(taken.error().message, HasSubstr("the camera played"));
        continue;
      }
      ++pictures;
      EXPECT_EQ(taken->averaged, 4);
      for (int y = 0; y < PlayedCamera::kSide; ++y)
        for (int x = 0; x < PlayedCamera::kSide; ++x)
          for (int c = 0; c < 3; ++c)
            ASSERT_LE(std::abs(taken->picture.samples[(y * PlayedCamera::kSide + x) * 3 + c] - camera.scene(x, y)),
                      camera.noise)
                << "kind " << static_cast<int>(kind) << ", seed " << seed;
    }
  EXPECT_GT(pictures, 200) << "hardly anything is ever seen";
  EXPECT_GT(refusals, 50) << "hardly anything is ever refused";
}

}  // namespace
}  // namespace veneer::v4l2
