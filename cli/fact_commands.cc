// material set|show|list, panel set.
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "cli/command_context.h"
#include "cli/render.h"

namespace veneer::cli {
namespace {

using nlohmann::json;

void add_material_set(CLI::App& material, CommandContext& context) {
  struct Options {
    std::string material;
    std::optional<std::string> botanical_name, origin, cites, supplier;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* set = material.add_subcommand("set", "Note what is known of a wood; what is not named stays as it was");
  set->add_option("MATERIAL", options->material, "Its name, as in `panel material`")->required();
  set->add_option("--botanical-name", options->botanical_name, "As in \"Juglans regia\"; \"\" takes it back");
  set->add_option("--origin", options->origin, "Where it grew; \"\" takes it back");
  set->add_option("--cites", options->cites, "not-listed, or the appendix: I, II, III; \"\" takes it back")
      ->check(CLI::IsMember({"", "not-listed", "I", "II", "III"}));
  set->add_option("--supplier", options->supplier, "Who sold it; \"\" takes it back");
  set->callback([options, &context] {
    json body = json::object();
    if (options->cites == "not-listed") options->cites = "not_listed";
    for (const auto& [key, value] : {std::pair("botanical_name", &options->botanical_name),
                                     {"origin", &options->origin},
                                     {"cites", &options->cites},
                                     {"supplier", &options->supplier}})
      if (*value) body[key] = **value;
    context.finish_step(context.client().post("/materials/" + url_encode(options->material), body), render_material);
  });
}

void add_panel_set(CLI::App& panel, CommandContext& context) {
  struct Options {
    std::string id;
    std::optional<std::string> shelf, sanded, finished, day;
    std::optional<double> veneer_mm, substrate_mm;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* set = panel.add_subcommand(
      "set",
      "Note where a panel lies, how thick it is, and what was done to its surface. After sanding or finishing it "
      "looks different: nothing is planned from it until its next scan");
  set->add_option("PANEL", options->id, "Its name, as in P-0001")->required();
  set->add_option("--shelf", options->shelf, "Where it lies; \"\" takes it back");
  set->add_option("--veneer-mm", options->veneer_mm, "How thick the veneer is")->check(positive_number());
  set->add_option("--substrate-mm", options->substrate_mm, "How thick the board is that it is glued to")
      ->check(positive_number());
  set->add_option("--sanded", options->sanded, "With what, as in \"grit 240\"");
  set->add_option("--finished", options->finished, "With what, as in shellac");
  set->add_option("--day", options->day, "The day when that was done, as in 2026-05-01 [now]");
  set->callback([options, &context] {
    json body = json::object();
    for (const auto& [key, value] : {std::pair("shelf", &options->shelf),
                                     {"sanded", &options->sanded},
                                     {"finished", &options->finished},
                                     {"day", &options->day}})
      if (*value) body[key] = **value;
    if (options->veneer_mm) body["veneer_mm"] = *options->veneer_mm;
    if (options->substrate_mm) body["substrate_mm"] = *options->substrate_mm;
    context.finish_step(context.client().post("/panels/" + url_encode(options->id) + "/facts", body),
                        render_panel_facts);
  });
}

}  // namespace

void add_fact_commands(CLI::App& app, CommandContext& context) {
  CLI::App* material = app.add_subcommand("material", "What is known of each wood");
  material->require_subcommand(1);
  material->add_subcommand("list", "All of them")->callback([&context] {
    context.finish(context.client().get_all("/materials", "materials"), render_materials);
  });
  const auto name = std::make_shared<std::string>();
  CLI::App* show = material->add_subcommand("show", "One of them, and what was noted before");
  show->add_option("MATERIAL", *name, "Its name")->required();
  show->callback(
      [name, &context] { context.finish(context.client().get("/materials/" + url_encode(*name)), render_material); });
  add_material_set(*material, context);
  add_panel_set(*app.get_subcommand("panel"), context);
}

}  // namespace veneer::cli
