// sim ...: the hands and the wood of the simulated cell. The one thing that speaks to the twin and not to the daemon.
#include <memory>
#include <optional>
#include <utility>

#include "cli/command_context.h"
#include "cli/render.h"
#include "cli/twin_client.h"

namespace veneer::cli {
namespace {

using nlohmann::json;

void call(const CommandContext& context, const std::string& cmd, const json& arguments,
          const CommandContext::Render& render = render_plain) {
  context.finish(TwinClient(context.twin_socket).call(cmd, arguments), render);
}

void add_new_sheets(CLI::App& sim, CommandContext& context) {
  struct Sheet {
    std::string name;
    double width_mm = 240;  // a panel fits on the glass as it is shipped
    double height_mm = 160;
    std::optional<int> strips;
  };
  for (const char* kind : {"new-panel", "new-board", "new-grid"}) {
    const auto sheet = std::make_shared<Sheet>();
    const std::string cmd = kind;
    if (cmd == "new-board") sheet->width_mm = 490, sheet->height_mm = 290;
    CLI::App* command = sim.add_subcommand(cmd, cmd == "new-panel"   ? "Make a panel of veneer strips"
                                                : cmd == "new-board" ? "Make a plain board for burnt patterns"
                                                                     : "Print an AprilGrid sheet");
    command->add_option("NAME", sheet->name, "What to call it")->required();
    if (cmd != "new-grid") {
      command->add_option("--width-mm", sheet->width_mm, "Width")->check(positive_number())->capture_default_str();
      command->add_option("--height-mm", sheet->height_mm, "Height")->check(positive_number())->capture_default_str();
    }
    if (cmd == "new-panel") command->add_option("--strips", sheet->strips, "Veneer strips")->check(positive_number());
    command->callback([sheet, cmd, &context] {
      json arguments = {{"name", sheet->name}};
      if (cmd != "new-grid") {
        arguments["width_mm"] = sheet->width_mm;
        arguments["height_mm"] = sheet->height_mm;
      }
      if (sheet->strips) arguments["strips"] = *sheet->strips;
      call(context, cmd, arguments);
    });
  }
}

void add_place(CLI::App& sim, CommandContext& context) {
  struct Options {
    std::string sheet, on, face = "show", part;
    std::optional<double> height_mm, x_mm, y_mm, turn_deg;
  };
  const auto place = std::make_shared<Options>();
  CLI::App* command = sim.add_subcommand("place", "Lay a sheet on the scanner or the bed");
  command->add_option("SHEET", place->sheet, "Its name; grid, board and panel are made when they are not there yet")
      ->required();
  command->add_option("WHERE,--on", place->on, "scanner or bed, with --on or without it")
      ->required()
      ->check(CLI::IsMember({"scanner", "bed"}));
  command->add_option("--face", place->face, "Scanner: the face at the glass; bed: the face that looks up")
      ->check(CLI::IsMember({"show", "back"}))
      ->capture_default_str();
  command->add_option("--part", place->part, "Which part of it lies on the glass (whole, left, right, ...)");
  command->add_option("--height-mm", place->height_mm, "On blocks of this height");
  command->add_option("--x-mm", place->x_mm, "Bed: where its middle comes to lie; it may stick out over the edge");
  command->add_option("--y-mm", place->y_mm, "The same, from the front edge");
  command->add_option("--turn-deg", place->turn_deg, "Bed: turned by this angle, in degrees, counter-clockwise");
  command->callback([place, &context] {
    json arguments = {{"sheet", place->sheet}, {"on", place->on}, {"face", place->face}};
    if (!place->part.empty()) arguments["part"] = place->part;
    if (place->height_mm) arguments["height_mm"] = *place->height_mm;
    if (place->x_mm) arguments["x_mm"] = *place->x_mm;
    if (place->y_mm) arguments["y_mm"] = *place->y_mm;
    if (place->turn_deg) arguments["turn_deg"] = *place->turn_deg;
    call(context, "place", arguments);
  });
}

// "drop_ok:3" or "drop_ok 3"; numbers and booleans are sent as such.
json fault_arguments(std::string name, std::string value) {
  if (const std::size_t colon = name.find(':'); value.empty() && colon != std::string::npos) {
    value = name.substr(colon + 1);
    name.resize(colon);
  }
  json arguments = {{"name", name}};
  if (value.empty()) return arguments;
  json parsed = json::parse(value, nullptr, /*allow_exceptions=*/false);
  arguments["value"] = parsed.is_discarded() ? json(value) : std::move(parsed);
  return arguments;
}

void add_faults(CLI::App& sim, CommandContext& context) {
  const auto name = std::make_shared<std::string>();
  const auto value = std::make_shared<std::string>();
  CLI::App* fault = sim.add_subcommand("fault", "Break something: scanner_dead, laser_unplug, drop_ok 3, ...");
  fault->add_option("NAME", *name, "Which fault")->required();
  fault->add_option("VALUE", *value, "How often, how much or which, where the fault takes that; as in 3");
  fault->callback([name, value, &context] { call(context, "fault", fault_arguments(*name, *value)); });

  const auto lid = std::make_shared<std::string>();
  CLI::App* lid_command = sim.add_subcommand("lid", "The lid: open or closed");
  lid_command->add_option("STATE", *lid, "open or closed")->required()->check(CLI::IsMember({"open", "closed"}));
  lid_command->callback([lid, &context] { call(context, "lid", {{"open", *lid == "open"}}); });

  const auto power = std::make_shared<std::string>();
  CLI::App* power_command = sim.add_subcommand("power", "Switch the laser's power");
  power_command->add_option("STATE", *power, "on or off")->required()->check(CLI::IsMember({"on", "off"}));
  power_command->callback([power, &context] { call(context, "power", {{"laser", *power == "on"}}); });
}

}  // namespace

void add_sim_commands(CLI::App& app, CommandContext& context) {
  CLI::App* sim = app.add_subcommand("sim", "The simulated cell: its sheets, its hands, its faults");
  sim->require_subcommand(1);
  sim->add_option("--twin", context.twin_socket, "The twin's socket")->envname("VENEER_TWIN_SOCKET");
  sim->add_subcommand("status", "Sheets and where they are")->callback([&context] {
    call(context, "status", json::object(), render_twin);
  });
  add_new_sheets(*sim, context);
  add_place(*sim, context);
  const auto from = std::make_shared<std::string>();
  const auto leave_bridges = std::make_shared<bool>(false);
  CLI::App* lift = sim->add_subcommand("lift", "Put away what lies on the scanner or the bed, and take its pieces out");
  lift->add_option("FROM", *from, "scanner or bed")->required()->check(CLI::IsMember({"scanner", "bed"}));
  lift->add_flag("--leave-bridges", *leave_bridges, "Pieces that hang by bridges stay where they are");
  lift->callback([from, leave_bridges, &context] {
    call(context, "lift", {{"from", *from}, {"leave_bridges", *leave_bridges}});
  });
  sim->add_subcommand("nudge", "Move the sheet on the bed a little")->callback([&context] {
    call(context, "nudge", json::object());
  });
  const auto measured = std::make_shared<std::string>();
  CLI::App* measure = sim->add_subcommand("measure", "Hold a caliper to a sheet: its thickness");
  measure->add_option("SHEET", *measured, "Its name")->required();
  measure->callback([measured, &context] { call(context, "measure", {{"sheet", *measured}}); });
  sim->add_subcommand("burn-log", "What has been burnt, in short")->callback([&context] {
    call(context, "burn-log", json::object());
  });
  add_faults(*sim, context);
}

}  // namespace veneer::cli
