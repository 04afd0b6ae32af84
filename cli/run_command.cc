// laser run FILE: burn a drawing as it is, on the laser alone.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <iostream>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "cli/command_context.h"
#include "cli/drawing_file.h"
#include "cli/json_read.h"
#include "cli/power.h"
#include "cli/run_command.h"
#include "planner/drawings/line_settings.h"

namespace veneer::cli {
namespace {

using nlohmann::json;
using planner::Drawing;
using planner::DrawingExtent;
using planner::DrawingPoint;
using planner::LineSetting;

struct RunOptions {
  std::string file;
  LineSetting all;
  std::vector<std::string> layers;
  std::optional<double> x_mm, y_mm;
  bool dry = false, check = false, no_dry = false;
  std::vector<std::string> confirmed;
};

Error bad_layer(const std::string& text) {
  return {ErrorCode::kInvalidArgument,
          fmt::format("--layer \"{}\" does not read: write NAME:power=50%,speed=20,passes=2,air=on, where NAME is a "
                      "layer or a colour as #ff0000",
                      text)};
}

std::optional<double> number_of(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// "engrave:power=0.2,speed=80".
Result<std::pair<std::string, LineSetting>> parse_layer(const std::string& text) {
  const auto colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0) return bad_layer(text);
  LineSetting setting;
  for (std::size_t at = colon + 1; at < text.size();) {
    const std::size_t end = std::min(text.find(',', at), text.size());
    const std::string entry = text.substr(at, end - at);
    const auto equals = entry.find('=');
    if (equals == std::string::npos) return bad_layer(text);
    const std::string key = entry.substr(0, equals), value = entry.substr(equals + 1);
    const auto number = number_of(value);
    if (key == "power") {
      const auto power = power_of(value);
      if (!power) return unusable(fmt::format("--layer \"{}\": power {}", text, power.error().message));
      setting.power = *power;
    } else if (key == "speed" && number)
      setting.speed_mm_s = *number;
    else if (key == "passes" && number && *number == static_cast<int>(*number))
      setting.passes = static_cast<int>(*number);
    else if (key == "air" && (value == "on" || value == "off"))
      setting.air = value == "on";
    else
      return bad_layer(text);
    at = end + 1;
  }
  return std::pair(text.substr(0, colon), setting);
}

// As --layer says for each.
Result<planner::NamedSettings> named_settings(const RunOptions& options) {
  planner::NamedSettings named;
  for (const std::string& text : options.layers) {
    auto layer = parse_layer(text);
    if (!layer.ok()) return layer.error();
    named.insert(std::move(*layer));
  }
  return named;
}

// The configuration's, by the layers that have them.
planner::NamedSettings recipes_of(const json& recipes) {
  planner::NamedSettings out;
  for (const auto& [layer, recipe] : member(recipes, "otherwise").items())
    if (recipe.is_object())
      out[layer] = {number_or(recipe, "power", 0), number_or(recipe, "speed_mm_s", 1), std::nullopt, std::nullopt};
  return out;
}

Status require_told(const Drawing& drawing, const std::vector<LineSetting>& settings) {
  const std::set<std::string> unknown = planner::untold(drawing, settings);
  if (unknown.empty()) return Ok();
  return Error{ErrorCode::kInvalidArgument,
               fmt::format("nothing says how to burn {}: give --power and --speed-mm-s, or --layer "
                           "NAME:power=50%,speed=20 for each",
                           fmt::join(unknown, ", "))};
}

// As the API takes it: flat lists, one number for each stroke.
json body_of(const Drawing& drawing, const std::vector<LineSetting>& settings, DrawingPoint move) {
  json points = json::array(), strokes = json::array(), speeds = json::array(), powers = json::array(),
       passes = json::array(), air = json::array();
  for (std::size_t i = 0; i < settings.size(); ++i) {
    for (const DrawingPoint& point : drawing.lines[i].points)
      for (const double value : planner::moved(point, move)) points.push_back(value);
    strokes.push_back(drawing.lines[i].points.size());
    speeds.push_back(settings[i].speed_mm_s.value_or(0));
    powers.push_back(settings[i].power.value_or(0));
    passes.push_back(settings[i].passes.value_or(1));
    air.push_back(settings[i].air.value_or(false) ? 1 : 0);
  }
  return {{"points_mm", std::move(points)}, {"strokes", std::move(strokes)}, {"speeds_mm_s", std::move(speeds)},
          {"powers", std::move(powers)},    {"passes", std::move(passes)},   {"air", std::move(air)}};
}

// Where it will be, before anything moves.
void show(const Drawing& drawing, DrawingPoint move) {
  const DrawingExtent e = extent_of(drawing);
  std::cerr << fmt::format(
      "{} lines of {} points, {:.0f} mm to burn; x {:.1f} to {:.1f} mm, y {:.1f} to {:.1f} mm on "
      "the bed ({:.1f} x {:.1f} mm)\n",
      drawing.lines.size(), points_of(drawing), length_of(drawing), e.min_x + move[0], e.max_x + move[0],
      e.min_y + move[1], e.max_y + move[1], e.max_x - e.min_x, e.max_y - e.min_y);
  for (const std::string& warning : drawing.warnings) std::cerr << "note: " << warning << '\n';
}

std::string render_run(const json& result) {
  const bool check = flag_or(result, "check", false), dry = flag_or(result, "dry", false);
  const std::string what = check ? "The controller would take every line of it; nothing moved."
                           : dry ? "It was run with the beam off; nothing is burnt."
                                 : "It is burnt.";
  const double seconds = number_or(result, "seconds", 0);
  if (!(seconds > 0) || check) return what + "\n";
  const auto points = static_cast<double>(whole_or(result, "points", 0));
  return fmt::format("{} {:.0f} points in {:.1f} s, {:.0f} a second.\n", what, points, seconds, points / seconds);
}

void run_file(const RunOptions& options, const CommandContext& context) {
  auto text = read_file(options.file);
  if (!text) fail(text.error(), kUnusableArguments);
  auto drawing = read_drawing(options.file, *text);
  if (!drawing) fail(drawing.error(), kUnusableArguments);
  const DrawingPoint move = planner::move_to_corner(*drawing, options.x_mm, options.y_mm);
  const auto named = named_settings(options);
  if (!named) fail(named.error(), kUnusableArguments);
  auto settings = planner::settings_of(*drawing, options.all, *named);
  if (!settings) fail(settings.error(), kUnusableArguments);
  const auto recipes = context.client().get_all("/recipes", "recipes");
  if (!recipes) fail(recipes.error());
  planner::fill_from_recipes(*drawing, recipes_of(*recipes), *settings);
  if (const Status told = require_told(*drawing, *settings); !told) fail(told.error(), kUnusableArguments);
  show(*drawing, move);
  json body = body_of(*drawing, *settings, move);
  const auto run = [&](bool dry, bool check) {
    body["dry"] = dry;
    body["check"] = check;
    return context.run_task(context.client().post("/laser/run", body));
  };
  if (options.dry || options.check) return context.finish_step(run(options.dry, options.check), render_run);
  std::vector<std::string> confirmed = options.confirmed;
  if (!at_terminal()) confirmed = seen_to_or_fail(context, confirmed);  // before anything moves for nothing
  if (!options.no_dry) {
    std::cerr << "First with the beam off. Watch that the head stays over the material.\n";
    if (const auto dry = run(true, false); !dry) return context.finish(dry, render_run);
  }
  if (at_terminal()) {
    const std::vector<std::string> all = seen_to_or_fail(context, confirmed, "Now with the beam on.");
    // Who watched the dry run says what it showed, also when nothing else is asked.
    if (!options.no_dry && all == confirmed && confirmed.empty() && !yes("Now with the beam on?"))
      fail({ErrorCode::kCancelled, "nothing was burnt"});
    confirmed = all;
  }
  body["confirmed"] = confirmed;
  context.finish_step(run(false, false), render_run);
}

}  // namespace

void add_run_command(CLI::App& laser, CommandContext& context) {
  const auto options = std::make_shared<RunOptions>();
  CLI::App* command = laser.add_subcommand(
      "run",
      "Burn a drawing as it is: an SVG's lines, or strokes as JSON. The whole file is checked, its bounds are shown, "
      "and it is run with the beam off before it is burnt");
  command->add_option("FILE", options->file, "The drawing: .svg, else JSON")->required();
  add_power_option(
      *command, "--power", [options](double power) { options->all.power = power; },
      "Power of the beam, as in 60% of the rated one");
  command->add_option("--speed-mm-s", options->all.speed_mm_s, "Speed of burning")->check(positive_number());
  command->add_option("--passes", options->all.passes, "How often each line is burnt")->check(CLI::Range(1, 20));
  command->add_flag_callback(
      "--air", [options] { options->all.air = true; }, "With air assist");
  command
      ->add_option("--layer", options->layers,
                   "How the lines of a layer or a colour are burnt, as often as needed: "
                   "NAME:power=50%,speed=20,passes=2,air=on. Layers called cut and engrave have the configuration's "
                   "recipe")
      ->take_all();
  CLI::Option* x =
      command->add_option("--x-mm", options->x_mm,
                          "Where the lines' lower left corner lies on the bed [the page's lower left corner "
                          "is the bed's]");
  CLI::Option* y = command->add_option("--y-mm", options->y_mm, "As --x-mm");
  x->needs(y);
  y->needs(x);
  CLI::Option* dry = command->add_flag("--dry", options->dry, "Only with the beam off");
  CLI::Option* check = command->add_flag("--check", options->check,
                                         "Only let the controller read it ($C); nothing moves after homing. Not with a "
                                         "Lihuiyu board: there, --dry");
  CLI::Option* no_dry = command->add_flag("--no-dry", options->no_dry, "Burn it without the run before");
  dry->excludes(check)->excludes(no_dry);
  check->excludes(no_dry);
  add_confirm_option(*command, options->confirmed);
  command->callback([options, &context] { run_file(*options, context); });
}

}  // namespace veneer::cli
