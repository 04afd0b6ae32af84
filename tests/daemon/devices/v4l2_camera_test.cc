// Cameras as the cell uses them: the work of worker processes against a camera that umockdev plays, and the process
// itself.
#include "daemon/devices/v4l2_camera.h"

#include <gmock/gmock.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <future>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "daemon/cell.h"
#include "daemon/devices/camera_trial.h"
#include "daemon/orders/capture_work.h"
#include "daemon/wiring.h"
#include "daemon/workers/worker_processes.h"
#include "tests/support/camera_file.h"
#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using tests::CameraFile;

// In this process, since umockdev answers over a socket, and a confined one may not have any.
class CaptureHere final : public WorkRunner {
 public:
  Result<nlohmann::json> run(const WorkOrder& order, const TaskProgress& progress, std::stop_token stop) override {
    orders.push_back(order);
    if (deaths > 0) {
      --deaths;
      return Error{ErrorCode::kUnavailable, order.what + " was broken off, because its process was killed: try again"};
    }
    return do_work_of(find_kind(capture_work(), order.kind), order.kind, order.request, order.folder, progress, stop);
  }
  std::vector<WorkOrder> orders;
  int deaths = 0;  // of processes that are still to be
};

// Wood as a JPEG, a little other in each frame.
std::vector<std::uint8_t> jpeg_of(int number) {
  cv::Mat picture(64, 64, CV_8UC3), noise(64, 64, CV_8UC3);
  for (int x = 0; x < 64; ++x) picture.col(x).setTo(cv::Scalar(60 + x, 100, 180));
  cv::RNG random(static_cast<std::uint64_t>(number) + 1);
  random.fill(noise, cv::RNG::UNIFORM, 0, 4);
  std::vector<std::uint8_t> out;
  cv::imencode(".jpg", picture + noise, out, {cv::IMWRITE_JPEG_QUALITY, 95});
  return out;
}

class V4l2CameraTest : public ::testing::Test {
 protected:
  V4l2CameraTest() {
    device.change([](CameraFile::Play& play) {
      play.code = V4L2_PIX_FMT_MJPEG, play.height = 64;
      play.frame = [](int number) { return CameraFile::FramePlan{jpeg_of(number)}; };
    });
    device.add_control(V4L2_CID_EXPOSURE_AUTO, V4L2_CTRL_TYPE_MENU, "Auto Exposure", 0, 3, 3, 3);
    device.add_control(V4L2_CID_FOCUS_ABSOLUTE, V4L2_CTRL_TYPE_INTEGER, "Focus, Absolute", 0, 250, 0, 17);
    device.change([](CameraFile::Play& play) {
      play.controls[V4L2_CID_EXPOSURE_AUTO].choices = {"", "Manual Mode", "", "Aperture Priority Mode"};
    });
    config.kind = "v4l2";
    config.device = CameraFile::kDevice;
    config.width = 64, config.height = 64, config.format = "MJPG";
    config.options = {{"focus_absolute", "30"}};
  }
  V4l2Camera camera() {
    auto here = std::make_unique<CaptureHere>();
    runner = here.get();
    return {std::move(here), config, data.path()};
  }
  V4l2Camera in_a_process(const fs::path& worker, std::chrono::milliseconds deadline = std::chrono::seconds(60)) {
    return {std::make_unique<WorkerProcesses>(WorkerProcessOptions{worker, 0, [this](pid_t pid) { process = pid; }},
                                              make_null_logger()),
            config, data.path(), deadline};
  }

  CameraFile device;
  CameraConfig config;
  testing::TempDirectory data;
  CaptureHere* runner = nullptr;
  pid_t process = 0;
};

