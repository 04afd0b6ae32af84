// recipe list|set|remove|card, panel material, job export.
#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/command_context.h"
#include "cli/json_read.h"
#include "cli/power.h"
#include "cli/render.h"

namespace veneer::cli {
namespace {

using nlohmann::json;

bool ends_with(const std::string& text, std::string_view end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

std::string recipe_target(const std::string& material, const std::string& operation) {
  return "/recipes/" + url_encode(material) + "/" + operation;
}

void add_set(CLI::App& recipe, CommandContext& context) {
  struct Options {
    std::string material, operation;
    double speed_mm_s = 0, power = 0;
    int passes = 1;
    bool no_air = false;
    std::optional<double> kerf_back_mm, kerf_show_mm;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* set = recipe.add_subcommand("set", "How a material is cut or engraved");
  set->add_option("MATERIAL", options->material, "Its name, as in walnut")->required();
  set->add_option("OPERATION", options->operation, "cut or engrave")
      ->required()
      ->check(CLI::IsMember({"cut", "engrave"}));
  set->add_option("--speed-mm-s", options->speed_mm_s, "Speed of the head")->required()->check(positive_number());
  add_power_option(
      *set, "--power", [options](double power) { options->power = power; },
      "Power of the beam, as in 60% of the rated one")
      ->required();
  set->add_option("--passes", options->passes, "How often the path is burnt")->capture_default_str();
  set->add_flag("--no-air", options->no_air, "Without air assist");
  set->add_option("--kerf-back-mm", options->kerf_back_mm,
                  "cut: full width burnt away on the back [the kerf certificate's]");
  set->add_option("--kerf-show-mm", options->kerf_show_mm, "cut: as --kerf-back-mm, on the show face");
  set->callback([options, &context] {
    json body = {{"speed_mm_s", options->speed_mm_s},
                 {"power", options->power},
                 {"passes", options->passes},
                 {"air", !options->no_air}};
    if (options->kerf_back_mm) body["kerf_back_mm"] = *options->kerf_back_mm;
    if (options->kerf_show_mm) body["kerf_show_mm"] = *options->kerf_show_mm;
    context.finish_step(context.client().post(recipe_target(options->material, options->operation), body),
                        [](const json& set_recipe) {
                          return render_recipes({{"recipes", {set_recipe}}});
                        });
  });
}

void add_remove(CLI::App& recipe, CommandContext& context) {
  const auto names = std::make_shared<std::pair<std::string, std::string>>();
  CLI::App* remove = recipe.add_subcommand("remove", "Forget a recipe; the configuration's counts again");
  remove->add_option("MATERIAL", names->first, "Its name")->required();
  remove->add_option("OPERATION", names->second, "cut or engrave")
      ->required()
      ->check(CLI::IsMember({"cut", "engrave"}));
  remove->callback([names, &context] {
    context.finish_step(context.client().request("DELETE", recipe_target(names->first, names->second), "", ""),
                        [names](const json&) {
                          return fmt::format("The recipe of {}, {}, is removed.\n", names->first, names->second);
                        });
  });
}

void write_or_fail(const std::string& file, const std::string& bytes) {
  if (const Status written = write_file(file, bytes); !written) fail(written.error());
}

void add_card(CLI::App& recipe, CommandContext& context) {
  struct Options {
    std::string operation = "cut", out;
    std::vector<double> powers, speeds_mm_s;
    int passes = 1;
    std::optional<double> side_mm, x_mm, y_mm;
    bool no_air = false, burn = false, dry = false;
    std::vector<std::string> confirmed;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* card = recipe.add_subcommand(
      "card", "A test card for a material: a field for every power and speed. --out draws it, --burn burns it");
  card->add_option("OPERATION", options->operation, "cut (squares to fall out) or engrave (filled squares)")
      ->check(CLI::IsMember({"cut", "engrave"}))
      ->capture_default_str();
  add_powers_option(*card, "--powers", options->powers, "As in 20%,40%,60% of the rated power: one row each");
  card->add_option("--speeds-mm-s", options->speeds_mm_s, "One column each")->delimiter(',');
  card->add_option("--passes", options->passes, "cut: how often each square is burnt")->capture_default_str();
  card->add_option("--side-mm", options->side_mm, "Side of a field [8]");
  CLI::Option* x = card->add_option("--x-mm", options->x_mm, "Its lower left corner [the middle of the bed]");
  CLI::Option* y = card->add_option("--y-mm", options->y_mm, "As --x-mm");
  x->needs(y);
  y->needs(x);
  card->add_flag("--no-air", options->no_air, "Without air assist");
  card->add_option("--out", options->out,
                   "Write FILE.svg, to look at, or FILE.egv, for a Lihuiyu board (as --help of `job export` says)");
  card->add_flag("--burn", options->burn, "Burn it now; the laser is homed first. It moves and burns");
  card->add_flag("--dry", options->dry, "With --burn: the beam stays off");
  add_confirm_option(*card, options->confirmed);
  card->callback([options, &context] {
    const bool egv = ends_with(options->out, ".egv");
    if (options->out.empty() == !options->burn)
      fail({ErrorCode::kInvalidArgument, "say either --out FILE or --burn"}, kUnusableArguments);
    if (!options->burn && !egv && !ends_with(options->out, ".svg"))
      fail({ErrorCode::kInvalidArgument, options->out + " ends neither in .svg nor in .egv"}, kUnusableArguments);
    json body = {{"operation", options->operation}, {"passes", options->passes}, {"air", !options->no_air}};
    if (!options->powers.empty()) body["powers"] = options->powers;
    if (!options->speeds_mm_s.empty()) body["speeds_mm_s"] = options->speeds_mm_s;
    if (options->side_mm) body["side_mm"] = *options->side_mm;
    if (options->x_mm) body["x_mm"] = *options->x_mm, body["y_mm"] = *options->y_mm;
    if (options->burn) {
      body["dry"] = options->dry;
      body["confirmed"] = options->dry ? options->confirmed : seen_to_or_fail(context, options->confirmed);
      return context.finish_step(
          context.run_task(context.client().post("/laser/test-card", body)), [](const json& result) {
            return std::string(flag_or(result, "dry", false) ? "The card ran with the beam off.\n"
                                                             : "The card is burnt.\n");
          });
    }
    const auto drawn = context.client().post("/test-card", body);
    if (drawn) write_or_fail(options->out, text_or(*drawn, egv ? "egv" : "svg", ""));
    context.finish(drawn, [file = options->out](const json& result) {
      return fmt::format("{}: {:.0f} x {:.0f} mm\n", file, number_or(result, "width_mm", 0),
                         number_or(result, "height_mm", 0));
    });
  });
}

void add_material(CLI::App& panel, CommandContext& context) {
  struct Options {
    std::string id, material;
    std::optional<int> zone;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* command =
      panel.add_subcommand("material", "Say which material a panel is made of, so that its recipe is taken");
  command->add_option("PANEL", options->id, "Its name")->required();
  command->add_option("MATERIAL", options->material, "As in `recipe set`")->required();
  command->add_option("--zone", options->zone, "Only this strip, counted from the left; see `panel show`");
  command->callback([options, &context] {
    json body = {{"material", options->material}};
    if (options->zone) body["zone"] = *options->zone;
    context.finish_step(context.client().post("/panels/" + url_encode(options->id) + "/material", body), render_zones);
  });
}

void add_export(CLI::App& job, CommandContext& context) {
  struct Options {
    int id = 0;
    std::string panel, out;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* command = job.add_subcommand(
      "export",
      "The cuts of one panel as a file for a Lihuiyu board, panel back up, its upper left corner at home. The format "
      "carries no power: the tube burns with what is set at the machine's panel, pulsed for the wanted share of the "
      "way");
  command->add_option("JOB", options->id, "Its number")->required();
  command->add_option("--panel", options->panel, "Which panel")->required();
  command->add_option("--out", options->out, "FILE.egv")->required();
  command->callback([options, &context] {
    if (!ends_with(options->out, ".egv"))
      fail({ErrorCode::kInvalidArgument, options->out + " does not end in .egv"}, kUnusableArguments);
    const auto file =
        context.client().get_bytes(fmt::format("/jobs/{}/cut.egv?panel={}", options->id, url_encode(options->panel)));
    if (!file) fail(file.error());
    write_or_fail(options->out, *file);
  });
}

}  // namespace

void add_recipe_commands(CLI::App& app, CommandContext& context) {
  CLI::App* recipe = app.add_subcommand("recipe", "How each material is cut and engraved");
  recipe->require_subcommand(1);
  recipe->add_subcommand("list", "All recipes")->callback([&context] {
    context.finish(context.client().get_all("/recipes", "recipes"), render_recipes);
  });
  add_set(*recipe, context);
  add_remove(*recipe, context);
  add_card(*recipe, context);
  add_material(*app.get_subcommand("panel"), context);
  add_export(*app.get_subcommand("job"), context);
}

}  // namespace veneer::cli
