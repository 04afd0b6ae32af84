// The kernel's interface as it is used, against a camera that umockdev plays.
#include "drivers/v4l2/video_device.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <random>
#include <string>

#include "drivers/v4l2/fixed_look.h"
#include "tests/support/camera_file.h"

namespace veneer::v4l2 {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::Pair;
using tests::CameraFile;

std::optional<RawPicture> no_jpeg(std::span<const std::uint8_t>, int, int) { return std::nullopt; }

// Grey that scatters a little, as YUYV.
CameraFile::FramePlan grey_frame(int number, std::uint8_t level = 126) {
  std::mt19937 random(static_cast<unsigned>(number));
  CameraFile::FramePlan out;
  for (int i = 0; i < 64 * 32; ++i) {
    out.bytes.push_back(static_cast<std::uint8_t>(level + random() % 3));
    out.bytes.push_back(128);
  }
  return out;
}

class V4l2DeviceTest : public ::testing::Test {
 protected:
  V4l2DeviceTest() {
    device.change([](CameraFile::Play& play) { play.frame = [](int number) { return grey_frame(number); }; });
  }
  std::unique_ptr<OpenCamera> opened() {
    auto camera = open_camera(CameraFile::kDevice);
    EXPECT_TRUE(camera.ok()) << camera.error().message;
    return camera ? std::move(*camera) : nullptr;
  }
  // The next frame; none within some seconds is a failure.
  Frame next(OpenCamera& camera) {
    for (int i = 0; i < 1000; ++i) {
      auto frame = camera.next(std::chrono::milliseconds(100));
      EXPECT_TRUE(frame.ok()) << frame.error().message;
      if (!frame.ok()) return {};
      if (*frame) return std::move(**frame);
    }
    ADD_FAILURE() << "no frame comes";
    return {};
  }

  CameraFile device;
};

TEST_F(V4l2DeviceTest, ACameraTellsWhatItIs) {
  const auto camera = opened();
  ASSERT_NE(camera, nullptr);
  EXPECT_EQ(camera->camera(), CameraFile::kDevice);
  EXPECT_EQ(camera->card(), "Played Camera");
  EXPECT_EQ(camera->bus(), "usb-1");
  const auto formats = camera->formats();
  ASSERT_TRUE(formats.ok()) << formats.error().message;
  ASSERT_EQ(formats->size(), 1U);
  EXPECT_EQ(formats->front().code, "YUYV");
  EXPECT_TRUE(formats->front().has(64, 32));
  const auto format = camera->set_format("YUYV", 640, 480);
  ASSERT_TRUE(format.ok());
  EXPECT_EQ(format->width, 64) << "what the device made of it";
  EXPECT_EQ(format->bytes_per_line, 128);
  EXPECT_FALSE(format->full_range);
}

TEST_F(V4l2DeviceTest, ControlsAreToldByNameAndSet) {
  device.add_control(V4L2_CID_EXPOSURE_AUTO, V4L2_CTRL_TYPE_MENU, "Auto Exposure", 0, 3, 3, 3);
  device.add_control(V4L2_CID_BRIGHTNESS, V4L2_CTRL_TYPE_INTEGER, "Brightness", 0, 255, 128, 99);
  device.add_control(V4L2_CID_DO_WHITE_BALANCE, V4L2_CTRL_TYPE_BUTTON, "Do White Balance", 0, 0, 0, 0);
  device.add_control(V4L2_CID_PAN_RELATIVE, V4L2_CTRL_TYPE_INTEGER, "Pan, Relative", -1, 1, 0, 0);
  device.change([](CameraFile::Play& play) {
    play.controls[V4L2_CID_EXPOSURE_AUTO].choices = {"", "Manual Mode", "", "Aperture Priority Mode"};
    play.controls[V4L2_CID_PAN_RELATIVE].about.flags = V4L2_CTRL_FLAG_WRITE_ONLY;
  });
  const auto camera = opened();
  const auto controls = camera->controls();
  ASSERT_TRUE(controls.ok()) << controls.error().message;
  ASSERT_EQ(controls->size(), 2U) << "what is pressed, or cannot be read back, cannot be relied on";
  EXPECT_EQ((*controls)[0].name, "brightness");
  EXPECT_EQ((*controls)[0].value, 99);
  EXPECT_EQ((*controls)[0].usual, 128);
  EXPECT_EQ((*controls)[1].name, "auto_exposure");
  EXPECT_THAT((*controls)[1].choices, ElementsAre(Pair(1, "Manual Mode"), Pair(3, "Aperture Priority Mode")));
  EXPECT_TRUE(camera->set((*controls)[0], 200).ok());
  EXPECT_EQ(device.value_of(V4L2_CID_BRIGHTNESS), 200);
  const Status refused = camera->set((*controls)[0], 300);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, HasSubstr("does not take brightness = 300"));
}

