// Which cameras there are and what can be set on them; and trying one before it is chosen.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "daemon/api/request_reader.h"
#include "daemon/devices/camera_trial.h"
#include "daemon/devices/v4l2_camera.h"
#include "daemon/orders/capture_json.h"
#include "daemon/routes/cell_routes.h"
#include "daemon/routes/post_work.h"
#include "drivers/camera_size.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

json control_json(const v4l2::CameraControl& control) {
  json choices = json::array();
  for (const auto& [number, title] : control.choices) choices.push_back({{"value", number}, {"title", title}});
  return {{"name", control.name},         {"kind", control.kind},     {"least", control.least},
          {"most", control.most},         {"step", control.step},     {"usual", control.usual},
          {"value", control.value},       {"active", control.active}, {"settable", control.settable},
          {"choices", std::move(choices)}};
}

json cameras_json(const std::vector<CameraToChoose>& cameras) {
  json list = json::array();
  for (const auto& [found, described] : cameras) {
    json controls = json::array();
    for (const v4l2::CameraControl& control : described.controls) controls.push_back(control_json(control));
    list.push_back({{"device", found.device},
                    {"node", found.node},
                    {"name", described.card.empty() ? found.name : described.card},
                    {"named_by", to_json(found.named_by)},
                    {"problem", described.problem},
                    {"formats", described.formats},
                    {"controls", std::move(controls)}});
  }
  return {{"cameras", std::move(list)}};
}

json trial_json(const CameraTrial& trial) {
  return {{"trial", trial.task},           {"device", trial.camera.device},
          {"width", trial.camera.width},   {"height", trial.camera.height},
          {"format", trial.camera.format}, {"settings", settings_json(trial.camera.options)},
          {"doubts", trial.doubts}};
}

// "focus_absolute=30": this API's bodies are flat.
Result<std::pair<std::string, std::string>> setting_of(const std::string& text) {
  const std::size_t at = text.find('=');
  if (at == 0 || at == std::string::npos || at + 1 == text.size())
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("\"{}\" is no setting of a camera: write its name, = and a number", text)};
  return std::pair(text.substr(0, at), text.substr(at + 1));
}

WantedTrial wanted_of(RequestReader& body) {
  constexpr NumberRange kPixels{kLeastCameraSide, kMostCameraSide};
  WantedTrial wanted;
  wanted.device = body.text("device").value_or("");
  const auto width = body.whole("width", kPixels), height = body.whole("height", kPixels);
  wanted.width = static_cast<int>(width.value_or(0)), wanted.height = static_cast<int>(height.value_or(0));
  wanted.format = body.word("format", {"RGB3", "BGR3", "YUYV", "UYVY", "NV12", "GREY", "MJPG", "JPEG"}).value_or("");
  for (const std::string& text : body.texts("settings").value_or(std::vector<std::string>{})) {
    auto setting = setting_of(text);
    if (!setting)
      body.refuse(setting.error());
    else if (std::ranges::any_of(wanted.settings, [&](const auto& given) { return given.first == setting->first; }))
      body.refuse({ErrorCode::kInvalidArgument, fmt::format("{} is set twice: give it once", setting->first)});
    else
      wanted.settings.push_back(*std::move(setting));
  }
  body.require("device");
  if (width.has_value() != height.has_value())
    body.refuse({ErrorCode::kInvalidArgument, "a size is width and height: give both, or neither"});
  if (width && height)
    if (const Status usable = check_camera_size(wanted.width, wanted.height); !usable) body.refuse(usable.error());
  return wanted;
}

void try_one(const CameraServices& s, const ApiRequest& request, const Reply& reply) {
  auto body = RequestReader::body_of(request);
  const WantedTrial wanted = wanted_of(body);
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  if (const Status may = camera_is_free(s.unit); !may) return reply(ApiReply::error(may.error()));
  const auto turn = s.trials.take_turn();
  if (!turn) return reply(ApiReply::error(turn.error()));
  start_task(s.tasks, s.camera, "try camera", "waiting for the camera", reply,
             [s, wanted, turn = *turn](const TaskReporter& task) {
               auto trial = try_camera(
                   s.workers, s.config, s.roots, wanted,
                   [&](double f, const std::string& text) { task.progress(f, text); }, task.stop_token());
               turn->end();  // before whoever asked is told
               if (!trial) return task.fail(trial.error());
               trial->task = task.id();
               const json told = trial_json(*trial);
               s.trials.keep(*std::move(trial));
               task.done(told);
             });
}

// `trial` is in the address, so that no browser shows another one's picture.
void show_trial(const CameraServices& s, const ApiRequest& request, const Reply& reply) {
  auto query = RequestReader::query_of(request);
  const auto wanted = query.whole("trial", {1, 1e15});
  if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
  const auto last = s.trials.last();
  if (!last || (wanted && *wanted != last->task))
    return reply(ApiReply::error(
        {ErrorCode::kNotFound, "there is no such picture any more: take another one with that camera"}));
  s.pictures.ask(request, reply, [last](Repositories&) { return ApiReply::bytes(last->jpeg, "image/jpeg"); });
}

}  // namespace

json settings_json(const std::vector<std::pair<std::string, std::string>>& settings) {
  json out = json::object();
  for (const auto& [name, value] : settings) out[name] = value;
  return out;
}

void bind_camera_routes(Router& router, const CameraServices& s) {
  router.bind("findCameras", [s](const ApiRequest&, const Reply& reply) {
    if (const Status may = camera_is_free(s.unit); !may) return reply(ApiReply::error(may.error()));
    const auto turn = s.trials.take_turn();
    if (!turn) return reply(ApiReply::error(turn.error()));
    start_task(s.tasks, s.camera, "find cameras", "waiting for the camera", reply,
               [s, turn = *turn](const TaskReporter& task) {
                 const auto found = find_cameras(
                     s.workers, s.config, s.roots, [&](double f, const std::string& text) { task.progress(f, text); },
                     task.stop_token());
                 turn->end();  // before whoever asked is told
                 task.finish(found ? Result<json>(cameras_json(*found)) : Result<json>(found.error()));
               });
  });
  router.bind("tryCamera", [s](const ApiRequest& request, const Reply& reply) { try_one(s, request, reply); });
  router.bind("getCameraTrial", [s](const ApiRequest& request, const Reply& reply) { show_trial(s, request, reply); });
}

}  // namespace veneer::daemon
