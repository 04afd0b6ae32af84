#include "drivers/v4l2/camera_order.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <set>
#include <tuple>

#include "drivers/pnm_file.h"

namespace veneer::v4l2 {
namespace {

bool is_readable(const std::string& code) {
  const auto& all = readable_formats();
  return std::ranges::find(all, code) != all.end();
}

std::string size_words(const OfferedFormat& one) {
  const std::string least = fmt::format("{} x {}", one.width, one.height);
  return one.most_width == one.width && one.most_height == one.height
             ? least
             : fmt::format("{} to {} x {}", least, one.most_width, one.most_height);
}

Status has_format(OpenCamera& camera, const CameraSettings& settings) {
  const auto offered = camera.formats();
  if (!offered) return offered.error();
  std::set<std::string> codes, sizes;
  for (const OfferedFormat& one : *offered) {
    if (!is_readable(one.code)) continue;
    sizes.insert(size_words(one));
    if (one.has(settings.width, settings.height)) codes.insert(one.code);
  }
  if (sizes.empty())
    return Error{ErrorCode::kRefused,
                 fmt::format("the camera {} offers no pictures that can be read here: use another camera (these are "
                             "read: {})",
                             camera.camera(), fmt::join(readable_formats(), ", "))};
  if (codes.empty())
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("the camera {} has no pictures of {} x {} pixels: set width and height to one of {}",
                             camera.camera(), settings.width, settings.height, fmt::join(sizes, ", "))};
  if (codes.contains(settings.format)) return Ok();
  return Error{ErrorCode::kInvalidArgument,
               fmt::format("the camera {} has no format {} at {} x {} pixels: set format to one of {}", camera.camera(),
                           settings.format, settings.width, settings.height, fmt::join(codes, ", "))};
}

}  // namespace

Result<CameraSettings> best_settings(OpenCamera& camera, const CameraSettings& wanted) {
  const auto offered = camera.formats();
  if (!offered) return offered.error();
  constexpr int kWidth = 1920, kHeight = 1080;  // 0.2 mm a pixel over 400 mm, about what tags of 10 mm need
  const bool any_size = wanted.width == 0 && wanted.height == 0, any_format = wanted.format.empty();
  // The best last: what fits before what does not, then the larger or else the smaller, then the better format.
  std::tuple<bool, std::int64_t, std::ptrdiff_t> best{};
  CameraSettings out = wanted;
  bool found = false;
  for (const OfferedFormat& one : *offered) {
    const auto& readable = readable_formats();
    const auto place = std::ranges::find(readable, one.code) - readable.begin();
    if (!is_readable(one.code) || (!any_format && one.code != wanted.format)) continue;
    const bool steps_there = one.has(kWidth, kHeight);
    const int width = !any_size ? wanted.width : steps_there ? kWidth : one.most_width;
    const int height = !any_size ? wanted.height : steps_there ? kHeight : one.most_height;
    if (!one.has(width, height)) continue;
    const bool fits = width <= kWidth && height <= kHeight;
    const std::int64_t pixels = std::int64_t{width} * height;
    const std::tuple now{fits, fits ? pixels : -pixels, -place};
    if (found && now <= best) continue;
    found = true, best = now;
    out.width = width, out.height = height, out.format = one.code;
  }
  return out;
}

Result<FrameFormat> take_format(OpenCamera& camera, const CameraSettings& settings) {
  if (Status has = has_format(camera, settings); !has) return has.error();
  const std::string& code = settings.format;
  auto format = camera.set_format(code, settings.width, settings.height);
  if (!format) return format.error();
  if (format->code != code || format->width != settings.width || format->height != settings.height)
    return Error{ErrorCode::kRefused,
                 fmt::format("the camera {} makes {} x {} pixels, {}, of {} x {}, {}: set width, height and format to "
                             "what it keeps",
                             camera.camera(), format->width, format->height, format->code, settings.width,
                             settings.height, code)};
  if (!has_whole_lines(*format))
    return Error{
        ErrorCode::kRefused,
        fmt::format("the driver of the camera {} says that its pictures of {} x {} pixels, {}, have lines of {} "
                    "bytes, which is too few: set another format, update the kernel or use "
                    "another camera",
                    camera.camera(), format->width, format->height, format->code, format->bytes_per_line)};
  return format;
}

Result<AveragedPicture> take_locked_look(OpenCamera& camera, const CameraSettings& settings, const LookOptions& options,
                                         const Clock& clock, const DecodeJpeg& decode_jpeg,
                                         const std::stop_token& stop) {
  const auto format = take_format(camera, settings);
  if (!format) return format.error();
  const auto locked = lock_controls(camera, settings.options);
  if (!locked) return locked.error();
  LookOptions settled = options;
  if (locked->motor_moves) settled.settling = std::max(options.settling, options.motor_settling);
  auto look = take_look(camera, *format, settled, clock, decode_jpeg, stop);
  if (!look) return look.error();
  // A camera may lose its settings when it begins.
  if (Status kept = still_locked(camera, *locked); !kept) return kept.error();
  return look;
}

Result<TakenPicture> take_picture(OpenCamera& camera, const CameraSettings& settings, const std::filesystem::path& file,
                                  const LookOptions& options, const Clock& clock, const DecodeJpeg& decode_jpeg,
                                  const std::stop_token& stop) {
  const auto look = take_locked_look(camera, settings, options, clock, decode_jpeg, stop);
  if (!look) return look.error();
  if (Status written = write_pnm(look->picture, file); !written) return written.error();
  return TakenPicture{camera.card(),   camera.bus(),   settings.format, settings.width,
                      settings.height, look->averaged, look->refused};
}

DescribedCamera describe_camera(OpenCamera& camera) {
  DescribedCamera out{camera.camera(), camera.card(), camera.bus(), {}, {}, ""};
  auto formats = camera.formats();
  auto controls = camera.controls();
  if (!formats) return out.problem = formats.error().message, out;
  if (!controls) return out.problem = controls.error().message, out;
  out.formats = std::move(*formats);
  out.controls = std::move(*controls);
  return out;
}

}  // namespace veneer::v4l2