TEST_F(V4l2DeviceTest, MoreFramesComeThanThereAreBuffers) {
  const auto camera = opened();
  ASSERT_TRUE(camera->set_format("YUYV", 64, 32).ok());
  ASSERT_TRUE(camera->start().ok());
  TimePoint before{};
  for (int i = 0; i < 10; ++i) {
    const Frame frame = next(*camera);
    EXPECT_EQ(frame.bytes, grey_frame(i).bytes) << i;
    ASSERT_TRUE(frame.taken.has_value());
    EXPECT_GE(*frame.taken, before);
    EXPECT_LE(*frame.taken, SteadyClock().now()) << "by another clock";
    EXPECT_FALSE(frame.damaged);
    before = *frame.taken;
  }
  camera->end();
  EXPECT_FALSE(device.streams());
}

TEST_F(V4l2DeviceTest, WhatTheDriverSaysOfAFrameIsKept) {
  device.change([](CameraFile::Play& play) {
    play.frame = [](int number) {
      CameraFile::FramePlan out = grey_frame(number);
      if (number == 0) out.flags |= V4L2_BUF_FLAG_ERROR;
      if (number == 1) out.flags = V4L2_BUF_FLAG_TIMESTAMP_COPY;
      if (number == 2) out.bytes.resize(100);
      return out;
    };
  });
  const auto camera = opened();
  ASSERT_TRUE(camera->set_format("YUYV", 64, 32).ok());
  ASSERT_TRUE(camera->start().ok());
  EXPECT_TRUE(next(*camera).damaged);
  EXPECT_FALSE(next(*camera).taken.has_value());
  EXPECT_EQ(next(*camera).bytes.size(), 100U);
}

TEST_F(V4l2DeviceTest, ALookIsTakenThroughTheKernelsInterface) {
  const auto camera = opened();
  const auto format = camera->set_format("YUYV", 64, 32);
  ASSERT_TRUE(format.ok());
  LookOptions options;
  options.settling = Duration(0);
  const auto look = take_look(*camera, *format, options, SteadyClock(), no_jpeg, {});
  ASSERT_TRUE(look.ok()) << look.error().message;
  EXPECT_EQ(look->averaged, 4);
  // 126 to 128 of 16 to 235.
  for (const std::uint8_t sample : look->picture.samples) ASSERT_NEAR(sample, 129, 2);
  EXPECT_FALSE(device.streams()) << "the camera's light stays on";
}

