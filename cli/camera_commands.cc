// camera list|try.
#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/command_context.h"
#include "cli/json_read.h"
#include "cli/render.h"

namespace veneer::cli {
namespace {

using nlohmann::json;

struct Trial {
  std::string device, format, out;
  std::optional<int> width, height;
  std::vector<std::string> settings;

  json body() const {
    json told = {{"device", device}};
    if (width) told["width"] = *width;
    if (height) told["height"] = *height;
    if (!format.empty()) told["format"] = format;
    if (!settings.empty()) told["settings"] = settings;
    return told;
  }
};

Result<json> with_picture(const CommandContext& context, Result<json> tried, const std::string& out) {
  if (!tried || out.empty()) return tried;
  const auto picture =
      context.client().get_bytes(fmt::format("/cameras/trial.jpg?trial={}", whole_or(*tried, "trial", 0)));
  if (!picture) return picture.error();
  if (const Status written = write_file(out, *picture); !written) return written.error();
  (*tried)["saved"] = out;
  return tried;
}

void add_try(CLI::App& camera, CommandContext& context) {
  const auto wanted = std::make_shared<Trial>();
  CLI::App* trial = camera.add_subcommand(
      "try",
      "Take a picture with a camera before it is chosen: it adjusts itself once, and those settings are then fixed");
  trial->add_option("DEVICE", wanted->device, "Its path below /dev/v4l, as `camera list` writes it after device =")
      ->required();
  trial
      ->add_option("--width", wanted->width,
                   "Width of its picture in pixels, with --height; without both the best size up to 1920 x 1080")
      ->check(CLI::Range(64, 20000));
  trial->add_option("--height", wanted->height, "Height of its picture in pixels, with --width")
      ->check(CLI::Range(64, 20000));
  trial->add_option("--format", wanted->format, "Else the best that it has at that size")
      ->check(CLI::IsMember({"RGB3", "BGR3", "YUYV", "UYVY", "NV12", "GREY", "MJPG", "JPEG"}));
  trial
      ->add_option("--set", wanted->settings,
                   "A setting as NAME=NUMBER (repeatable): the camera then adjusts nothing itself, and settings that "
                   "are not named have their default")
      ->allow_extra_args(false);
  trial->add_option("--out", wanted->out, "Where the picture is saved (JPEG)");
  trial->callback([wanted, &context] {
    auto tried = context.run_task(context.client().post("/cameras/trial", wanted->body()));
    context.finish(with_picture(context, std::move(tried), wanted->out), render_trial);
  });
}

}  // namespace

void add_camera_commands(CLI::App& app, CommandContext& context) {
  CLI::App* camera = app.add_subcommand("camera", "Cameras that can be used over the bed");
  camera->require_subcommand(1);
  CLI::App* list = camera->add_subcommand("list", "Look for cameras of this computer, and ask what can be set on them");
  list->callback([&context] { context.finish(context.run_task(context.client().post("/cameras")), render_cameras); });
  add_try(*camera, context);
}

}  // namespace veneer::cli
