// The real daemon as a process of its own in a folder of its own: no scanner, no camera, no certificate, no twin; a
// laser if its table of the configuration names one.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cli/api_client.h"
#include "tests/support/child_process.h"
#include "tests/support/temp_directory.h"

namespace veneer::tests {

struct LoneDaemonOptions {
  std::string listen;          // of the API over TCP: "127.0.0.1:0" for any port; "" = none
  std::string api;             // more lines of [api]
  std::filesystem::path log;   // where what it says goes; "" = a file of its own
  std::filesystem::path data;  // its data folder, already there; "" = a new one
  std::string tables;          // more of its configuration: whole tables of TOML
  std::string guardian;        // socket of the guardian; "" = it starts one of its own
};

class LoneDaemon {
 public:
  LoneDaemon() = default;
  ~LoneDaemon();
  LoneDaemon(const LoneDaemon&) = delete;
  LoneDaemon& operator=(const LoneDaemon&) = delete;

  // `bin_dir` holds veneerd and veneerctl; `laser` is what follows [laser]. Returns when the daemon answers.
  Status start(const std::filesystem::path& bin_dir, const std::string& laser, const LoneDaemonOptions& options = {});
  void end();
  void kill() { process_->kill(); }  // SIGKILL; returns when it is gone
  pid_t pid() const { return process_->pid(); }
  // SIGKILL, and the same daemon again, which answers but may still check its database.
  Status kill_and_start_again();
  // Until what needs the database is done: it was found good.
  Status wait_until_checked() const;

  const cli::ApiClient& api() const { return *api_; }
  std::string socket() const { return (dir_ / "d.sock").string(); }
  const std::filesystem::path& log() const { return log_; }
  const std::filesystem::path& data() const { return data_; }
  int tcp_port() const;  // of the API; 0 when there is none
  // veneerctl with these arguments, to its end.
  Finished veneerctl(std::vector<std::string> arguments) const;
  // The same with --confirm for all that the status asks for.
  Finished veneerctl_seen_to(std::vector<std::string> arguments) const;
  std::string state() const;
  std::string reason() const;  // why it is in this state, in its own words
  // Begins a test pattern over the API, with all that is asked for confirmed; the task that it is.
  Result<std::int64_t> begin_pattern(double size_mm) const;
  // From now on the daemon can write to no file, or can again.
  void set_disk_full(bool full) const { process_->set_disk_full(full); }
  // False when it did not come about in time.
  bool wait_for(const std::function<bool()>& good) const;

 private:
  Status start_process();

  std::filesystem::path bin_dir_, log_, data_;
  std::string guardian_;
  testing::TempDirectory dir_{testing::TempDirectory::Place::kDisk};
  std::optional<ChildProcess> process_;
  std::optional<cli::ApiClient> api_;
};

}  // namespace veneer::tests
