#include "tests/support/simulated_cell.h"

#include <fmt/format.h>
#include <stdlib.h>

#include <fstream>
#include <thread>

namespace veneer::tests {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// Until `ready` says so or `process` is gone. Processes have no other way to say that they listen; the pause only
// bounds how often they are asked.
template <class Ready>
Status await(ChildProcess& process, const std::string& name, const fs::path& log, Ready ready) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!ready()) {
    if (!process.running())
      return Error{ErrorCode::kUnavailable, fmt::format("{} ended at once: see {}", name, log.string())};
    if (std::chrono::steady_clock::now() > end)
      return Error{ErrorCode::kTimeout, fmt::format("{} does not answer: see {}", name, log.string())};
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return Ok();
}

}  // namespace

SimulatedCell::SimulatedCell(SimulatedCellOptions options) : options_(std::move(options)) {}

SimulatedCell::~SimulatedCell() {
  if (daemon_ && daemon_->running()) daemon_->terminate();
  if (twin_process_ && twin_process_->running()) twin_process_->terminate();
}

Result<std::unique_ptr<SimulatedCell>> SimulatedCell::start(const SimulatedCellOptions& options) {
  auto cell = std::unique_ptr<SimulatedCell>(new SimulatedCell(options));
  std::error_code failed;
  fs::create_directories(cell->data_dir(), failed);
  fs::create_directories(cell->twin_dir(), failed);
  if (const Status written = cell->write_configs(); !written) return written.error();
  if (const Status started = cell->start_twin(); !started) return started.error();
  if (const Status started = cell->start_daemon(); !started) return started.error();
  return cell;
}

Status SimulatedCell::write_configs() const {
  const std::string port = (fs::absolute(twin_dir()) / "laser").string();
  std::ofstream twin(options_.dir / "veneer-twin.toml");
  twin << fmt::format("[sim]\ntime_scale = {}\n[twin]\nseed = {}\n{}{}", options_.time_scale, options_.seed,
                      options_.twin_tables, options_.lihuiyu ? "[twin.laser]\ncontroller = \"lihuiyu-m3\"\n" : "");
  std::ofstream daemon(config_file());
  daemon << fmt::format(
      "[laser]\n{}[scanner]\n{}[camera]\n{}look_every_pieces = {}\n"
      "[sim]\nsocket = \"{}\"\nlaser = \"{}\"\ntime_scale = {}\n"
      "[api]\nunix = \"{}\"\nlisten = \"127.0.0.1:0\"\noperator_group = \"{}\"\n[store]\ndata_dir = \"{}\"\n{}",
      options_.lihuiyu ? fmt::format("kind = \"lihuiyu\"\nport = \"twin:{}\"\nboard = \"m3\"\ntravel_x_mm = "
                                     "520\ntravel_y_mm = 380\n[before_motion]\nconfirm = []\nfocus = false\n",
                                     port)
                       : "kind = \"sim\"\n",
      options_.scanner, options_.camera, options_.look_every, twin_socket().string(), port, options_.time_scale,
      api_socket().string(), operator_group_, fs::absolute(data_dir()).string(), options_.daemon_tables);
  if (twin.flush() && daemon.flush()) return Ok();
  return Error{ErrorCode::kStorage, fmt::format("cannot write into {}", options_.dir.string())};
}

Status SimulatedCell::start_twin() {
  const fs::path log = options_.dir / "veneer-twin.log";
  auto process = ChildProcess::start(
      {(options_.bin_dir / "veneer-twin").string(), "--config", (options_.dir / "veneer-twin.toml").string(),
       "--state-dir", twin_dir().string(), "--socket", twin_socket().string()},
      log);
  if (!process) return process.error();
  twin_process_.emplace(std::move(*process));
  twin_.emplace(twin_socket().string(), std::chrono::seconds(120));
  return await(*twin_process_, "veneer-twin", log, [this] { return twin({{"cmd", "status"}}).ok(); });
}

Status SimulatedCell::start_daemon() {
  if (Status written = write_configs(); !written) return written;
  const fs::path log = daemon_log();
  std::vector<std::string> command{(options_.bin_dir / "veneerd").string(), "--config", config_file().string()};
  if (!options_.guardian.empty()) command.insert(command.end(), {"--guardian", options_.guardian.string()});
  auto process = ChildProcess::start(command, log);
  if (!process) return process.error();
  daemon_.emplace(std::move(*process));
  api_.emplace(cli::ApiAddress{api_socket().string(), "", 0}, std::chrono::seconds(120));
  return await(*daemon_, "veneerd", log, [this] { return api_->get("/status").ok(); });
}

Result<json> SimulatedCell::wait_status(const std::function<bool(const json&)>& good,
                                        std::chrono::seconds patience) const {
  const auto end = std::chrono::steady_clock::now() + patience;
  for (;;) {
    auto status = api_->get("/status");
    if (!status || good(*status)) return status;
    if (std::chrono::steady_clock::now() > end)
      return Error{ErrorCode::kTimeout,
                   fmt::format("the cell stayed {}: {}", status->value("state", ""), status->value("reason", ""))};
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

}  // namespace veneer::tests
