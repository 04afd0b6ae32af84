// A camera is locked, read back and asked for what is configured, or refused in words.
#include "drivers/v4l2/camera_order.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <chrono>
#include <map>
#include <string>
#include <vector>

#include "base/files.h"
#include "tests/support/played_webcam.h"
#include "tests/support/temp_directory.h"

namespace veneer::v4l2 {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::no_jpeg;
using ::testing::Not;
using testing::PlayedCamera;
using Kind = CameraControl::Kind;

class V4l2OrderTest : public ::testing::Test {
 protected:
  V4l2OrderTest() {
    clock.advance(std::chrono::seconds(100));
    settings.width = settings.height = PlayedCamera::kSide, settings.format = "RGB3";
    settings.options = {{"focus_absolute", "40"}};
    whole = camera.has;
  }
  CameraControl& control(const std::string& name) { return camera.control(name); }
  std::int64_t now(const std::string& name) { return control(name).value; }
  Result<TakenPicture> take() {
    return take_picture(camera, settings, folder / "picture.ppm", options, clock, no_jpeg, {});
  }
  std::string refusal(ErrorCode code) {
    const auto taken = take();
    EXPECT_FALSE(taken.ok());
    if (taken.ok()) return "";
    EXPECT_EQ(taken.error().code, code) << taken.error().message;
    EXPECT_FALSE(std::filesystem::exists(folder / "picture.ppm"));
    return taken.error().message;
  }