TEST_F(V4l2CameraTest, APictureIsTheMeanOfLockedFrames) {
  V4l2Camera one = camera();
  const auto file = one.capture();
  ASSERT_TRUE(file.ok()) << file.error().message;
  const cv::Mat seen = cv::imread(file->string());
  ASSERT_EQ(seen.size(), cv::Size(64, 64));
  const cv::Mat shown = cv::imdecode(jpeg_of(0), cv::IMREAD_COLOR);
  EXPECT_LE(cv::norm(seen, shown, cv::NORM_INF), 8) << "red and blue are swapped, or it is another picture";
  EXPECT_EQ(device.value_of(V4L2_CID_EXPOSURE_AUTO), V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(device.value_of(V4L2_CID_FOCUS_ABSOLUTE), 30);
  EXPECT_FALSE(device.streams());
  EXPECT_FALSE(one.taken_at().has_value()) << "it was taken when it was asked for";
}

// The run that needs the picture would be Held otherwise, until somebody comes.
TEST_F(V4l2CameraTest, AProcessThatDiesCostsNoPictureUnlessTheNextOneDiesToo) {
  V4l2Camera one = camera();
  runner->deaths = 1;
  const auto file = one.capture();
  ASSERT_TRUE(file.ok()) << file.error().message;
  EXPECT_EQ(runner->orders.size(), 2U);
  EXPECT_FALSE(cv::imread(file->string()).empty());
  runner->deaths = 2;
  EXPECT_FALSE(one.capture().ok());
  EXPECT_EQ(runner->orders.size(), 4U);
}

TEST_F(V4l2CameraTest, ItsProcessMayOpenThisCameraAndNothingElse) {
  V4l2Camera one = camera();
  ASSERT_TRUE(one.capture().ok());
  ASSERT_EQ(runner->orders.size(), 1U);
  const WorkOrder& order = runner->orders.front();
  ASSERT_TRUE(order.devices.has_value());
  EXPECT_THAT(*order.devices, ElementsAre(fs::path(CameraFile::kDevice)));
  EXPECT_FALSE(order.network);
  EXPECT_TRUE(order.readable.empty());
  EXPECT_TRUE(order.writable.empty());
  EXPECT_EQ(order.grace.count(), 0) << "one that hangs is not waited for";
}

TEST_F(V4l2CameraTest, AGlanceIsOneFrameAndLeavesTheLastPictureWhereItIs) {
  V4l2Camera one = camera();
  const auto captured = one.capture();
  ASSERT_TRUE(captured.ok());
  const int before = device.frames_given();
  const auto glanced = one.glance({});
  ASSERT_TRUE(glanced.ok()) << glanced.error().message;
  EXPECT_EQ(runner->orders.back().request.at("frames"), 1);
  EXPECT_GT(device.frames_given(), before);
  EXPECT_TRUE(fs::exists(*captured));
  EXPECT_NE(*captured, *glanced);
  const auto again = one.capture();
  ASSERT_TRUE(again.ok());
  EXPECT_FALSE(fs::exists(*captured)) << "folders pile up";
  EXPECT_TRUE(fs::exists(*glanced));
}

TEST_F(V4l2CameraTest, AJpegThatBreaksOffIsNoPicture) {
  device.change([](CameraFile::Play& play) {
    play.frame = [](int number) {
      auto bytes = jpeg_of(number);
      bytes.resize(bytes.size() * 6 / 10);
      return CameraFile::FramePlan{bytes};
    };
  });
  const auto file = camera().capture();
  ASSERT_FALSE(file.ok());
  EXPECT_EQ(file.error().code, ErrorCode::kDeviceFault);
  EXPECT_THAT(file.error().message, AllOf(HasSubstr("broken off"), HasSubstr("short cable")));
}

TEST_F(V4l2CameraTest, CertificatesHangOnFormatSizeAndWhateverMayMoveTheView) {
  config.options = {{"brightness", "3"},
                    {"exposure_time_absolute", "100"},
                    {"focus_absolute", "30"},
                    {"gain_of_the_maker", "2"},
                    {"horizontal_flip", "1"},
                    {"lens_correction", "false"},
                    {"white_balance_automatic", "0"},
                    {"zoom_absolute", "120"}};
  EXPECT_EQ(camera().device(),
            "v4l2 usb-Played_Camera_4711-video-index0, 64 x 64 MJPG, focus_absolute 30, gain_of_the_maker 2, "
            "horizontal_flip 1, lens_correction false, zoom_absolute 120");
  config.format = "YUYV";
  config.options.clear();
  config.frames = 8;
  EXPECT_EQ(camera().device(), "v4l2 usb-Played_Camera_4711-video-index0, 64 x 64 YUYV");
}

TEST_F(V4l2CameraTest, ACameraThatIsNotThereIsNamedByItsProcess) {
  config.device = "/dev/v4l/by-id/none";
  const auto file = in_a_process(VENEER_WORKER).capture();
  ASSERT_FALSE(file.ok());
  EXPECT_EQ(file.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(file.error().message,
              AllOf(HasSubstr("/dev/v4l/by-id/none is not there"), HasSubstr("veneerctl camera list")));
  EXPECT_TRUE(fs::is_empty(data / "work"));
}

// A driver that never comes back from a call.
TEST_F(V4l2CameraTest, OneThatHangsIsKilledAtItsDeadline) {
  const fs::path worker = data / "veneer-faulty-worker";
  fs::copy_file(VENEER_FAULTY_WORKER, worker);
  std::ofstream(data / "fault") << "hang take_picture 0";
  const auto file = in_a_process(worker, std::chrono::seconds(1)).capture();
  ASSERT_FALSE(file.ok());
  EXPECT_EQ(file.error().code, ErrorCode::kTimeout);
  EXPECT_THAT(file.error().message,
              AllOf(HasSubstr(CameraFile::kDevice), HasSubstr("within 1 s"), HasSubstr("plug it in again")));
  EXPECT_EQ(::kill(process, 0), -1) << "its process goes on";
}

TEST_F(V4l2CameraTest, AGlanceIsCancelledWithItsProcess) {
  const fs::path worker = data / "veneer-faulty-worker";
  fs::copy_file(VENEER_FAULTY_WORKER, worker);
  std::ofstream(data / "fault") << "hang take_picture 0";
  std::stop_source stop;
  auto one = V4l2Camera(std::make_unique<WorkerProcesses>(WorkerProcessOptions{worker, 0,
                                                                               [&](pid_t pid) {
                                                                                 process = pid;
                                                                                 stop.request_stop();
                                                                               }},
                                                          make_null_logger()),
                        config, data.path());
  const auto file = one.glance(stop.get_token());
  ASSERT_FALSE(file.ok());
  EXPECT_EQ(file.error().code, ErrorCode::kCancelled);
  EXPECT_EQ(::kill(process, 0), -1);
}

// Until the program ends nothing else does: systemd would kill the laser's owner after ten seconds.
TEST_F(V4l2CameraTest, ACaptureThatHangsEndsWithTheProgram) {
  const fs::path worker = data / "veneer-faulty-worker";
  fs::copy_file(VENEER_FAULTY_WORKER, worker);
  std::ofstream(data / "fault") << "hang take_picture 0";
  CameraDriver* driver = nullptr;
  auto one = V4l2Camera(std::make_unique<WorkerProcesses>(WorkerProcessOptions{worker, 0,
                                                                               [&](pid_t pid) {
                                                                                 process = pid;
                                                                                 driver->give_up();
                                                                               }},
                                                          make_null_logger()),
                        config, data.path());
  driver = &one;
  const auto file = one.capture();
  ASSERT_FALSE(file.ok());
  EXPECT_EQ(file.error().code, ErrorCode::kCancelled);
  EXPECT_EQ(::kill(process, 0), -1) << "its process goes on";
  process = 0;
  EXPECT_EQ(one.capture().error().code, ErrorCode::kCancelled);
  EXPECT_EQ(one.glance({}).error().code, ErrorCode::kCancelled);
  EXPECT_EQ(process, 0) << "another one is begun";
}

// Hangs until it is given up.
class HangingCamera final : public CameraDriver {
 public:
  explicit HangingCamera(bool& given_up) : given_up_(given_up) {}
  Result<fs::path> capture() override {
    begun.set_value();
    given_up_ = end_.get_future().wait_for(std::chrono::seconds(60)) == std::future_status::ready;
    return Error{ErrorCode::kCancelled, "given up"};
  }
  std::string device() const override { return "hangs"; }
  void give_up() noexcept override { end_.set_value(); }
  std::promise<void> begun;

 private:
  bool& given_up_;
  std::promise<void> end_;
};

TEST_F(V4l2CameraTest, ItIsGivenUpBeforeItsThreadIsWaitedFor) {
  Config whole;
  whole.laser.kind = "lihuiyu", whole.laser.port = "file:" + (data / "wire.bin").string();
  whole.scanner.kind = whole.camera.kind = "file";
  whole.store.data_dir = data / "cell";
  const SteadyClock clock;
  boost::asio::io_context reactor;
  auto devices = make_devices(whole, clock, reactor, make_null_logger());
  ASSERT_TRUE(devices.ok()) << devices.error().message;
  bool given_up = false;
  auto hanging = std::make_unique<HangingCamera>(given_up);
  auto begun = hanging->begun.get_future();
  devices->camera = std::move(hanging);
  auto cell = Cell::open(reactor, whole, std::move(*devices), clock, make_null_logger());
  ASSERT_TRUE(cell.ok()) << cell.error().message;
  (*cell)->camera_worker->post([&] { static_cast<void>((*cell)->devices.camera->capture()); });
  begun.wait();
  cell->reset();
  EXPECT_TRUE(given_up);
}

// Of the kind in the configuration wiring makes the driver.
TEST_F(V4l2CameraTest, IsMadeOfTheConfiguration) {
  Config whole;
  whole.camera = config;
  whole.store.data_dir = data.path();
  const SteadyClock clock;
  boost::asio::io_context reactor;
  const auto devices = make_devices(whole, clock, reactor, make_null_logger());
  ASSERT_TRUE(devices.ok()) << devices.error().message;
  EXPECT_EQ(devices->camera->device(), camera().device());
}

// ---- before it is chosen -------------------------------------------------------------------------------------------

class TriedCamera : public V4l2CameraTest {
 protected:
  TriedCamera() { whole.store.data_dir = data.path(); }
  Result<CameraTrial> trial(const WantedTrial& wanted, const DeviceRoots& roots = {}) {
    return try_camera(here, whole, roots, wanted, [](double, const std::string&) {}, {});
  }
  Config whole;
  CaptureHere here;
};

TEST_F(TriedCamera, ItsPictureAndWhatToWriteComeFromItself) {
  const auto seen = trial({CameraFile::kDevice, 0, 0, "", {}});
  ASSERT_TRUE(seen.ok()) << seen.error().message;
  EXPECT_EQ(seen->camera.kind, "v4l2");
  EXPECT_EQ(seen->camera.device, CameraFile::kDevice);
  EXPECT_EQ(seen->camera.width, 64);
  EXPECT_EQ(seen->camera.height, 64);
  EXPECT_EQ(seen->camera.format, "MJPG");
  EXPECT_THAT(seen->camera.options, ElementsAre(std::pair<std::string, std::string>("focus_absolute", "17")));
  // Whether its automatics were seen at rest is a matter of this machine's speed.
  EXPECT_THAT(seen->doubts, Each(v4l2::LookDoubt::kUnsettled));
  const std::vector<std::uint8_t> bytes(seen->jpeg.begin(), seen->jpeg.end());
  const cv::Mat shown = cv::imdecode(bytes, cv::IMREAD_COLOR);
  ASSERT_EQ(shown.size(), cv::Size(64, 64));
  EXPECT_GT(shown.at<cv::Vec3b>(16, 32)[2], shown.at<cv::Vec3b>(16, 32)[1] + 40) << "wood is red";
  EXPECT_EQ(device.value_of(V4L2_CID_EXPOSURE_AUTO), V4L2_EXPOSURE_MANUAL) << "its automatics were let go";
  // What was proposed makes the same pictures once it is chosen.
  config = seen->camera;
  EXPECT_TRUE(camera().capture().ok());
}

TEST_F(TriedCamera, ItsProcessMayOpenThisCameraAndNothingElse) {
  ASSERT_TRUE(trial({CameraFile::kDevice, 64, 64, "MJPG", {{"focus_absolute", "17"}}}).ok());
  ASSERT_EQ(here.orders.size(), 1U);
  EXPECT_THAT(*here.orders.front().devices, ElementsAre(fs::path(CameraFile::kDevice)));
  EXPECT_FALSE(here.orders.front().network);
}

TEST_F(TriedCamera, WhatKeepsItFromAPictureIsTold) {
  const auto refused = [&](const WantedTrial& wanted) {
    const auto seen = trial(wanted);
    EXPECT_FALSE(seen.ok());
    return seen.ok() ? "" : seen.error().message;
  };
  EXPECT_THAT(refused({"/dev/v4l/by-id/none", 0, 0, "", {}}), HasSubstr("is not there: plug it in"));
  for (const char* name : {"/dev/video0", "/dev/ttyUSB0", "/dev/v4l/by-id/..", "/dev/v4l/by-id/", ""})
    EXPECT_THAT(refused({name, 0, 0, "", {}}), HasSubstr("no lasting name of a camera")) << name;
  device.change([](CameraFile::Play& play) { play.fails = {{VIDIOC_REQBUFS, EBUSY}}; });
  EXPECT_THAT(refused({CameraFile::kDevice, 0, 0, "", {}}), HasSubstr("is used by another program: close that"));
  device.change([](CameraFile::Play& play) { play.fails = {{VIDIOC_STREAMON, ENOSPC}}; });
  EXPECT_THAT(refused({CameraFile::kDevice, 0, 0, "", {}}), HasSubstr("or set a smaller width and height"));
  EXPECT_THAT(refused({CameraFile::kDevice, 0, 0, "", {}}), Not(HasSubstr("[camera]"))) << "nothing is written yet";
  device.change([](CameraFile::Play& play) { play.fails.clear(); });
  EXPECT_THAT(refused({CameraFile::kDevice, 0, 0, "", {{"auto_exposure", "1"}}}),
              HasSubstr("good for one focus: set focus_absolute = 17, which is what it has now"));
  device.change([](CameraFile::Play& play) { play.driver = "v4l2 loopback"; });
  EXPECT_THAT(refused({CameraFile::kDevice, 0, 0, "", {}}), HasSubstr("what a program makes up (v4l2 loopback)"));
  device.change([](CameraFile::Play& play) {
    play.driver = "played";
    play.controls[V4L2_CID_EXPOSURE_AUTO].choices = {"Auto Mode", "", "", "Aperture Priority Mode"};
  });
  EXPECT_THAT(refused({CameraFile::kDevice, 0, 0, "", {}}),
              AllOf(HasSubstr("always sets its exposure itself"), HasSubstr("use another camera")));
}

// The configuration could not hold it.
TEST_F(TriedCamera, OneWhosePicturesAreTooSmallOrTooLargeIsRefusedBeforeItIsStarted) {
  for (const auto& size : {std::pair{64U, 32U}, {8192U, 8192U}}) {
    device.change([&](CameraFile::Play& play) { play.width = size.first, play.height = size.second; });
    const auto seen = trial({CameraFile::kDevice, 0, 0, "", {}});
    ASSERT_FALSE(seen.ok()) << size.first;
    EXPECT_THAT(seen.error().message,
                AllOf(HasSubstr("no size for a picture of the bed"), HasSubstr("another camera")));
  }
  EXPECT_EQ(device.frames_given(), 0);
}

TEST_F(TriedCamera, OneThatHangsIsTold) {
  class Hanging final : public WorkRunner {
   public:
    Result<nlohmann::json> run(const WorkOrder& order, const TaskProgress&, std::stop_token) override {
      EXPECT_EQ(order.deadline, std::chrono::seconds(40)) << "looks at the bed wait meanwhile";
      return Error{ErrorCode::kTimeout, "given up"};
    }
  } hanging;
  const auto seen =
      try_camera(hanging, whole, {}, {CameraFile::kDevice, 0, 0, "", {}}, [](double, const std::string&) {}, {});
  ASSERT_FALSE(seen.ok());
  EXPECT_THAT(seen.error().message, AllOf(HasSubstr("within 40 s"), HasSubstr("plug it in again")));
}

// ---- which there are ------------------------------------------------------------------------------------------------

class FoundCameras : public V4l2CameraTest {
 protected:
  // A node of a camera on USB, with the names that udev gives it.
  void plug_in(const std::string& node, const std::string& socket, const std::string& serial, const std::string& index,
               const std::vector<std::string>& names) {
    const fs::path usb = root / "sys/devices" / socket, at = usb / (socket + ":1.0") / "video4linux" / node;
    fs::create_directories(at);
    std::ofstream(usb / "idVendor") << "046d\n";
    if (!serial.empty()) std::ofstream(usb / "serial") << serial << "\n";
    std::ofstream(at / "name") << "Webcam of " << socket << "\n";
    std::ofstream(at / "index") << index << "\n";
    fs::create_directory_symlink(usb / (socket + ":1.0"), at / "device");
    fs::create_directories(root / "sys/class/video4linux");
    fs::create_directory_symlink(at, root / "sys/class/video4linux" / node);
    fs::create_directories(root / "dev/v4l");
    std::ofstream(root / "dev" / node) << "";
    for (const std::string& name : names) {
      fs::create_directories((root / "dev/v4l" / name).parent_path());
      fs::create_symlink(root / "dev" / node, root / "dev/v4l" / name);
    }
  }
  DeviceRoots roots() const { return {root / "dev", root / "sys"}; }
  testing::TempDirectory root;
};

TEST_F(FoundCameras, AreNamedByTheirNumberOrElseByTheirSocket) {
  plug_in("video0", "1-1", "A1B2C3D4", "0", {"by-id/usb-Maker_Cam_A1B2C3D4-video-index0", "by-path/pci-1-1-index0"});
  plug_in("video2", "1-2", "", "0", {"by-id/usb-Cheap_Cam-video-index0", "by-path/pci-1-2-index0"});
  plug_in("video4", "1-3", "", "0", {});
  const auto found = find_cameras(roots());
  ASSERT_EQ(found.size(), 3U);
  EXPECT_EQ(found[0].node, (root / "dev/video0").string());
  EXPECT_EQ(found[0].name, "Webcam of 1-1");
  EXPECT_EQ(found[0].device, (root / "dev/v4l/by-id/usb-Maker_Cam_A1B2C3D4-video-index0").string());
  EXPECT_EQ(found[0].named_by, NamedBy::kSerialNumber);
  EXPECT_EQ(found[1].device, (root / "dev/v4l/by-path/pci-1-2-index0").string()) << "all of its make have that name";
  EXPECT_EQ(found[1].named_by, NamedBy::kSocket);
  EXPECT_EQ(found[2].device, "");
  EXPECT_EQ(found[2].named_by, NamedBy::kNothing);
}

TEST_F(FoundCameras, OfOneNumberGoByTheirSockets) {
  plug_in("video0", "1-1", "SN000001", "0", {"by-id/usb-Cam_SN000001-video-index0", "by-path/pci-1-1-index0"});
  plug_in("video2", "1-2", "SN000001", "0", {"by-path/pci-1-2-index0"});
  for (const FoundCamera& one : find_cameras(roots())) EXPECT_EQ(one.named_by, NamedBy::kSocket) << one.node;
}

// A name without a number is given to whichever camera of that make was plugged in last.
TEST_F(FoundCameras, ANameThatMeansAnyOfAMakeIsRefused) {
  plug_in("video0", "1-1", "A1B2C3D4", "0", {"by-id/usb-Maker_Cam_A1B2C3D4-video-index0", "by-path/pci-1-1-index0"});
  plug_in("video2", "1-2", "", "0", {"by-id/usb-Cheap_Cam-video-index0", "by-path/pci-1-2-index0"});
  plug_in("video4", "1-3", "0001", "0", {"by-id/usb-Cam_0001-video-index0"});
  const auto refusal = [&](const std::string& name) {
    config.device = (root / "dev/v4l" / name).string();
    const Status one = means_one_camera(roots(), config);
    return one.ok() ? "" : one.error().message;
  };
  EXPECT_EQ(refusal("by-id/usb-Maker_Cam_A1B2C3D4-video-index0"), "");
  EXPECT_THAT(refusal("by-id/usb-Cheap_Cam-video-index0"),
              AllOf(HasSubstr("is any camera of that make"),
                    HasSubstr("use \"" + (root / "dev/v4l/by-path/pci-1-2-index0").string() + "\"")));
  const Status tried = may_be_tried(roots(), config.device);
  ASSERT_FALSE(tried.ok());
  EXPECT_THAT(tried.error().message,
              AllOf(HasSubstr("use \"" + (root / "dev/v4l/by-path/pci-1-2-index0").string() + "\""),
                    Not(HasSubstr("[camera]")), Not(HasSubstr("calibrate"))))
      << "nothing is written yet";
  EXPECT_THAT(refusal("by-id/usb-Cam_0001-video-index0"), HasSubstr("use its name below /dev/v4l/by-path"));
  EXPECT_EQ(refusal("by-path/pci-1-2-index0"), "");
  EXPECT_EQ(refusal("by-id/usb-Gone-video-index0"), "");
  config.device = (root / "dev/v4l/by-id/usb-Cheap_Cam-video-index0").string();
  V4l2Camera one(std::make_unique<CaptureHere>(), config, data.path(), V4l2Camera::kDeadline, roots());
  EXPECT_EQ(one.capture().error().code, ErrorCode::kRefused) << "it was plugged in since the start";
  config.kind = "file";
  EXPECT_EQ(refusal("by-id/usb-Cheap_Cam-video-index0"), "") << "a file that is only called so";
}

TEST_F(FoundCameras, AnotherOneOfItsNumberMakesANameMeanTwo) {
  const std::string name = "by-id/usb-Cam_SN000001-video-index0";
  plug_in("video0", "1-1", "SN000001", "0", {name, "by-path/pci-1-1-index0"});
  config.device = (root / "dev/v4l" / name).string();
  EXPECT_TRUE(means_one_camera(roots(), config).ok());
  plug_in("video2", "1-2", "SN000001", "0", {"by-path/pci-1-2-index0"});
  EXPECT_FALSE(means_one_camera(roots(), config).ok());
}

TEST_F(FoundCameras, AreToldWithWhatTheyTakeAndNodesWithoutPicturesAreLeftOut) {
  plug_in("video0", "1-1", "A1B2C3D4", "0", {"by-id/usb-Maker_Cam_A1B2C3D4-video-index0"});
  plug_in("video1", "1-1.1", "A1B2C3D4", "1", {});
  Config whole;
  whole.store.data_dir = data.path();
  CaptureHere here;
  const auto found = find_cameras(here, whole, roots(), [](double, const std::string&) {}, {});
  ASSERT_TRUE(found.ok()) << found.error().message;
  ASSERT_EQ(found->size(), 1U);
  EXPECT_EQ(found->front().found.name, "Webcam of 1-1");
  EXPECT_THAT(found->front().described.problem, HasSubstr("is no camera")) << "a plain file here";
  EXPECT_THAT(*here.orders.front().devices, ElementsAre(root / "dev/video0", root / "dev/video1"));
  EXPECT_FALSE(here.orders.front().network);
  EXPECT_EQ(here.orders.front().deadline, std::chrono::seconds(10)) << "the bed waits meanwhile";
  whole.workers.look_limit_s = 5;
  ASSERT_TRUE(find_cameras(here, whole, roots(), [](double, const std::string&) {}, {}).ok());
  EXPECT_EQ(here.orders.back().deadline, std::chrono::seconds(5));
}

}  // namespace
}  // namespace veneer::daemon

int main(int argc, char** argv) {
  veneer::tests::be_under_umockdev(argc, argv);
  ::testing::InitGoogleMock(&argc, argv);
  return RUN_ALL_TESTS();
}
