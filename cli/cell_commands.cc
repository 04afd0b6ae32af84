// status, next, the commands to the cell, STOP, the console link.
#include <array>
#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "cli/command_context.h"
#include "cli/json_read.h"
#include "cli/power.h"
#include "cli/render.h"

namespace veneer::cli {
namespace {

struct CellCommand {
  const char* name;
  const char* help;
};

constexpr std::array kCellCommands = {
    CellCommand{"hold", "Pause: the beam goes off, the place is kept, `unhold` goes on"},
    CellCommand{"unhold", "Go on after a hold; the camera first looks whether the panel lies as it did"},
    CellCommand{"abort", "Stop at once, beam off; the piece being cut becomes suspect"},
    CellCommand{"clear", "Say that the cause of an abort is gone; nothing moves, `reset` comes next"},
    CellCommand{"reset", "Connect and home the laser: it moves, then the cell is Idle"},
    CellCommand{"stop-after-piece", "Finish the piece being cut, then stop"},
    CellCommand{"write-off-look", "Say that the camera cannot look any more at what was cut last: it becomes suspect"},
};

void add_command(CLI::App& parent, CommandContext& context, const std::string& name, const std::string& help) {
  parent.add_subcommand(name, help)->callback([&context, name] {
    context.finish_step(context.run_task(context.client().post("/commands/" + name)), render_state);
  });
}

// The beam comes on: the panel is checked, and what the cell cannot see is confirmed by name.
void add_unsuspend(CLI::App& parent, CommandContext& context) {
  const auto confirmed = std::make_shared<std::vector<std::string>>();
  CLI::App* unsuspend = parent.add_subcommand(
      "unsuspend", "Cut the panel that the camera has found on the bed: the laser moves and burns");
  add_confirm_option(*unsuspend, *confirmed);
  unsuspend->callback([&context, confirmed] {
    context.finish_step(context.client().post("/commands/unsuspend", {{"confirmed", *confirmed}}), render_state);
  });
}

void add_frame(CLI::App& parent, CommandContext& context) {
  const auto power = std::make_shared<double>(0);
  CLI::App* frame = parent.add_subcommand(
      "frame", "Trace the outline of what is about to be cut, with the beam off unless --power is given");
  add_power_option(
      *frame, "--power", [power](double given) { *power = given; },
      "With the beam on, as in 2% of the rated power: the wood under it is written off");
  const auto confirmed = std::make_shared<std::vector<std::string>>();
  add_confirm_option(*frame, *confirmed);
  frame->callback([&context, power, confirmed] {
    nlohmann::json body = {{"power", *power}};
    if (!confirmed->empty()) body["confirmed"] = *confirmed;
    context.finish_step(context.client().post("/commands/frame", body), render_state);
  });
}

}  // namespace

void add_confirm_option(CLI::App& command, std::vector<std::string>& confirmed) {
  command
      .add_option("--confirm", confirmed,
                  "Something you have seen to, by the name that `veneerctl status` lists; once for each")
      ->allow_extra_args(false);
}

void add_unit_commands(CLI::App& parent, CommandContext& context) {
  add_unsuspend(parent, context);
  add_frame(parent, context);
  for (const CellCommand& command : kCellCommands) add_command(parent, context, command.name, command.help);
}

void add_job_stop(CLI::App& job, CommandContext& context) {
  add_command(job, context, "stop",
              "End the run in order, after the piece being cut (`veneerctl stop` is STOP, at once)");
}

void add_stop_command(CLI::App& app, CommandContext& context) {
  app.add_subcommand("stop", "STOP: beam off and abort, at once")->callback([&context] {
    // A daemon that hangs must not let anybody wait in front of a burning laser.
    constexpr std::chrono::milliseconds kPatience{800};
    auto stopped = context.stop_client(kPatience).post("/stop");
    if (!stopped)
      stopped =
          Error{stopped.error().code, "STOP is NOT confirmed, use the EMERGENCY STOP: " + stopped.error().message};
    context.finish(stopped, render_state);
  });
}

void add_cell_commands(CLI::App& app, CommandContext& context) {
  app.add_subcommand("status", "The cell at a glance")->callback([&context] {
    context.finish(context.client().get("/status"), render_status);
  });
  app.add_subcommand("next", "What to do next at the cell, in one sentence")->callback([&context] {
    context.finish(context.client().get("/status"), render_next);
  });
  add_stop_command(app, context);
  const auto role = std::make_shared<std::string>("operator");
  CLI::App* console = app.add_subcommand("console", "A one-time link that signs a browser on this machine in");
  console->add_option("--role", *role, "What the browser may do; at most what you may")
      ->check(CLI::IsMember({"viewer", "operator", "maintainer", "admin"}))
      ->capture_default_str();
  const auto end = std::make_shared<bool>(false);
  console->add_flag("--end", *end, "Sign out whoever came in by a link, and forget links not used yet; for admins")
      ->excludes("--role");
  console->callback([role, end, &context] {
    if (*end) return context.finish(context.client().request("DELETE", "/console-links", "", ""), render_ended_links);
    context.finish(context.client().post("/console-links", {{"role", *role}}),
                   [](const nlohmann::json& link) { return text_or(link, "url", "") + "\n"; });
  });
  add_account_commands(app, context);
  add_alarm_commands(app, context);
  add_db_commands(app, context);
  add_audit_command(app, context);
  add_export_commands(app, context);
  add_unit_commands(app, context);
}

}  // namespace veneer::cli