TEST_F(V4l2DeviceTest, OneThatIsUnpluggedSaysSo) {
  const auto camera = opened();
  const auto format = camera->set_format("YUYV", 64, 32);
  device.change([](CameraFile::Play& play) {
    play.frame = [&play](int number) {
      if (number == 1) play.unplugged = true;
      return grey_frame(number);
    };
  });
  const auto look = take_look(*camera, *format, {}, SteadyClock(), no_jpeg, {});
  ASSERT_FALSE(look.ok());
  EXPECT_EQ(look.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(look.error().message, AllOf(HasSubstr(CameraFile::kDevice), HasSubstr("was unplugged")));
}

TEST_F(V4l2DeviceTest, WhatKeepsItFromBeginningIsToldApart) {
  const auto said = [&](unsigned long call, int error) {
    device.change([&](CameraFile::Play& play) { play.fails = {{call, error}}; });
    const auto camera = opened();
    const Status started = camera->start();
    EXPECT_FALSE(started.ok());
    return started.ok() ? "" : started.error().message;
  };
  EXPECT_THAT(said(VIDIOC_REQBUFS, EBUSY), HasSubstr("is used by another program"));
  EXPECT_THAT(said(VIDIOC_STREAMON, ENOSPC), HasSubstr("no room on the USB bus"));
  EXPECT_THAT(said(VIDIOC_STREAMON, EIO), HasSubstr("failed while beginning"));
  EXPECT_THAT(said(VIDIOC_QBUF, ENODEV), HasSubstr("was unplugged"));
}

TEST_F(V4l2DeviceTest, WhatIsNoCameraIsRefused) {
  device.change([](CameraFile::Play& play) { play.capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING; });
  const auto metadata = open_camera(CameraFile::kDevice);
  ASSERT_FALSE(metadata.ok());
  EXPECT_EQ(metadata.error().code, ErrorCode::kRefused);
  EXPECT_THAT(metadata.error().message, HasSubstr("is no camera that gives pictures"));
  const auto missing = open_camera("/dev/v4l/by-id/none");
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(missing.error().message, HasSubstr("is not there"));
}

TEST_F(V4l2DeviceTest, PicturesThatAProgramMakesUpAreNoCameras) {
  for (const std::string driver : {"vivid", "v4l2 loopback", "vimc"}) {
    device.change([&](CameraFile::Play& play) { play.driver = driver; });
    const auto made_up = open_camera(CameraFile::kDevice);
    ASSERT_FALSE(made_up.ok()) << driver;
    EXPECT_EQ(made_up.error().code, ErrorCode::kRefused);
    EXPECT_THAT(made_up.error().message,
                AllOf(HasSubstr("what a program makes up (" + driver + ")"), HasSubstr(": use")));
  }
}

TEST_F(V4l2DeviceTest, WhatItCannotBeOpenedForIsToldApart) {
  const std::string folder = ::testing::TempDir(), loop = folder + "/loop_of_names";
  static_cast<void>(::unlink(loop.c_str()));
  ASSERT_EQ(::symlink(loop.c_str(), loop.c_str()), 0);
  const auto itself = open_camera(loop);
  static_cast<void>(::unlink(loop.c_str()));
  ASSERT_FALSE(itself.ok());
  EXPECT_THAT(itself.error().message, AllOf(HasSubstr("cannot be opened (Too many"), Not(HasSubstr("not there"))));
}

// Whoever may read this, root, may open everything: told by hand.
TEST_F(V4l2DeviceTest, WhoMayUseItIsNamed) {
  const auto told = [](const std::string& group, bool for_group) {
    const Error error = not_opened("/dev/video0", EACCES, group, for_group);
    EXPECT_EQ(error.code, ErrorCode::kUnavailable);
    return error.message;
  };
  EXPECT_THAT(told("cameras", true),
              AllOf(HasSubstr("/dev/video0 may not be used"), HasSubstr("SupplementaryGroups=cameras")));
  EXPECT_THAT(told("", true), HasSubstr("SupplementaryGroups=video"));
  EXPECT_THAT(told("root", false), AllOf(HasSubstr("by root only"), HasSubstr("SUBSYSTEM==\"video4linux\""),
                                         HasSubstr("/etc/udev/rules.d/"), HasSubstr("plug it in again")));
  EXPECT_THAT(not_opened("/dev/video0", EBUSY, "", true).message, HasSubstr("is used by another program"));
}

TEST_F(V4l2DeviceTest, NobodyIsSentIntoRootsGroup) {
  EXPECT_FALSE(is_for_group(0, 0660));
  EXPECT_FALSE(is_for_group(44, 0600));
  EXPECT_FALSE(is_for_group(44, 0640)) << "a camera is set, too";
  EXPECT_TRUE(is_for_group(44, 0660));
}

TEST_F(V4l2DeviceTest, ASizeThatNoPictureHasIsRefused) {
  const auto camera = opened();
  const auto told = [&] {
    const auto format = camera->set_format("YUYV", 64, 32);
    EXPECT_FALSE(format.ok());
    return format.ok() ? Error{} : format.error();
  };
  for (const __u32 much : {1U << 31, ~0U}) {
    device.change([&](CameraFile::Play& play) { play.line = much, play.width = 64; });
    EXPECT_EQ(told().code, ErrorCode::kRefused);
    EXPECT_THAT(told().message, HasSubstr(std::to_string(much) + " bytes"));
    device.change([&](CameraFile::Play& play) { play.line = 128, play.width = much; });
    EXPECT_THAT(told().message, HasSubstr(std::to_string(much) + " x 32"));
  }
}

TEST_F(V4l2DeviceTest, NamesOfFormatsCanBeShown) {
  device.change([](CameraFile::Play& play) { play.code = v4l2_fourcc('\x1b', '[', '\n', '7'); });
  EXPECT_EQ(opened()->formats()->front().code, "?[?7");
  device.change([](CameraFile::Play& play) { play.code = V4L2_PIX_FMT_Y16_BE; });
  EXPECT_EQ(opened()->formats()->front().code, "Y16-BE");
}

}  // namespace
}  // namespace veneer::v4l2

int main(int argc, char** argv) {
  veneer::tests::be_under_umockdev(argc, argv);
  ::testing::InitGoogleMock(&argc, argv);
  return RUN_ALL_TESTS();
}
