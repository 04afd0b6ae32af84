// Which cameras there are, and what can be set on them.
#include "daemon/orders/capture_json.h"
#include "daemon/routes/cell_routes.h"
#include "daemon/routes/post_work.h"
#include "daemon/services/v4l2_camera.h"

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

}  // namespace

void bind_camera_routes(Router& router, const CameraServices& s) {
  router.bind("findCameras", [s](const ApiRequest&, const Reply& reply) {
    if (const Status may = camera_is_free(s.unit); !may) return reply(ApiReply::error(may.error()));
    start_task(s.tasks, s.camera, "find cameras", "waiting for the camera", reply, [s](const TaskReporter& task) {
      const auto found = find_cameras(
          s.workers, s.config, s.roots, [&](double f, const std::string& text) { task.progress(f, text); },
          task.stop_token());
      task.finish(found ? Result<json>(cameras_json(*found)) : Result<json>(found.error()));
    });
  });
}

}  // namespace veneer::daemon
