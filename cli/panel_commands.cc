// panel list|show|label|registration|ledger|scans|revert|retire|restore|split|merge|differences|decide, calibrate,
// certificates.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "cli/command_context.h"
#include "cli/render.h"

namespace veneer::cli {
namespace {

using nlohmann::json;

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

void add_panel_list(CLI::App& panel, CommandContext& context) {
  struct Options {
    bool retired_too = false, dark = false, light = false;
    std::optional<double> min_free_cm2, patch_mm;
    std::string wood;
    std::vector<std::string> words;

    bool asks_for_wood() const { return min_free_cm2 || patch_mm || dark || light || !wood.empty(); }
    // What is looked for; "" when nothing is.
    std::string query() const {
      std::string text;
      const auto add = [&](const char* key, const std::string& value) {
        text += (text.empty() ? "?" : "&") + std::string(key) + "=" + url_encode(value);
      };
      if (!words.empty()) add("text", fmt::format("{}", fmt::join(words, " ")));
      if (min_free_cm2) add("min_free_mm2", fmt::format("{}", *min_free_cm2 * 100));
      if (!wood.empty()) add("wood", wood);
      if (dark || light) add("tone", dark ? "dark" : "light");
      if (patch_mm) add("patch_mm", fmt::format("{}", *patch_mm));
      return text;
    }
  };
  const auto options = std::make_shared<Options>();
  CLI::App* list = panel.add_subcommand("list", "All panels in stock, or those with the wood you look for");
  list->add_option("WORDS", options->words,
                   "Only panels whose number, name, shelf place, woods or parent hold all of these, as in walnut A3");
  CLI::Option* all = list->add_flag("--all", options->retired_too, "Retired ones too");
  list->add_option("--min-free", options->min_free_cm2,
                   "With at least this much free wood for a plan (FITTING), in cm2, counted as follows")
      ->check(number_from_zero())
      ->excludes(all);
  list->add_option("--material,--wood", options->wood, "Wood of this material only")->excludes(all);
  CLI::Option* dark = list->add_flag("--dark", options->dark, "Dark wood only (CIE L* of 50 at most)")->excludes(all);
  list->add_flag("--light", options->light, "Light wood only (CIE L* of 65 at least)")->excludes(all)->excludes(dark);
  list->add_option("--patch", options->patch_mm, "Only wood on which a square of this side fits, in mm")
      ->check(positive_number())
      ->excludes(all);
  list->callback([options, &context] {
    auto panels = context.client().get_all("/panels" + options->query(), "panels");
    if (options->asks_for_wood())
      return context.finish(panels, options->words.empty() ? render_found : render_named_found);
    if (panels && !options->retired_too) leave_out_retired(*panels);
    context.finish(panels, options->words.empty() ? render_panels : render_named_panels);
  });
}

bool is_jpeg(const std::string& file) { return file.ends_with(".jpg") || file.ends_with(".jpeg"); }

void add_panel_show(CLI::App& panel, CommandContext& context) {
  struct Options {
    std::string id, map, stock, remnant;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* show = panel.add_subcommand("show", "One panel");
  show->add_option("PANEL", options->id, "Its name, as in P-0001")->required();
  show->add_option("--map", options->map, "Save the veneer map: .jpg is smaller and soon there, else PNG");
  show->add_option("--stock", options->stock, "Save the picture of free, reserved and cut wood, as --map");
  show->add_option("--remnant", options->remnant, "Save the picture of what is left of it (PNG)");
  show->callback([options, &context] {
    const std::string target = "/panels/" + url_encode(options->id);
    const auto view = context.client().get(target);
    if (view)
      save_parts(context, target,
                 {{options->map, is_jpeg(options->map) ? "/map.jpg" : "/map.png"},
                  {options->stock, is_jpeg(options->stock) ? "/stock.jpg" : "/stock.png"},
                  {options->remnant, "/remnant.png"}});
    context.finish(view, render_panel);
  });
}

void add_panel_remnants(CLI::App& panel, CommandContext& context) {
  struct Options {
    std::string id, out;
    std::int64_t number = 0;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* command = panel.add_subcommand("remnants", "What was left of it after each run and each new mask");
  command->add_option("PANEL", options->id, "Its name, as in P-0001")->required();
  CLI::Option* picture =
      command->add_option("--picture", options->number, "Of this remnant, by its number, save the picture to --out");
  CLI::Option* out = command->add_option("--out", options->out, "Where the picture is saved (PNG)")->needs(picture);
  picture->needs(out);
  command->callback([options, &context] {
    const std::string target = "/panels/" + url_encode(options->id);
    const auto booked = context.client().get(target + "/remnants");
    if (booked)
      save_parts(context, target + "/remnant.png?booked=" + std::to_string(options->number), {{options->out, ""}});
    context.finish(booked, render_remnants);
  });
}

void add_panel_label(CLI::App& panel, CommandContext& context) {
  struct Options {
    std::string id, out;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* label =
      panel.add_subcommand("label", "A label to print: QR code, AprilTag, wood, free area, and what is left of it");
  label->add_option("PANEL", options->id, "Its name, as in P-0001")->required();
  label->add_option("--out", options->out, "The file: .pdf, .svg or .png")->required();
  label->callback([options, &context] {
    const std::string kind = std::filesystem::path(options->out).extension().string();
    if (kind != ".pdf" && kind != ".svg" && kind != ".png")
      fail({ErrorCode::kInvalidArgument, "a label is a .pdf, .svg or .png file: end its name with one of these"},
           kUnusableArguments);
    save_parts(context, "/panels/" + url_encode(options->id) + "/label?format=" + kind.substr(1), {{options->out, ""}});
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

  const auto [scans, of_scans] = command("scans", "What each scan saw as its wood");
  scans->callback([of_scans = of_scans, target, &context] {
    context.finish(context.client().get_all(target(*of_scans, "masks"), "versions"), render_masks);
  });

  const auto [revert, of_revert] =
      command("revert", "Take the last scan back: what the one before it showed counts again");
  revert->add_option("--to", of_revert->version, "Another one, as `panel scans` numbers them")
      ->check(positive_number());
  revert->callback([of_revert = of_revert, target, &context] {
    json body = json::object();
    if (of_revert->version) body["version"] = *of_revert->version;
    context.finish_step(context.client().post(target(*of_revert, "revert"), body), render_reverted);
  });

  const auto [retire, of_retire] =
      command("retire", "Take a panel out of stock; its sheet can be scanned anew as another one");
  retire->add_option("--reason", of_retire->reason, "Why, as in \"the wrong face was scanned\"")->required();
  const auto [restore, of_restore] = command("restore", "Put a retired panel back into stock");
  restore->add_option("--reason", of_restore->reason, "Why");
  const auto [split, of_split] =
      command("split", "It was sawn apart: scan each part that is to be stock, and it becomes a panel of its own");
  split->add_option("--reason", of_split->reason, "Why [sawn apart]");
  for (const auto& [added, options, what] :
       {std::tuple(retire, of_retire, "retire"), std::tuple(restore, of_restore, "restore"),
        std::tuple(split, of_split, "split")})
    added->callback([options = options, what = what, target, &context] {
      json body = json::object();
      if (!options->reason.empty()) body["reason"] = options->reason;
      context.finish_step(context.client().post(target(*options, what), body), render_retired);
    });
}

void add_merge(CLI::App& panel, CommandContext& context) {
  struct Options {
    std::string kept, merged;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* merge = panel.add_subcommand(
      "merge", "Two panels are one sheet: scanned twice as new, or once with its back as its show face");
  merge->add_option("KEPT", options->kept, "The panel that stays, as in P-0001")->required();
  merge->add_option("MERGED", options->merged, "The one that is the same sheet; it leaves the stock for good")
      ->required();
  merge->callback([options, &context] {
    context.finish_step(
        context.client().post("/panels/" + url_encode(options->kept) + "/merge", {{"merged", options->merged}}),
        render_merged);
  });
}

// What a scan and the ledger disagreed about stays until somebody decides.
void add_differences(CLI::App& panel, CommandContext& context) {
  struct Options {
    std::string id, verdict, note;
    std::int64_t number = 0;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* differences = panel.add_subcommand("differences", "What its scans and the ledger disagreed about");
  CLI::App* decide = panel.add_subcommand("decide", "Say what is to be done about a difference");
  for (CLI::App* command : {differences, decide})
    command->add_option("PANEL", options->id, "Its name, as in P-0001")->required();
  decide->add_option("NUMBER", options->number, "As `panel differences` numbers them")
      ->required()
      ->check(positive_number());
  decide
      ->add_option("VERDICT", options->verdict,
                   "written-off: the wood is gone for good, book it as scrap; accepted: leave things as they are")
      ->required()
      ->check(CLI::IsMember({"written-off", "accepted"}));
  decide->add_option("--note", options->note, "What you saw");
  const auto target = [options] { return "/panels/" + url_encode(options->id) + "/differences"; };
  differences->callback(
      [target, &context] { context.finish(context.client().get_all(target(), "differences"), render_differences); });
  decide->callback([options, target, &context] {
    json body = {{"verdict", options->verdict == "accepted" ? "accepted" : "written_off"}};
    if (!options->note.empty()) body["note"] = options->note;
    context.finish_step(context.client().post(target() + "/" + std::to_string(options->number) + "/decide", body),
                        render_differences);
  });
}

void add_certificates(CLI::App& app, CommandContext& context) {
  struct Options {
    std::optional<int> number;
    std::vector<double> at;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* certificates =
      app.add_subcommand("certificates", "Calibrations, until when they hold, and how far off they will be");
  auto* number = certificates->add_option("NUMBER", options->number, "Only this one")->check(CLI::PositiveNumber);
  certificates
      ->add_option("--at", options->at,
                   "X,Y: the error predicted there, in mm; on the glass right and down from a scan's upper left "
                   "corner, on the bed right and away from the machine's origin")
      ->delimiter(',')
      ->expected(2)
      ->needs(number);
  certificates->callback([options, &context] {
    if (!options->number)
      return context.finish(context.client().get_all("/certificates", "certificates"), render_certificates);
    std::string target = fmt::format("/certificates/{}", *options->number);
    if (!options->at.empty()) target += fmt::format("?x={}&y={}", options->at[0], options->at[1]);
    context.finish(context.client().get(target), render_certificate);
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
  calibrate
      ->add_option("--board-width-mm", options->board_width_mm,
                   "laser (required): how wide the board on the bed is, along x")
      ->check(positive_number());
  calibrate
      ->add_option("--board-height-mm", options->board_height_mm,
                   "laser (required): how high the board on the bed is, along y")
      ->check(positive_number());
  add_confirm_option(*calibrate, options->confirmed);
  calibrate->callback([options, &context] {
    json body = {{"more", options->more}};
    if (options->device == "laser" && (!options->board_width_mm || !options->board_height_mm))
      fail({ErrorCode::kInvalidArgument,
            "the size of the board is needed: measure both its sides with a rule and give them with "
            "--board-width-mm and --board-height-mm"});
    if (options->device == "laser") options->confirmed = seen_to_or_fail(context, options->confirmed);
    if (!options->confirmed.empty()) body["confirmed"] = options->confirmed;
    if (options->height_mm) body["height_mm"] = *options->height_mm;
    if (options->board_width_mm) body["board_width_mm"] = *options->board_width_mm;
    if (options->board_height_mm) body["board_height_mm"] = *options->board_height_mm;
    context.finish_step(context.run_task(context.client().post("/calibration/" + options->device, body)),
                        render_calibration);
  });
}

}  // namespace

void add_panel_commands(CLI::App& app, CommandContext& context) {
  CLI::App* panel = app.add_subcommand("panel", "Panels and remnants");
  panel->require_subcommand(1);
  add_proposal_commands(*panel, context);
  add_panel_list(*panel, context);
  add_panel_show(*panel, context);
  add_panel_label(*panel, context);
  add_panel_remnants(*panel, context);
  add_corrections(*panel, context);
  add_mask_commands(*panel, context);
  add_merge(*panel, context);
  add_differences(*panel, context);
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
  add_certificates(app, context);
}

}  // namespace veneer::cli
