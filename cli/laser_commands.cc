// laser test-pattern|run|jog|here|override.
#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/command_context.h"
#include "cli/json_read.h"
#include "cli/power.h"
#include "cli/run_command.h"

namespace veneer::cli {
namespace {

using nlohmann::json;

std::string render_pattern(const json& result) {
  const bool check = result.value("check", false), dry = result.value("dry", false);
  return fmt::format("{}\n", check ? "The controller would take every line of the test pattern; nothing moved."
                             : dry ? "The test pattern was run with the beam off; nothing is burnt."
                                   : "The test pattern is burnt. Measure it: the square is as wide as it is high, its "
                                     "diagonals are equal, ticks stand every 5 mm.");
}

std::string render_jog(const json&) { return "The head is on its way, dark. `veneerctl laser jog --stop` ends it.\n"; }
std::string render_stop(const json&) { return "The jog ends.\n"; }
std::string render_corner(const json&) { return "The corner is where the head stands; Reset brings it back there.\n"; }

std::string render_overrides(const json& reply) {
  const json& wanted = member(reply, "overrides_wanted");
  return fmt::format("Feed {} %, rapid {} %, power {} % of what is asked for, until the job or pattern ends.\n",
                     whole_or(wanted, "feed", 100), whole_or(wanted, "rapid", 100), whole_or(wanted, "power", 100));
}

void add_test_pattern(CLI::App& laser, CommandContext& context) {
  struct Options {
    double size_mm = 50;
    std::optional<double> x_mm, y_mm;
    bool dry = false, check = false;
    std::vector<std::string> confirmed;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* command = laser.add_subcommand(
      "test-pattern", "Home the laser and burn a test pattern to measure; needs nothing of the cell but its laser");
  command->add_option("--size-mm", options->size_mm, "Side of its square")
      ->check(positive_number())
      ->capture_default_str();
  CLI::Option* x = command->add_option("--x-mm", options->x_mm,
                                       "Its lower left corner [the middle of the bed; without homing switches the "
                                       "corner the laser was given]");
  CLI::Option* y = command->add_option("--y-mm", options->y_mm, "As --x-mm");
  x->needs(y);
  y->needs(x);
  command->add_flag("--dry", options->dry, "Run it with the beam off (S0)");
  command->add_flag("--check", options->check,
                    "Let the controller read it ($C); nothing moves after homing. Not with a "
                    "Lihuiyu board: there, --dry");
  add_confirm_option(*command, options->confirmed);
  command->callback([options, &context] {
    if (!options->dry && !options->check) options->confirmed = seen_to_or_fail(context, options->confirmed);
    json body = {{"size_mm", options->size_mm},
                 {"dry", options->dry},
                 {"check", options->check},
                 {"confirmed", options->confirmed}};
    if (options->x_mm) body["x_mm"] = *options->x_mm;
    if (options->y_mm) body["y_mm"] = *options->y_mm;
    context.finish_step(context.run_task(context.client().post("/laser/test-pattern", body)), render_pattern);
  });
}

void add_jog(CLI::App& laser, CommandContext& context) {
  struct Options {
    double x = 0, y = 0, speed = 50;
    bool stop = false;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* jog = laser.add_subcommand("jog", "Move the head, dark, while no job runs");
  jog->add_option("--x-mm", options->x, "How far to the right, in millimetres; negative: to the left");
  jog->add_option("--y-mm", options->y,
                  "How far away from the operator, in millimetres; negative: towards the operator");
  jog->add_option("--speed-mm-s", options->speed, "Speed of the head, dark")
      ->check(positive_number())
      ->capture_default_str();
  jog->add_flag("--stop", options->stop, "End the jog that is on");
  jog->callback([options, &context] {
    if (options->stop) return context.finish_step(context.client().post("/laser/jog/stop"), render_stop);
    context.finish(context.client().post(
                       "/laser/jog", {{"dx_mm", options->x}, {"dy_mm", options->y}, {"speed_mm_s", options->speed}}),
                   render_jog);
  });
}

void add_override(CLI::App& laser, CommandContext& context) {
  struct Options {
    std::optional<int> feed, rapid, power;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* command = laser.add_subcommand(
      "override",
      "Turn speed and power up or down while a job runs, in per cent of what it asks for; what is not named stays");
  add_percent_option(
      *command, "--feed", kFeedOverride, [options](int percent) { options->feed = percent; },
      fmt::format("Speed of burning moves, {} to {}; above 100 the power has to come down as far", kFeedOverride.least,
                  kFeedOverride.most));
  add_percent_option(
      *command, "--rapid", kRapidOverride, [options](int percent) { options->rapid = percent; },
      "Speed of dark moves: 25, 50 or 100");
  add_percent_option(
      *command, "--power", kPowerOverride, [options](int percent) { options->power = percent; },
      fmt::format("Power of the beam, {} to {}: never above what was asked for", kPowerOverride.least,
                  kPowerOverride.most));
  command->callback([options, &context] {
    json body = json::object();
    if (options->feed) body["feed"] = *options->feed;
    if (options->rapid) body["rapid"] = *options->rapid;
    if (options->power) body["power"] = *options->power;
    context.finish_step(context.client().post("/laser/overrides", body), render_overrides);
  });
}

void add_here(CLI::App& laser, CommandContext& context) {
  laser
      .add_subcommand(
          "here", "The head stands at the lower left corner of the bed now: only for a laser without homing switches")
      ->callback([&context] { context.finish_step(context.client().post("/laser/corner"), render_corner); });
}

}  // namespace

void add_laser_commands(CLI::App& app, CommandContext& context) {
  CLI::App* laser = app.add_subcommand("laser", "The laser on its own");
  laser->require_subcommand(1);
  add_test_pattern(*laser, context);
  add_run_command(*laser, context);
  add_jog(*laser, context);
  add_here(*laser, context);
  add_override(*laser, context);
}

}  // namespace veneer::cli
