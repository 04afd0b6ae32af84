#include "daemon/services/v4l2_camera.h"

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

// Does this setting move or turn what is seen? Then calibrations are good for one value of it.
bool moves_the_view(const std::string& option) {
  constexpr std::array<std::string_view, 7> kBegin = {"focus",           "zoom",          "pan_",  "tilt_",
                                                      "horizontal_flip", "vertical_flip", "rotate"};
  return std::ranges::any_of(kBegin, [&](std::string_view begin) { return option.starts_with(begin); });
}

Error camera_hangs(const std::string& device, std::chrono::milliseconds deadline) {
  return {
      ErrorCode::kTimeout,
      fmt::format("the camera {} was not done within {} s and was given up: unplug it, plug it in again, and look at "
                  "its cable",
                  device, std::chrono::duration<double>(deadline).count())};
}

}  // namespace

V4l2Camera::V4l2Camera(std::unique_ptr<WorkRunner> workers, CameraConfig config, fs::path data_dir,
                       std::chrono::milliseconds deadline)
    : workers_(std::move(workers)), config_(std::move(config)), data_dir_(std::move(data_dir)), deadline_(deadline) {}

Result<fs::path> V4l2Camera::capture() { return take(config_.frames, captured_, {}); }

Result<fs::path> V4l2Camera::glance(const std::stop_token& stop) { return take(1, glanced_, stop); }

Result<fs::path> V4l2Camera::take(int frames, std::optional<WorkFolder>& into, const std::stop_token& stop) {
  into.reset();
  auto folder = WorkFolder::make(data_dir_);
  if (!folder) return folder.error();
  const TakePicture asked{config_.device, {config_.width, config_.height, config_.format, config_.options}, frames};
  const auto taken = have_done<v4l2::TakenPicture>(
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
  std::string text =
      fmt::format("v4l2 {}, {} x {}", fs::path(config_.device).filename().string(), config_.width, config_.height);
  if (!config_.format.empty()) text += " " + config_.format;
  for (const auto& [name, value] : config_.options)
    if (moves_the_view(name)) text += fmt::format(", {} {}", name, value);
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
  auto described =
      have_done<CamerasDescribed>(workers,
                                  camera_order(DescribeCameras::kKind, "looking for cameras", *folder,
                                               std::move(devices), std::chrono::seconds(config.workers.look_limit_s)),
                                  asked, progress, stop);
  if (!described) return described.error();
  if (described->cameras.size() != out.size())
    return Error{ErrorCode::kInternal, "looking for cameras came back with others than were asked for: try again"};
  for (std::size_t i = 0; i < out.size(); ++i) out[i].described = std::move(described->cameras[i]);
  // Most cameras have a second node, which gives no pictures.
  std::erase_if(out, [](const CameraToChoose& one) { return !one.found.is_first && !one.described.problem.empty(); });
  return out;
}

}  // namespace veneer::daemon
