#include "daemon/devices/v4l2_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <system_error>
#include <utility>

#include "daemon/orders/capture_json.h"
#include "daemon/orders/have_done.h"

namespace veneer::daemon {
namespace {

namespace fs = std::filesystem;

// Settings of a camera, as Linux names them, that make a picture brighter or of other colours and move nothing in it.
// Calibrations count whatever they are; of every other setting they are good for one value.
bool leaves_the_view(std::string_view option) {
  constexpr std::array<std::string_view, 21> kAll = {"auto_exposure",
                                                     "exposure",
                                                     "exposure_dynamic_framerate",
                                                     "exposure_time_absolute",
                                                     "auto_exposure_bias",
                                                     "gain",
                                                     "gain_automatic",
                                                     "analogue_gain",
                                                     "digital_gain",
                                                     "iso_sensitivity",
                                                     "white_balance_automatic",
                                                     "white_balance_temperature",
                                                     "red_balance",
                                                     "blue_balance",
                                                     "brightness",
                                                     "contrast",
                                                     "saturation",
                                                     "hue",
                                                     "gamma",
                                                     "backlight_compensation",
                                                     "power_line_frequency"};
  return std::ranges::find(kAll, option) != kAll.end();
}

// So long a look at the bed may have to wait for it.
constexpr std::chrono::seconds kMostFinding{10};

}  // namespace

WorkOrder camera_order(const char* kind, const char* what, const WorkFolder& folder, std::vector<fs::path> devices,
                       std::chrono::milliseconds deadline) {
  WorkOrder order;
  order.kind = kind;
  order.what = what;
  order.folder = folder.path();
  order.devices = std::move(devices);
  order.deadline = deadline;
  order.nice = 0;  // a reader that comes late loses frames
  return order;
}

Error camera_hangs(const std::string& device, std::chrono::milliseconds deadline) {
  return {
      ErrorCode::kTimeout,
      fmt::format("the camera {} was not done within {} s and was given up: unplug it, plug it in again, and look at "
                  "its cable",
                  device, std::chrono::duration<double>(deadline).count())};
}

V4l2Camera::V4l2Camera(std::unique_ptr<WorkRunner> workers, CameraConfig config, fs::path data_dir,
                       std::chrono::milliseconds deadline, DeviceRoots roots)
    : workers_(std::move(workers)),
      config_(std::move(config)),
      data_dir_(std::move(data_dir)),
      deadline_(deadline),
      roots_(std::move(roots)) {}

Result<fs::path> V4l2Camera::capture() { return take(config_.frames, captured_, given_up_.get_token()); }

Result<fs::path> V4l2Camera::glance(const std::stop_token& stop) {
  std::stop_source either;
  const auto end = [&either] { either.request_stop(); };
  const std::stop_callback asked(stop, end), given_up(given_up_.get_token(), end);
  return take(1, glanced_, either.get_token());
}

Result<fs::path> V4l2Camera::take(int frames, std::optional<WorkFolder>& into, const std::stop_token& stop) {
  into.reset();
  if (stop.stop_requested()) return Error{ErrorCode::kCancelled, "the picture of the bed was cancelled"};
  // Before each, since another one may have been plugged in.
  if (const Status one = means_one_camera(roots_, config_); !one) return one.error();
  auto folder = WorkFolder::make(data_dir_);
  if (!folder) return folder.error();
  const TakePicture asked{config_.device, {config_.width, config_.height, config_.format, config_.options}, frames};
  const auto taken = have_done_despite_a_death<v4l2::TakenPicture>(
      *workers_, camera_order(TakePicture::kKind, "taking a picture of the bed", *folder, {config_.device}, deadline_),
      asked, [](double, const std::string&) {}, stop);
  if (!taken)
    return taken.error().code == ErrorCode::kTimeout ? camera_hangs(config_.device, deadline_) : taken.error();
  std::error_code none;
  if (taken->width != config_.width || taken->height != config_.height || taken->averaged != frames ||
      !fs::is_regular_file(folder->path() / kMadePicture, none))
    return Error{
        ErrorCode::kInternal,
        "the picture of the bed came back of another size or not at all: try again, and report it when it comes "
        "back"};
  into = std::move(*folder);
  return into->path() / kMadePicture;
}

std::string V4l2Camera::device() const {
  std::string text = fmt::format("v4l2 {}, {} x {} {}", fs::path(config_.device).filename().string(), config_.width,
                                 config_.height, config_.format);
  for (const auto& [name, value] : config_.options)
    if (!leaves_the_view(name)) text += fmt::format(", {} {}", name, value);
  return text;
}

Result<std::vector<CameraToChoose>> find_cameras(WorkRunner& workers, const Config& config, const DeviceRoots& roots,
                                                 const TaskProgress& progress, const std::stop_token& stop) {
  std::vector<CameraToChoose> out;
  std::vector<fs::path> devices;
  DescribeCameras asked;
  for (FoundCamera& found : find_cameras(roots)) {
    devices.emplace_back(found.node);
    asked.devices.push_back(found.node);
    out.push_back({std::move(found), {}});
  }
  const auto folder = WorkFolder::make(config.store.data_dir);
  if (!folder) return folder.error();
  const auto limit = std::min(kMostFinding, std::chrono::seconds(config.workers.look_limit_s));
  auto described = have_done<CamerasDescribed>(
      workers, camera_order(DescribeCameras::kKind, "looking for cameras", *folder, std::move(devices), limit), asked,
      progress, stop);
  if (!described) return described.error();
  if (described->cameras.size() != out.size())
    return Error{ErrorCode::kInternal, "looking for cameras came back with others than were asked for: try again"};
  for (std::size_t i = 0; i < out.size(); ++i) out[i].described = std::move(described->cameras[i]);
  // Most cameras have a second node, which gives no pictures.
  std::erase_if(out, [](const CameraToChoose& one) { return !one.found.is_first && !one.described.problem.empty(); });
  return out;
}

}  // namespace veneer::daemon
