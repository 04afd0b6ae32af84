// panel scan|list|show|ledger, calibrate, certificates.
#include <memory>
#include <optional>

#include "cli/command_context.h"
#include "cli/render.h"

namespace veneer::cli {
namespace {

using nlohmann::json;

void add_scan(CLI::App& panel, CommandContext& context) {
  struct Options {
    std::string face = "show";
    std::string panel;
    bool more = false;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* scan = panel.add_subcommand("scan", "Scan what lies on the glass");
  scan->add_option("--face", options->face, "The face that lies on the glass")->check(CLI::IsMember({"show", "back"}));
  scan->add_option("--panel", options->panel, "A known panel: adds its other face, or compares it with the ledger");
  scan->add_flag("--more", options->more, "More parts of the same panel follow; leave it out for the last one");
  scan->callback([options, &context] {
    json body = {{"face", options->face}, {"more", options->more}};
    if (!options->panel.empty()) body["panel"] = options->panel;
    context.finish(context.run_task(context.client().post("/scans", body)), render_scan_result);
  });
}

void add_panel_show(CLI::App& panel, CommandContext& context) {
  struct Options {
    std::string id, map, stock;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* show = panel.add_subcommand("show", "One panel");
  show->add_option("PANEL", options->id, "Its name, as in P-0001")->required();
  show->add_option("--map", options->map, "Save the veneer map (PNG)");
  show->add_option("--stock", options->stock, "Save the picture of free, reserved and cut wood (PNG)");
  show->callback([options, &context] {
    const std::string target = "/panels/" + url_encode(options->id);
    const auto view = context.client().get(target);
    if (view) save_parts(context, target, {{options->map, "/map.png"}, {options->stock, "/stock.png"}});
    context.finish(view, render_panel);
  });
}

void add_calibrate(CLI::App& app, CommandContext& context) {
  struct Options {
    std::string device;
    bool more = false;
    std::optional<double> height_mm, board_width_mm, board_height_mm;
    std::vector<std::string> confirmed;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* calibrate = app.add_subcommand("calibrate", "Calibrate a device from pictures or a burnt pattern");
  calibrate->add_option("DEVICE", options->device, "scanner, camera, laser or kerf")
      ->required()
      ->check(CLI::IsMember({"scanner", "camera", "laser", "kerf"}));
  calibrate->add_flag("--more", options->more, "More pictures follow; leave it out for the last one");
  calibrate->add_option("--height-mm", options->height_mm,
                        "Height above the bed: of the sheet's printed face (camera), of the board's face (laser)");
  calibrate->add_option("--board-width-mm", options->board_width_mm, "laser: how wide the board on the bed is, along x")
      ->check(CLI::PositiveNumber);
  calibrate
      ->add_option("--board-height-mm", options->board_height_mm, "laser: how high the board on the bed is, along y")
      ->check(CLI::PositiveNumber);
  add_confirm_option(*calibrate, options->confirmed);
  calibrate->callback([options, &context] {
    json body = {{"more", options->more}};
    if (options->device == "laser") options->confirmed = seen_to_or_fail(context, options->confirmed);
    if (!options->confirmed.empty()) body["confirmed"] = options->confirmed;
    if (options->height_mm) body["height_mm"] = *options->height_mm;
    if (options->board_width_mm) body["board_width_mm"] = *options->board_width_mm;
    if (options->board_height_mm) body["board_height_mm"] = *options->board_height_mm;
    context.finish(context.run_task(context.client().post("/calibration/" + options->device, body)),
                   render_calibration);
  });
}

}  // namespace

void add_panel_commands(CLI::App& app, CommandContext& context) {
  CLI::App* panel = app.add_subcommand("panel", "Panels and remnants");
  panel->require_subcommand(1);
  add_scan(*panel, context);
  panel->add_subcommand("list", "All panels")->callback([&context] {
    context.finish(context.client().get_all("/panels", "panels"), render_panels);
  });
  add_panel_show(*panel, context);
  for (const char* part : {"registration", "ledger"}) {
    const auto id = std::make_shared<std::string>();
    const bool ledger = std::string_view(part) == "ledger";
    CLI::App* command = panel->add_subcommand(part, ledger ? "Every allocation of its wood" : "How well its scans fit");
    command->add_option("PANEL", *id, "Its name")->required();
    command->callback([id, part, ledger, &context] {
      const std::string target = "/panels/" + url_encode(*id) + "/" + part;
      context.finish(context.client().get_all(target, ledger ? "allocations" : "scans"),
                     ledger ? render_ledger : render_registration);
    });
  }
  add_calibrate(app, context);
  app.add_subcommand("certificates", "Calibrations and until when they hold")->callback([&context] {
    context.finish(context.client().get_all("/certificates", "certificates"), render_certificates);
  });
}

}  // namespace veneer::cli