  testing::TempDirectory folder;
  ManualClock clock;
  testing::PlayedWebcam camera{clock};
  CameraSettings settings;
  LookOptions options;
  std::vector<CameraControl> whole;  // all that the camera has at first
};

TEST_F(V4l2OrderTest, ALookIsWrittenAsOnePicture) {
  const auto taken = take();
  ASSERT_TRUE(taken.ok()) << taken.error().message;
  EXPECT_EQ(taken->card, "Played Camera");
  EXPECT_EQ(taken->format, "RGB3");
  EXPECT_EQ(taken->averaged, 4);
  const std::string file = read_whole(folder / "picture.ppm").value_or("");
  EXPECT_EQ(file.substr(0, 13), "P6\n48 48\n255\n");
  EXPECT_EQ(file.size(), 13U + 48 * 48 * 3);
}

// By that a camera is known which was stuck between two looks (daemon/devices/bed_pictures.h).
TEST_F(V4l2OrderTest, TheSamePixelsMakeTheSameFile) {
  ASSERT_TRUE(take().ok());  // after which no motor moves
  PlayedCamera first(clock), again(clock);
  first.has = again.has = camera.has;
  ASSERT_TRUE(take_picture(first, settings, folder / "picture.ppm", options, clock, no_jpeg, {}).ok());
  ASSERT_TRUE(take_picture(again, settings, folder / "again.ppm", options, clock, no_jpeg, {}).ok());
  EXPECT_EQ(read_whole(folder / "picture.ppm"), read_whole(folder / "again.ppm"));
}

TEST_F(V4l2OrderTest, NothingChangesByItselfAndAllThatIsNotStatedIsAsTheDeviceCame) {
  settings.options = {{"exposure_time_absolute", "100"}, {"focus_absolute", "40"}};
  bool locked_at_start = false;
  camera.on_start = [&] { locked_at_start = now("auto_exposure") == 1 && now("exposure_time_absolute") == 100; };
  ASSERT_TRUE(take().ok());
  EXPECT_TRUE(locked_at_start);
  const std::map<std::string, std::int64_t> expected{{"auto_exposure", 1},
                                                     {"exposure_time_absolute", 100},
                                                     {"focus_automatic_continuous", 0},
                                                     {"focus_absolute", 40},
                                                     {"brightness", 128},
                                                     {"white_balance_automatic", 0},
                                                     {"white_balance_temperature", 4000},
                                                     {"zoom_absolute", 100}};
  for (const auto& [name, value] : expected) EXPECT_EQ(now(name), value) << name;
}

TEST_F(V4l2OrderTest, WhatIsSetAlreadyIsNotSetAgain) {
  ASSERT_TRUE(take().ok());
  camera.sets.clear();
  ASSERT_TRUE(take().ok());
  EXPECT_THAT(camera.sets, IsEmpty());
}

TEST_F(V4l2OrderTest, TheFocusOfAMotorMustBeStated) {
  settings.options.clear();
  EXPECT_THAT(refusal(ErrorCode::kInvalidArgument),
              AllOf(HasSubstr("set focus_absolute = 35"), HasSubstr("0 to 250 in steps of 5")));
  EXPECT_THAT(camera.sets, IsEmpty());
  std::erase_if(camera.has, [](const CameraControl& one) { return one.name.starts_with("focus"); });
  EXPECT_TRUE(take().ok()) << "one whose focus is fixed has none to state";
}

TEST_F(V4l2OrderTest, AnAutomaticCannotBeSwitchedOn) {
  settings.options.emplace_back("auto_exposure", "3");
  EXPECT_THAT(refusal(ErrorCode::kInvalidArgument),
              HasSubstr("auto_exposure = 3 lets the camera played change by itself"));
  settings.options.back() = {"auto_exposure", "1"};
  EXPECT_TRUE(take().ok()) << "that it is off may be said";
}

// Newer kernels refuse to set what does not count.
TEST_F(V4l2OrderTest, AnAutomaticThatDoesNotCountIsLeftAlone) {
  camera.has.push_back({V4L2_CID_HUE_AUTO, "hue_auto", Kind::kYesNo, 0, 1, 1, 1, 1, false, true, {}});
  const auto taken = take();
  EXPECT_TRUE(taken.ok()) << taken.error().message;
  EXPECT_EQ(now("hue_auto"), 1);
}

TEST_F(V4l2OrderTest, ACameraWithoutAnExposureOfItsOwnIsRefused) {
  control("auto_exposure").choices = {{0, "Auto Mode"}, {3, "Aperture Priority Mode"}};
  EXPECT_THAT(refusal(ErrorCode::kRefused), HasSubstr("always sets its exposure itself"));
}

// One that a program cannot switch off, but that works.
TEST_F(V4l2OrderTest, AnAutomaticThatCannotBeSwitchedOffIsRefused) {
  camera.has.push_back({V4L2_CID_AUTOGAIN, "gain_automatic", Kind::kYesNo, 0, 1, 1, 1, 1, true, false, {}});
  EXPECT_THAT(refusal(ErrorCode::kRefused),
              AllOf(HasSubstr("gain_automatic"), HasSubstr("cannot be switched off"), HasSubstr("another camera")));
  EXPECT_EQ(camera.starts, 0);
  control("gain_automatic").value = 0;
  EXPECT_TRUE(take().ok()) << "it is off for ever";
  std::filesystem::remove(folder / "picture.ppm");
  control("auto_exposure").settable = false, control("auto_exposure").value = 3;
  EXPECT_THAT(refusal(ErrorCode::kRefused), HasSubstr("auto_exposure"));
}

// One setting takes another one away, or brings it.
TEST_F(V4l2OrderTest, ASettingThatAnotherOneTakesAwayIsRefusedInWords) {
  const auto follow = camera.on_set;
  const auto lost = [&](const std::string& cause, const std::string& name) {
    camera.has = whole, camera.starts = 0;
    camera.on_set = [&, follow, cause, name](const std::string& set) {
      if (set == cause) std::erase_if(camera.has, [&](const CameraControl& one) { return one.name == name; });
      follow(set);
    };
    return refusal(ErrorCode::kRefused);
  };
  EXPECT_THAT(lost("white_balance_automatic", "zoom_absolute"), HasSubstr("has no zoom_absolute any more"));
  EXPECT_THAT(lost("white_balance_automatic", "focus_absolute"), HasSubstr("has no focus_absolute any more"));
  EXPECT_THAT(lost("auto_exposure", "focus_automatic_continuous"),
              HasSubstr("has no focus_automatic_continuous any more"));
}

TEST_F(V4l2OrderTest, ADefaultThatCountsOnlyAfterAnotherOneIsSetToo) {
  camera.has.insert(camera.has.begin(), {V4L2_CID_GAIN, "gain", Kind::kWhole, 0, 100, 1, 10, 55, false, true, {}});
  const auto follow = camera.on_set;
  camera.on_set = [&, follow](const std::string& set) {
    follow(set);
    if (set == "zoom_absolute") control("gain").active = true;
  };
  ASSERT_TRUE(take().ok());
  EXPECT_EQ(now("gain"), 10);
}

TEST_F(V4l2OrderTest, ACameraWithoutAutomaticsIsSetToItsDefaultsToo) {
  camera.has = {control("brightness")};
  camera.on_set = nullptr;
  settings.options.clear();
  ASSERT_TRUE(take().ok());
  EXPECT_EQ(now("brightness"), 128);
}

TEST_F(V4l2OrderTest, ADefaultThatNoLongerCountsIsLeftAlone) {
  camera.has.push_back({V4L2_CID_ROTATE, "rotate", Kind::kWhole, 0, 270, 90, 0, 90, true, true, {}});
  const auto follow = camera.on_set;
  camera.on_set = [&, follow](const std::string& set) {
    follow(set);
    if (set == "zoom_absolute") control("rotate").active = false;
  };
  const auto taken = take();
  EXPECT_TRUE(taken.ok()) << taken.error().message;
}

// A motor needs longer than electronics.
TEST_F(V4l2OrderTest, ALensThatIsStillMovingIsWaitedFor) {
  options.settling_frames = 0;
  const auto waited = [&] {
    const TimePoint begun = clock.now();
    camera.good_at.clear();
    EXPECT_TRUE(take().ok());
    return clock.now() - begun;
  };
  const Duration moved = waited();
  EXPECT_GE(moved, std::chrono::seconds(2));
  EXPECT_LT(moved, std::chrono::seconds(3));
  EXPECT_LT(waited(), std::chrono::seconds(1)) << "it stands where it should already";
  control("brightness").value = 3;
  EXPECT_LT(waited(), std::chrono::seconds(1)) << "nothing moves";
  for (const std::string motor : {"focus_absolute", "zoom_absolute", "focus_automatic_continuous"}) {
    control(motor).value = motor == "zoom_absolute" ? 101 : motor == "focus_absolute" ? 45 : 1;
    EXPECT_GE(waited(), std::chrono::seconds(2)) << motor;
  }
}

TEST_F(V4l2OrderTest, LinesThatAreShorterThanTheirPixelsAreRefused) {
  camera.keeps_format = true;
  for (const int line : {0, PlayedCamera::kSide * 3 - 1, -2}) {
    camera.format.bytes_per_line = line;
    EXPECT_THAT(refusal(ErrorCode::kRefused),
                AllOf(HasSubstr("lines of " + std::to_string(line) + " bytes"), HasSubstr("another format")));
  }
  EXPECT_EQ(camera.starts, 0);
}

TEST_F(V4l2OrderTest, WhatCannotBeSetIsRefusedWithWhatCan) {
  const auto said = [&](const std::string& name, const std::string& value) {
    settings.options = {{"focus_absolute", "40"}, {name, value}};
    return refusal(ErrorCode::kInvalidArgument);
  };
  EXPECT_THAT(said("exposure", "3"), AllOf(HasSubstr("has no setting exposure"), HasSubstr("exposure_time_absolute"),
                                           Not(HasSubstr("privacy"))));
  EXPECT_THAT(said("brightness", "256"), HasSubstr("use 0 to 255"));
  EXPECT_THAT(said("brightness", "bright"), HasSubstr("use 0 to 255"));
  EXPECT_THAT(said("zoom_absolute", "100.5"), HasSubstr("use 100 to 500"));
  EXPECT_THAT(said("white_balance_temperature", "4001"), HasSubstr("in steps of 10"));
  EXPECT_THAT(said("auto_exposure", "2"), HasSubstr("use 1 (Manual Mode), 3 (Aperture Priority Mode)"));
  EXPECT_THAT(said("privacy", "true"), HasSubstr("cannot be set by a program"));
}

TEST_F(V4l2OrderTest, AValueThatTheDeviceDoesNotTakeIsRefused) {
  camera.takes = [](const std::string& name, std::int64_t value) {
    return name == "focus_absolute" ? value + 5 : value;
  };
  EXPECT_THAT(refusal(ErrorCode::kRefused), HasSubstr("has focus_absolute = 45 where 40 was set"));
  EXPECT_EQ(camera.starts, 0);
}

// One setting may undo another, and the last word counts.
TEST_F(V4l2OrderTest, ASettingThatAnotherOneUndoesIsRefused) {
  const auto follow = camera.on_set;
  camera.on_set = [&, follow](const std::string& name) {
    follow(name);
    if (name == "zoom_absolute") control("focus_absolute").value = 0;
  };
  EXPECT_THAT(refusal(ErrorCode::kRefused), HasSubstr("has focus_absolute = 0 where 40 was set"));
}

TEST_F(V4l2OrderTest, ALockThatIsLostWhileTheCameraLooksIsSeen) {
  camera.on_next = [this](int number) {
    if (number == 14) control("auto_exposure").value = 3;
  };
  EXPECT_THAT(refusal(ErrorCode::kRefused), HasSubstr("has auto_exposure = 3 where 1 was set"));
}

TEST_F(V4l2OrderTest, ASizeOrFormatThatTheDeviceDoesNotHaveIsRefusedWithThoseThatItHas) {
  camera.offered = {{"YUYV", 640, 480, 640, 480}, {"MJPG", 1920, 1080, 1920, 1080}, {"H264", 3840, 2160, 3840, 2160}};
  settings.width = 800, settings.height = 600;
  EXPECT_THAT(refusal(ErrorCode::kInvalidArgument),
              AllOf(HasSubstr("640 x 480"), HasSubstr("1920 x 1080"), Not(HasSubstr("3840"))));
  settings.width = 640, settings.height = 480, settings.format = "MJPG";
  EXPECT_THAT(refusal(ErrorCode::kInvalidArgument), AllOf(HasSubstr("no format MJPG"), HasSubstr("one of YUYV")));
  camera.offered = {{"H264", 640, 480, 640, 480}};
  EXPECT_THAT(refusal(ErrorCode::kRefused), HasSubstr("no pictures that can be read here"));
}

TEST_F(V4l2OrderTest, TheFormatIsTheOneThatIsStated) {
  camera.offered = {{"MJPG", 48, 48, 48, 48}, {"RGB3", 16, 16, 64, 64, 16, 16}};
  const auto taken = take();
  ASSERT_TRUE(taken.ok()) << taken.error().message;
  EXPECT_EQ(taken->format, "RGB3");
  std::filesystem::remove(folder / "picture.ppm");
  settings.format = "MJPG";
  EXPECT_THAT(refusal(ErrorCode::kDeviceFault), HasSubstr("broken off")) << "by a decoder that has none";
  settings.format = "";
  EXPECT_THAT(refusal(ErrorCode::kInvalidArgument), HasSubstr("one of MJPG, RGB3")) << "none is chosen for anybody";
}

TEST_F(V4l2OrderTest, TheBestIsTheLargestSizeThatFitsInTheFormatThatLosesLeast) {
  const auto best = [&](const CameraSettings& wanted) {
    const auto out = best_settings(camera, wanted);
    return out.ok() ? fmt::format("{} x {} {}", out->width, out->height, out->format) : out.error().message;
  };
  const auto only = [](const char* code, int width, int height) {
    return OfferedFormat{code, width, height, width, height};
  };
  camera.offered = {only("H264", 1920, 1080), only("YUYV", 640, 480),   only("MJPG", 1920, 1080),
                    only("YUYV", 1920, 1080), only("MJPG", 3840, 2160), only("YUYV", 320, 240)};
  EXPECT_EQ(best({}), "1920 x 1080 YUYV");
  EXPECT_EQ(best({0, 0, "MJPG", {}}), "1920 x 1080 MJPG");
  EXPECT_EQ(best({640, 480, "", {}}), "640 x 480 YUYV");
  EXPECT_EQ(best({3840, 2160, "", {}}), "3840 x 2160 MJPG");
  EXPECT_EQ(best({800, 600, "YUYV", {}}), "800 x 600 YUYV") << "it does not have it, which is told later";
  camera.offered.erase(camera.offered.begin() + 3);
  EXPECT_EQ(best({}), "1920 x 1080 MJPG") << "size before format";
  camera.offered = {only("MJPG", 3840, 2160), only("MJPG", 2592, 1944)};
  EXPECT_EQ(best({}), "2592 x 1944 MJPG") << "the smallest where none is small";
  camera.offered = {{"RGB3", 32, 32, 4096, 4096, 8, 8}};
  EXPECT_EQ(best({}), "1920 x 1080 RGB3");
  camera.offered = {{"RGB3", 32, 32, 640, 480, 8, 8}};
  EXPECT_EQ(best({}), "640 x 480 RGB3");
}

TEST_F(V4l2OrderTest, ASizeOrFormatThatTheDeviceChangesIsRefused) {
  camera.offered = {{"RGB3", 16, 16, 640, 480, 8, 8}};
  camera.keeps_format = true;
  settings.width = 640, settings.height = 480;
  const auto made = [&](const std::string& code, int width, int height) {
    camera.format = {code, width, height, width * 3};
    return refusal(ErrorCode::kRefused);
  };
  EXPECT_THAT(made("RGB3", 632, 480), HasSubstr("makes 632 x 480 pixels, RGB3, of 640 x 480, RGB3"));
  EXPECT_THAT(made("RGB3", 640, 472), HasSubstr("makes 640 x 472 pixels, RGB3, of 640 x 480, RGB3"));
  EXPECT_THAT(made("YUYV", 640, 480), HasSubstr("makes 640 x 480 pixels, YUYV, of 640 x 480, RGB3"));
  EXPECT_EQ(camera.starts, 0);
}

TEST_F(V4l2OrderTest, ACameraIsDescribedWithWhatItTakes) {
  const DescribedCamera told = describe_camera(camera);
  EXPECT_EQ(told.device, "played");
  EXPECT_EQ(told.card, "Played Camera");
  EXPECT_EQ(told.formats.size(), 1U);
  EXPECT_EQ(told.controls.size(), camera.has.size());
  EXPECT_EQ(told.problem, "");
}

TEST(V4l2Controls, AreNamedAsOtherProgramsNameThem) {
  EXPECT_EQ(control_name("Exposure Time, Absolute"), "exposure_time_absolute");
  EXPECT_EQ(control_name("White Balance, Automatic"), "white_balance_automatic");
  EXPECT_EQ(control_name("Focus (absolute)"), "focus_absolute");
  EXPECT_EQ(control_name("Pan/Tilt"), "pan_tilt");
}

}  // namespace
}  // namespace veneer::v4l2
