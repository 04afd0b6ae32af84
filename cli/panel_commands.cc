// panel scan|list|show|registration|ledger|scans|revert|retire|restore, calibrate, certificates.
#include <memory>
#include <optional>
#include <tuple>
#include <utility>

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

void leave_out_retired(json& reply) {
  json in_stock = json::array();
  int left_out = 0;
  for (json& panel : reply["panels"]) {
    if (panel.value("retired", json()).is_null())
      in_stock.push_back(std::move(panel));
    else
      ++left_out;
  }
  reply["panels"] = std::move(in_stock);
  reply["retired_left_out"] = left_out;
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

// Nothing seen is final: a scan can be taken back, a panel leave the stock.
void add_corrections(CLI::App& panel, CommandContext& context) {
  struct Options {
    std::string id, reason;
    std::optional<int> version;
  };
  const auto command = [&panel](const char* name, const char* help) {
    const auto options = std::make_shared<Options>();
    CLI::App* added = panel.add_subcommand(name, help);
    added->add_option("PANEL", options->id, "Its name, as in P-0001")->required();
    return std::pair(added, options);
  };
  const auto target = [](const Options& options, const char* what) {
    return "/panels/" + url_encode(options.id) + "/" + what;
  };

  const auto [scans, of_scans] = command("scans", "What its wood was seen as, scan by scan");
  scans->callback([of_scans = of_scans, target, &context] {
    context.finish(context.client().get(target(*of_scans, "masks")), render_masks);
  });

  const auto [revert, of_revert] =
      command("revert", "Take the last scan back: what the one before it showed counts again");
  revert->add_option("--to", of_revert->version, "Another one, as `panel scans` numbers them")
      ->check(CLI::PositiveNumber);
  revert->callback([of_revert = of_revert, target, &context] {
    json body = json::object();
    if (of_revert->version) body["version"] = *of_revert->version;
    context.finish(context.client().post(target(*of_revert, "revert"), body), render_reverted);
  });

  const auto [retire, of_retire] =
      command("retire", "Take a panel out of stock; its sheet can be scanned anew as another one");
  retire->add_option("--reason", of_retire->reason, "Why, as in \"the wrong face was scanned\"")->required();
  const auto [restore, of_restore] = command("restore", "Put a retired panel back into stock");
  restore->add_option("--reason", of_restore->reason, "Why");
  for (const auto& [added, options, what] :
       {std::tuple(retire, of_retire, "retire"), std::tuple(restore, of_restore, "restore")})
    added->callback([options = options, what = what, target, &context] {
      json body = json::object();
      if (!options->reason.empty()) body["reason"] = options->reason;
      context.finish(context.client().post(target(*options, what), body), render_retired);
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
  const auto retired_too = std::make_shared<bool>(false);
  CLI::App* list = panel->add_subcommand("list", "All panels in stock");
  list->add_flag("--all", *retired_too, "Retired ones too");
  list->callback([retired_too, &context] {
    auto all = context.client().get_all("/panels", "panels");
    if (all && !*retired_too) leave_out_retired(*all);
    context.finish(all, render_panels);
  });
  add_panel_show(*panel, context);
  add_corrections(*panel, context);
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
