#include "daemon/routes/bind_routes.h"

#include <boost/asio/post.hpp>
#include <nlohmann/json.hpp>

#include "daemon/api/task_routes.h"
#include "daemon/news/left_out_places.h"
#include "daemon/routes/cell_routes.h"

namespace veneer::daemon {

void bind_routes(Router& router, Cell& cell) {
  Cell& c = cell;
  const auto on_reactor = [&c](auto act) { boost::asio::post(c.reactor, std::move(act)); };
  router.gate_changes([&c](std::string_view operation, const ApiRequest& request) {
    if (Status may = c.integrity->may_begin(operation, request); !may) return may;
    return DatabaseCheck::is_always_taken(operation, request) ? Ok() : c.change_audit->may_be_noted(request.caller);
  });
  bind_unit_routes(router, {*c.runner, *c.runner, c.metrics, *c.bed, *c.glances, *c.cuts, *c.integrity, c.tasks,
                            *c.queries, [&c](Role told) { return c.status(told); }});
  const auto panel_changed = [&c, on_reactor](const std::optional<PanelId>& panel) {
    on_reactor([&c, panel] {
      c.refresh_counts();
      if (panel) c.hub.broadcast({{"type", "panel"}, {"panel", panel->value}});
    });
  };
  bind_stock_routes(router, {*c.queries, *c.database, *c.pictures, c.panel_library, c.stock_memory, c.panel_figures,
                             c.remnants, panel_changed});
  bind_proposal_routes(router, {*c.scans, *c.proposals, *c.scanner_worker, c.tasks, *c.queries, *c.pictures,
                                c.panel_library, panel_changed});
  bind_mask_routes(router, {*c.queries, *c.database, *c.pictures, c.panel_library, panel_changed});
  bind_remnant_routes(router, {*c.queries, *c.pictures, c.panel_library, c.stock_memory, c.panel_figures, c.remnants,
                               [&c] { c.count_stock(); }});
  const PictureServices drawn{*c.pictures, c.panel_library};
  bind_tile_routes(router, drawn);
  bind_plan_piece_routes(router, drawn);
  bind_map_routes(router, drawn);
  bind_fiducial_routes(router, *c.pictures);
  bind_fact_routes(router, {*c.database, *c.queries, panel_changed});
  bind_scanner_routes(router, {*c.work_runner, c.config, *c.scanner_worker, c.tasks});
  bind_camera_routes(router, {*c.runner, *c.work_runner, c.config, c.device_roots, *c.camera_worker, c.tasks,
                              *c.pictures, c.camera_trials});
  bind_calibration_routes(
      router, {*c.calibrations, *c.runner, *c.runner, *c.scanner_worker, *c.camera_worker, c.tasks, *c.queries,
               c.config.panel.thickness, [&c, on_reactor] { on_reactor([&c] { c.refresh_counts(); }); }, on_reactor});
  bind_setup_routes(router, {*c.calibrations, *c.runner, *c.bed, *c.camera_worker, c.tasks, *c.pictures, c.config,
                             c.devices.hands ? &*c.devices.hands : nullptr,
                             cell_devices(*c.devices.scanner, *c.devices.camera, c.config)});
  bind_device_routes(
      router, {*c.runner, *c.integrity, c.tasks, *c.pictures, c.config, c.device_roots, c.camera_trials, on_reactor,
               [&c](const std::string& who, const std::string& what, const std::string& detail) {
                 return c.change_audit->note_now(who, what, detail);
               },
               c.restart});
  const auto job_changed = [&c, on_reactor](JobId job) {
    on_reactor([&c, job] {
      c.runner->job_changed(job);
      c.refresh_counts();
      c.hub.broadcast({{"type", "job"}, {"job", job.value}});
    });
  };
  const auto leases_changed = [&c, on_reactor](const std::vector<PanelId>& panels) {
    on_reactor([&c, panels] { c.lease_clerk->changed(panels); });
  };
  bind_job_routes(router, {*c.plans, *c.planner_worker, c.config.planner, c.tasks, *c.runner, *c.runner, *c.database,
                           *c.queries, *c.pictures, c.panel_library, job_changed, leases_changed, c.config.laser});
  bind_plan_routes(router, {*c.plans, *c.planner_worker, c.config.planner, c.tasks, *c.database, *c.queries,
                            *c.pictures, *c.sketches, c.panel_library, leases_changed});
  bind_piece_routes(router, {*c.queries, *c.pictures, c.panel_library});
  bind_laser_routes(router, {*c.runner, *c.runner, c.runner->jogging(), c.runner->overrides(), c.tasks, c.config.recipe,
                             *c.pictures, on_reactor});
  bind_drawing_routes(router, {*c.runner, c.config.recipe, *c.sketches, *c.work_runner, c.config.store.data_dir});
  bind_recipe_routes(router,
                     {*c.runner, *c.runner, c.tasks, *c.database, *c.queries, *c.pictures, *c.sketches, *c.work_runner,
                      c.config, c.log, [panel_changed](const PanelId& panel) { panel_changed(panel); }});
  bind_metrics_routes(
      router, {c.metrics, [&c] {
                 return Metrics::Now{c.connections ? c.connections() : 0, c.hub.clients(), c.counts.panels, &c.alarms};
               }});
  bind_alarm_routes(router,
                    {c.alarms, c.config, [&c] { c.news->alarms_changed(); }, [&c] { return c.news->try_notices(); }});
  bind_store_routes(router, {*c.backups, *c.backup_disk, c.tasks, *c.backup_lists});
  bind_history_routes(router, *c.queries, c.config.laser);
  bind_task_routes(
      router, c.tasks, [&c](const TaskView& task, const Caller& by) { c.news->told(task, by); },
      [&c](nlohmann::json& told) {
        leave_out_places(told, c.devices.laser->status().why_not_connected, c.alarms, c.config.laser);
      });
}

}  // namespace veneer::daemon
