#include "daemon/devices/camera_trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "daemon/devices/v4l2_camera.h"
#include "daemon/orders/capture_json.h"
#include "daemon/orders/have_done.h"

namespace veneer::daemon {
namespace {

// Twice what its automatics and a look may take, for a machine that is busy.
constexpr std::chrono::seconds kTrialDeadline{40};
constexpr std::uintmax_t kMostTrialBytes = 8 << 20;

}  // namespace

Status is_plugged_in(const DeviceRoots& roots, const std::string& device) {
  const auto found = find_cameras(roots);
  if (!device.empty() && std::ranges::find(found, device, &FoundCamera::device) != found.end()) return Ok();
  return Error{
      ErrorCode::kNotFound,
      "no camera of that name is plugged in: check its cable, then look for cameras again (veneerctl camera list)"};
}

Status may_be_tried(const DeviceRoots& roots, const std::string& device) {
  const std::filesystem::path name = device, folder = name.parent_path(), cameras = roots.dev / "v4l";
  if ((folder != cameras / "by-id" && folder != cameras / "by-path") || !name.has_filename() ||
      name.filename() == "." || name.filename() == "..")
    return Error{ErrorCode::kNotFound,
                 "that is no lasting name of a camera: see veneerctl camera list, and take one from it"};
  CameraConfig camera;
  camera.kind = "v4l2", camera.device = device;
  return means_one_camera(roots, camera);
}

Result<CameraTrial> try_camera(WorkRunner& workers, const Config& config, const DeviceRoots& roots,
                               const WantedTrial& wanted, const TaskProgress& progress, const std::stop_token& stop) {
  if (const Status may = may_be_tried(roots, wanted.device); !may) return may.error();
  const auto folder = WorkFolder::make(config.store.data_dir);
  if (!folder) return folder.error();
  CameraTrial out;
  const TryCamera asked{
      wanted.device, {wanted.width, wanted.height, wanted.format, wanted.settings}, out.camera.frames};
  auto tried = have_done<CameraTried>(
      workers, camera_order(TryCamera::kKind, "trying a camera", *folder, {wanted.device}, kTrialDeadline), asked,
      progress, stop);
  if (!tried)
    return tried.error().code == ErrorCode::kTimeout ? camera_hangs(wanted.device, kTrialDeadline) : tried.error();
  auto jpeg = folder->made(kShownPicture, kMostTrialBytes);
  if (!jpeg || jpeg->empty())
    return Error{ErrorCode::kInternal,
                 "trying the camera made no picture: try again, and report it when it comes back"};
  out.camera.kind = "v4l2";
  out.camera.device = wanted.device;
  out.camera.width = tried->settings.width, out.camera.height = tried->settings.height;
  out.camera.format = tried->settings.format;
  out.camera.options = std::move(tried->settings.options);
  out.doubts = std::move(tried->doubts);
  out.jpeg = *std::move(jpeg);
  return out;
}

}  // namespace veneer::daemon
