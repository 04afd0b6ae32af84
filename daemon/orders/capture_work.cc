#include "daemon/orders/capture_work.h"

#include <array>
#include <opencv2/imgproc.hpp>
#include <thread>

#include "daemon/orders/capture_json.h"
#include "daemon/orders/capture_order.h"
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
    KindOfWork{TakePicture::kKind, take_picture}, KindOfWork{DescribeCameras::kKind, describe_cameras}};

}  // namespace

std::span<const KindOfWork> capture_work() { return kCaptureWork; }

}  // namespace veneer::daemon
