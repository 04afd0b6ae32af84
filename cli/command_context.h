// What every command of veneerctl shares: where the daemon is, how to speak to its user, how to end.
#pragma once

#include <CLI/CLI.hpp>
#include <chrono>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/result.h"
#include "cli/api_client.h"
#include "cli/number_checks.h"

namespace veneer::cli {

inline constexpr int kWorkFailed = 1;
inline constexpr int kUnusableArguments = 2;

struct CommandContext {
  std::string socket = "/run/veneerd/veneerd.sock";  // a path, HOST:PORT, or https://HOST:PORT
  std::string authority;  // a file of certificates to believe instead of the system's; "" = none
  std::string token;      // of VENEERD_TOKEN
  std::string twin_socket = "/run/veneer-twin/twin.sock";
  bool json = false;

  // Over TLS it carries the token, or what `login` has kept for this address.
  ApiClient client(std::chrono::milliseconds patience = std::chrono::seconds(60)) const;
  // For STOP, which needs nothing: no file is read first, and a token goes along only where nobody overhears it.
  ApiClient stop_client(std::chrono::milliseconds patience) const;

  using Render = std::function<std::string(const nlohmann::json&)>;
  // Prints the value (as JSON with "schema_version" under --json, else as `render` words it), or the error's sentence
  // on stderr. Ends the command with `exit_status` when it failed.
  void finish(const Result<nlohmann::json>& outcome, const Render& render, int exit_status = kWorkFailed) const;
  // The same of a command after which something else is to be done: where its words name no command, what comes next at
  // the cell is said behind them, as `veneerctl next` says it.
  void finish_step(const Result<nlohmann::json>& outcome, const Render& render) const;
  // Posts long work, shows its progress until it is over, lets Ctrl-C cancel it.
  Result<nlohmann::json> run_task(const Result<nlohmann::json>& started) const;

 private:
  ApiAddress address() const;
};

// The sentence on stderr; ends the command with this exit status.
[[noreturn]] void fail(const Error& error, int exit_status = kWorkFailed);

// Parses and runs the chosen command. The program's exit status.
int run(CLI::App& app, int argc, char** argv);

// A file for the API, kNotFound or kInvalidArgument in words when it cannot be read.
Result<std::string> read_file(const std::string& path);
Status write_file(const std::string& path, const std::string& bytes);
// Saves what the API has at `target` + part in each file that is named; ends the command where that fails.
struct SavedPart {
  std::string file;  // "": not wanted
  const char* part;  // "/preview.png"
};
void save_parts(const CommandContext& context, const std::string& target, const std::vector<SavedPart>& parts);

// What the cell asks a person to see to before the beam comes on (`confirm` of the status) and is not in `confirmed`
// (--confirm) is asked for at a terminal, "`what` Seen to: ...?". The whole of it then, or as it was when nothing is
// asked. Without a terminal kInvalidArgument writes out the --confirm that are missing; kCancelled when the answer is
// no.
Result<std::vector<std::string>> seen_to(const CommandContext& context, std::vector<std::string> confirmed,
                                         const std::string& what);
// The same; ends the command where that fails.
std::vector<std::string> seen_to_or_fail(const CommandContext& context, std::vector<std::string> confirmed,
                                         const std::string& what = "The laser will move and burn.");
// Asks at the terminal.
bool yes(const std::string& question);
bool at_terminal();

// --confirm WHAT, as often as needed.
void add_confirm_option(CLI::App& command, std::vector<std::string>& confirmed);
// hold, unhold, unsuspend, frame, abort, clear, reset, stop-after-piece, write-off-look: at the top and below `job`.
void add_unit_commands(CLI::App& parent, CommandContext& context);
void add_job_stop(CLI::App& job, CommandContext& context);

// Each adds its commands to the program.
void add_stop_command(CLI::App& app, CommandContext& context);
void add_cell_commands(CLI::App& app, CommandContext& context);     // status, stop, hold, ..., console
void add_db_commands(CLI::App& app, CommandContext& context);       // db check|backup|backups
void add_account_commands(CLI::App& app, CommandContext& context);  // user, token, login, logout, whoami
void add_alarm_commands(CLI::App& app, CommandContext& context);    // alarm list|acknowledge|try
void add_audit_command(CLI::App& app, CommandContext& context);
void add_export_commands(CLI::App& app, CommandContext& context);      // export stock|history|wood|events
void add_panel_commands(CLI::App& app, CommandContext& context);       // panel list|show, calibrate, certificates
void add_proposal_commands(CLI::App& panel, CommandContext& context);  // panel scan|proposals|accept|refuse
void add_mask_commands(CLI::App& panel, CommandContext& context);      // panel mask
void add_fiducial_commands(CLI::App& app, CommandContext& context);    // fiducials print grid|panel
void add_job_commands(CLI::App& app, CommandContext& context);         // job new|plan|list|start|hold|..., task
void add_piece_commands(CLI::App& app, CommandContext& context);       // piece show|at
void add_laser_commands(CLI::App& app, CommandContext& context);       // laser test-pattern|run|jog|here|override
void add_bed_commands(CLI::App& app, CommandContext& context);         // bed look|glance|picture
void add_scanner_commands(CLI::App& app, CommandContext& context);     // scanner list
void add_camera_commands(CLI::App& app, CommandContext& context);      // camera list
void add_device_commands(CLI::App& app, CommandContext& context);      // device list|find|choose, restart
void add_fact_commands(CLI::App& app, CommandContext& context);        // material ..., panel set
void add_recipe_commands(CLI::App& app, CommandContext& context);      // recipe ..., panel material, job export
void add_sim_commands(CLI::App& app, CommandContext& context);         // sim ...

}  // namespace veneer::cli
