#include "daemon/orders/capture_work.h"

#include <array>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <thread>

#include "daemon/orders/capture_json.h"
#include "daemon/orders/capture_order.h"
#include "daemon/orders/shown_picture.h"
#include "drivers/camera_size.h"
#include "drivers/v4l2/video_device.h"
#include "planner/pictures/jpeg_codec.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

Result<json> scan_glass(const json& request, const std::filesystem::path& folder, const TaskProgress& progress,
                        const std::stop_token& stop) {
  const auto order = request.get<ScanGlass>();
  auto library = sane::SaneLibrary::open(order.sane_config);
  if (!library) return library.error();
  sane::ReadOptions options;
  options.pause = [](std::chrono::milliseconds time) { std::this_thread::sleep_for(time); };
  auto scanned = sane::scan_picture(**library, order.settings, folder / kMadeCapture, options, progress, stop);
  if (!scanned) return scanned.error();
  return json(*scanned);
}

Result<json> find_scanners(const json& request, const std::filesystem::path&, const TaskProgress& progress,
                           const std::stop_token& stop) {
  const auto order = request.get<FindScanners>();
  auto library = sane::SaneLibrary::open(order.sane_config);
  if (!library) return library.error();
  auto found = sane::describe_scanners(**library, progress, stop);
  if (!found) return found.error();
  return json(ScannersFound{std::move(*found)});
}

// By the decoder that refuses what is broken in any way; a frame's bytes may go on behind the picture.
std::optional<RawPicture> decode_frame(std::span<const std::uint8_t> bytes, int width, int height) {
  cv::Mat pixels =
      planner::decode_jpeg({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, cv::Size(width, height))
          .value_or(cv::Mat());
  if (pixels.type() != CV_8UC3 && pixels.type() != CV_8UC1) return std::nullopt;
  if (pixels.empty()) return std::nullopt;
  cv::cvtColor(pixels, pixels, pixels.channels() == 3 ? cv::COLOR_BGR2RGB : cv::COLOR_GRAY2RGB);
  return RawPicture{pixels.cols, pixels.rows, 3, 8, {pixels.datastart, pixels.dataend}};
}

Result<json> take_picture(const json& request, const std::filesystem::path& folder, const TaskProgress&,
                          const std::stop_token& stop) {
  const auto order = request.get<TakePicture>();
  auto camera = v4l2::open_camera(order.device);
  if (!camera) return camera.error();
  v4l2::LookOptions options;
  options.frames = order.frames;
  const SteadyClock clock;
  auto taken = v4l2::take_picture(**camera, order.settings, folder / kMadePicture, options, clock, decode_frame, stop);
  if (!taken) return taken.error();
  return json(*taken);
}

Status show(const RawPicture& picture, const std::filesystem::path& file) {
  constexpr int kWidthPx = 1280;
  cv::Mat shown(picture.height, picture.width, CV_8UC3);
  std::memcpy(shown.data, picture.samples.data(), picture.samples.size());
  cv::cvtColor(shown, shown, cv::COLOR_RGB2BGR);
  return write_shown(shown, kWidthPx, file.string());
}

Result<json> try_camera(const json& request, const std::filesystem::path& folder, const TaskProgress& progress,
                        const std::stop_token& stop) {
  auto order = request.get<TryCamera>();
  auto camera = v4l2::open_camera(order.device);
  if (!camera) return camera.error();
  auto wanted = v4l2::best_settings(**camera, order.settings);
  if (!wanted) return wanted.error();
  // One that it does not have is told with those that it has.
  if (wanted->width > 0)
    if (Status usable = check_camera_size(wanted->width, wanted->height); !usable) return usable.error();
  v4l2::LookOptions options;
  options.frames = order.frames;
  const SteadyClock clock;
  progress(0.1, wanted->options.empty() ? "its automatics seek" : "taking a picture");
  auto tried = wanted->options.empty()
                   ? v4l2::propose_settings(**camera, *wanted, {}, options, clock, decode_frame, stop)
                   : v4l2::try_settings(**camera, *wanted, options, clock, decode_frame, stop);
  if (!tried) return tried.error();
  if (Status shown = show(tried->look.picture, folder / kShownPicture); !shown) return shown.error();
  return json(CameraTried{std::move(tried->settings), std::move(tried->doubts)});
}

Result<json> describe_cameras(const json& request, const std::filesystem::path&, const TaskProgress& progress,
                              const std::stop_token& stop) {
  const auto order = request.get<DescribeCameras>();
  CamerasDescribed out;
  for (const std::string& device : order.devices) {
    if (stop.stop_requested()) return Error{ErrorCode::kCancelled, "looking for cameras was cancelled"};
    progress(static_cast<double>(out.cameras.size()) / static_cast<double>(order.devices.size()), device);
    auto camera = v4l2::open_camera(device);
    out.cameras.push_back(camera ? v4l2::describe_camera(**camera)
                                 : v4l2::DescribedCamera{device, "", "", {}, {}, camera.error().message});
  }
  return json(out);
}

constexpr std::array kCaptureWork{
    KindOfWork{ScanGlass::kKind, scan_glass}, KindOfWork{FindScanners::kKind, find_scanners},
    KindOfWork{TakePicture::kKind, take_picture}, KindOfWork{TryCamera::kKind, try_camera},
    KindOfWork{DescribeCameras::kKind, describe_cameras}};

}  // namespace

std::span<const KindOfWork> capture_work() { return kCaptureWork; }

}  // namespace veneer::daemon
