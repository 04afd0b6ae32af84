#include "tests/support/lone_daemon.h"

#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <thread>

namespace veneer::tests {

namespace fs = std::filesystem;

Status LoneDaemon::start(const fs::path& bin_dir, const std::string& laser, const LoneDaemonOptions& options) {
  bin_dir_ = bin_dir;
  log_ = options.log.empty() ? dir_ / "log" : options.log;
  data_ = options.data.empty() ? dir_ / "data" : options.data;
  guardian_ = options.guardian;
  std::ofstream(dir_ / "veneerd.toml") << fmt::format(
      "[laser]\n{}[api]\nunix = \"{}\"\nlisten = \"{}\"\n{}[store]\ndata_dir = \"{}\"\n{}", laser, socket(),
      options.listen, options.api, data_.string(), options.tables);
  fs::create_directories(data_);
  return start_process();
}

Status LoneDaemon::start_process() {
  std::vector<std::string> command{(bin_dir_ / "veneerd").string(), "--config", (dir_ / "veneerd.toml").string()};
  if (!guardian_.empty()) command.insert(command.end(), {"--guardian", guardian_});
  auto daemon = ChildProcess::start(command, log_);
  if (!daemon) return daemon.error();
  process_.emplace(std::move(*daemon));
  api_.emplace(cli::ApiAddress{socket(), "", 0}, std::chrono::seconds(60));
  if (wait_for([&] { return api_->get("/status").ok(); })) return Ok();
  return Error{ErrorCode::kTimeout, "veneerd does not answer"};
}

Status LoneDaemon::kill_and_start_again() {
  process_->kill();
  return start_process();
}

Status LoneDaemon::wait_until_checked() const {
  const auto is_checked = [this] {
    const auto status = api_->get("/status");
    return status && (*status)["database"]["state"] == "good";
  };
  if (wait_for(is_checked)) return Ok();
  return Error{ErrorCode::kTimeout, "veneerd does not find its database good"};
}

void LoneDaemon::end() {
  if (process_ && process_->running()) process_->terminate();
}

LoneDaemon::~LoneDaemon() { end(); }

int LoneDaemon::tcp_port() const {
  const auto link = api_->post("/console-links");
  const std::string url = link ? link->value("url", "") : "";
  const auto colon = url.find(':', url.find("//"));
  return colon == std::string::npos ? 0 : std::atoi(url.c_str() + colon + 1);
}

Finished LoneDaemon::veneerctl(std::vector<std::string> arguments) const {
  arguments.insert(arguments.begin(), {(bin_dir_ / "veneerctl").string(), "--socket", socket()});
  return run_program(arguments);
}

Finished LoneDaemon::veneerctl_seen_to(std::vector<std::string> arguments) const {
  if (const auto status = api_->get("/status"); status.ok())
    for (const auto& name : (*status)["confirm"])
      arguments.insert(arguments.end(), {"--confirm", name.get<std::string>()});
  return veneerctl(std::move(arguments));
}

std::string LoneDaemon::state() const {
  const auto status = api_->get("/status");
  return status ? status->value("state", "") : status.error().message;
}

std::string LoneDaemon::reason() const {
  const auto status = api_->get("/status");
  return status ? status->value("reason", "") : status.error().message;
}

Result<std::int64_t> LoneDaemon::begin_pattern(double size_mm) const {
  const auto status = api_->get("/status");
  if (!status) return status.error();
  nlohmann::json confirmed = (*status)["confirm"];
  confirmed.push_back("scrap on the bed");
  const auto begun = api_->post("/laser/test-pattern", {{"size_mm", size_mm}, {"confirmed", confirmed}});
  if (!begun) return begun.error();
  return (*begun)["task"].get<std::int64_t>();
}

// Processes say nothing when they get on; the pause only bounds how often they are asked.
bool LoneDaemon::wait_for(const std::function<bool()>& good) const {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!good()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

}  // namespace veneer::tests
