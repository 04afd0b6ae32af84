// The whole simulated cell as a user has it: veneer-twin and veneerd as processes of their own, in a folder of theirs,
// spoken to through the daemon's API and the twin's socket.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "base/result.h"
#include "cli/api_client.h"
#include "drivers/sim/client/twin_link.h"
#include "tests/support/child_process.h"
#include "tests/support/temp_directory.h"

namespace veneer::tests {

struct SimulatedCellOptions {
  std::filesystem::path dir;      // state of both; made when it is not there, used as it is when it is
  std::filesystem::path bin_dir;  // where veneerd and veneer-twin are
  std::uint64_t seed = 1;         // of the twin
  double time_scale = 40;
  std::string twin_tables = {};              // more of veneer-twin.toml
  bool lihuiyu = false;                      // the twin's laser is an M3-Nano board
  int look_every = 25;                       // pieces
  std::string daemon_tables = {};            // more of veneerd.toml
  std::string scanner = "kind = \"sim\"\n";  // its table
  std::string camera = "kind = \"sim\"\n";   // the same, but for look_every_pieces
  std::filesystem::path guardian = {};       // socket of the guardian; "" = the daemon starts one of its own
};

class SimulatedCell {
 public:
  static Result<std::unique_ptr<SimulatedCell>> start(const SimulatedCellOptions& options);
  ~SimulatedCell();

  const cli::ApiClient& api() const { return *api_; }
  Result<nlohmann::json> twin(const nlohmann::json& command) const { return twin_->request(command); }

  // Polls GET /status until `good` says so; kTimeout with the last state after `patience`.
  Result<nlohmann::json> wait_status(const std::function<bool(const nlohmann::json&)>& good,
                                     std::chrono::seconds patience) const;

  // Of the API, from the daemon's next start on; "" = none.
  void set_operator_group(const std::string& group) { operator_group_ = group; }
  Status start_daemon();  // after kill_daemon() or stop_daemon()
  void kill_daemon() { daemon_->kill(); }
  // For the end of a daemon that something else kills: exit status, or 128 + signal.
  int wait_daemon() { return daemon_->wait(); }
  pid_t daemon_pid() const { return daemon_->pid(); }
  int stop_daemon() { return daemon_->terminate(); }
  bool daemon_running() { return daemon_ && daemon_->running(); }
  // From now on the daemon can write to no file, or can again.
  void set_disk_full(bool full) const { daemon_->set_disk_full(full); }
  int stop_twin() { return twin_process_->terminate(); }
  pid_t twin_pid() const { return twin_process_->pid(); }
  Status start_twin();

  std::filesystem::path data_dir() const { return options_.dir / "data"; }
  std::filesystem::path twin_dir() const { return options_.dir / "twin"; }
  std::filesystem::path database_file() const { return data_dir() / "veneerd.db"; }
  std::filesystem::path config_file() const { return options_.dir / "veneerd.toml"; }
  std::filesystem::path daemon_log() const { return options_.dir / "veneerd.log"; }
  std::filesystem::path api_socket() const { return socket_dir_ / "d.sock"; }
  std::filesystem::path twin_socket() const { return socket_dir_ / "t.sock"; }

 private:
  explicit SimulatedCell(SimulatedCellOptions options);
  Status write_configs() const;

  SimulatedCellOptions options_;
  std::string operator_group_;
  testing::TempDirectory socket_dir_;  // short, since the names of sockets are limited to 107 bytes
  std::optional<ChildProcess> twin_process_, daemon_;
  std::optional<cli::ApiClient> api_;
  std::optional<sim::TwinLink> twin_;
};

}  // namespace veneer::tests
