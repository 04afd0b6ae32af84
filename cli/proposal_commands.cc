// panel scan|proposals|accept|refuse: what is seen, and what becomes of it.
#include <fmt/format.h>

#include <cstdint>
#include <memory>
#include <optional>

#include "cli/command_context.h"
#include "cli/json_read.h"
#include "cli/render.h"

namespace veneer::cli {
namespace {

using nlohmann::json;

void add_override(CLI::App& command, std::vector<std::string>& overruled) {
  command
      .add_option("--override", overruled,
                  "Overrule this warning, after you looked into it: its name, as in --override strip-1 (repeatable). "
                  "Where that would take doubtful wood into use, it needs a maintainer")
      ->allow_extra_args(false);
}

std::string picture_of(const std::string& number) { return "/proposals/" + number + "/picture.png?width=1600"; }

void add_scan(CLI::App& panel, CommandContext& context) {
  struct Options {
    std::string face = "show";
    std::string panel, part_of, picture;
    bool more = false, anew = false, accept = false, retag = false;
    std::optional<int> again;
    std::vector<std::string> overruled;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* scan = panel.add_subcommand("scan", "Scan what lies on the glass");
  scan->add_option("--face", options->face, "The face that lies on the glass")->check(CLI::IsMember({"show", "back"}));
  scan->add_option("--panel", options->panel, "A known panel: adds its other face, or compares it with the ledger");
  scan->add_option("--part-of", options->part_of,
                   "The panel that this part was sawn from; needed only where none of its tags is left on the part");
  CLI::Option* more =
      scan->add_flag("--more", options->more,
                     "The panel is larger than the glass, and more tiles of it follow; leave this out at the last one");
  CLI::Option* again = scan->add_option("--again", options->again,
                                        "Scan this tile of a refused series again, counted from 1; the others are kept")
                           ->check(CLI::Range(1, 1000))
                           ->excludes(more);
  scan->add_flag("--anew", options->anew, "Discard the tiles scanned so far, and begin again with this one")
      ->excludes(again);
  scan->add_flag("--retag", options->retag, "Tags that this panel never had were newly glued on, and become its own");
  scan->add_flag("--accept", options->accept, "Take it into stock at once, unless it has warnings")->excludes(more);
  add_override(*scan, options->overruled);
  scan->add_option("--picture", options->picture, "Save the picture of what waits to be accepted (PNG)");
  scan->callback([options, &context] {
    json body = {{"face", options->face}, {"more", options->more}};
    if (!options->panel.empty()) body["panel"] = options->panel;
    if (!options->part_of.empty()) body["part_of"] = options->part_of;
    if (options->again) body["again"] = *options->again;
    if (options->anew) body["anew"] = true;
    if (options->retag) body["retag"] = true;
    // Who overrules a warning means to accept.
    const bool accept = options->accept || !options->overruled.empty();
    if (accept) body["accept"] = true;
    if (!options->overruled.empty()) body["override"] = options->overruled;
    const auto seen = context.run_task(context.client().post("/scans", body));
    const json waiting = seen ? member(*seen, "proposal") : json();
    if (waiting.is_number() && !options->picture.empty())
      save_parts(context, picture_of(std::to_string(waiting.get<std::int64_t>())), {{options->picture, ""}});
    context.finish_step(seen, render_scan_result);
    if (accept && waiting.is_number())
      fail({ErrorCode::kRefused,
            fmt::format("proposal {0} has warnings, and is not in stock: look at it, then accept it "
                        "with --override and their names, or `veneerctl panel refuse {0}`",
                        waiting.get<std::int64_t>())});
  });
}

void add_proposals(CLI::App& panel, CommandContext& context) {
  struct Options {
    std::optional<std::int64_t> number;
    bool all = false;
    std::string picture;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* proposals = panel.add_subcommand("proposals", "Scans that wait to be accepted or refused");
  CLI::Option* number =
      proposals->add_option("NUMBER", options->number, "One of them, with its warnings")->check(CLI::PositiveNumber);
  proposals->add_flag("--all", options->all, "Decided ones too")->excludes(number);
  proposals->add_option("--picture", options->picture, "Save its picture (PNG)")->needs(number);
  proposals->callback([options, &context] {
    if (!options->number)
      return context.finish(
          context.client().get_all(std::string("/proposals") + (options->all ? "?all=true" : ""), "proposals"),
          render_proposals);
    const std::string one = std::to_string(*options->number);
    const auto proposal = context.client().get("/proposals/" + one);
    if (proposal && !options->picture.empty()) save_parts(context, picture_of(one), {{options->picture, ""}});
    context.finish(proposal, render_proposal);
  });
}

void add_decisions(CLI::App& panel, CommandContext& context) {
  struct Options {
    std::int64_t number = 0;
    std::vector<std::string> overruled, wood, no_wood;
    std::string note;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* accept = panel.add_subcommand("accept", "Take what a scan showed into stock");
  CLI::App* refuse = panel.add_subcommand("refuse", "Drop a scan: the stock stays as it is");
  for (CLI::App* command : {accept, refuse})
    command->add_option("NUMBER", options->number, "As `panel proposals` numbers them")
        ->required()
        ->check(CLI::PositiveNumber);
  add_override(*accept, options->overruled);
  accept->add_option("--wood", options->wood, "A strip that it asks about is wood: strip-1, say (repeatable)")
      ->allow_extra_args(false);
  accept->add_option("--no-wood", options->no_wood, "A strip that it asks about is no wood (repeatable)")
      ->allow_extra_args(false);
  refuse->add_option("--note", options->note, "Why");
  const auto target = [options](const char* what) {
    return "/proposals/" + std::to_string(options->number) + "/" + what;
  };
  accept->callback([options, target, &context] {
    json body = json::object();
    if (!options->overruled.empty()) body["override"] = options->overruled;
    if (!options->wood.empty()) body["wood"] = options->wood;
    if (!options->no_wood.empty()) body["no_wood"] = options->no_wood;
    context.finish_step(context.run_task(context.client().post(target("accept"), body)), render_scan_result);
  });
  refuse->callback([options, target, &context] {
    json body = json::object();
    if (!options->note.empty()) body["note"] = options->note;
    context.finish_step(context.run_task(context.client().post(target("refuse"), body)), render_refused);
  });
}

}  // namespace

void add_proposal_commands(CLI::App& panel, CommandContext& context) {
  add_scan(panel, context);
  add_proposals(panel, context);
  add_decisions(panel, context);
}

}  // namespace veneer::cli
