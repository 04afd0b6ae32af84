#include "tests/support/laser_only_cell.h"

#include <fmt/format.h>
#include <stdlib.h>
#include <sys/resource.h>

#include <chrono>
#include <fstream>
#include <thread>

namespace veneer::tests {

namespace fs = std::filesystem;

sim::GrblSettings LaserOnlyCell::quick_laser() {
  sim::GrblSettings settings = sim::GrblSettings::laser_cutter();
  settings.set(24, 20000);
  settings.set(25, 100000);
  settings.set(26, 5);
  return settings;
}

Result<std::unique_ptr<LaserOnlyCell>> LaserOnlyCell::start(const fs::path& bin_dir,
                                                            const sim::GrblSettings& settings) {
  auto cell = std::unique_ptr<LaserOnlyCell>(new LaserOnlyCell(settings));
  cell->bin_dir_ = bin_dir;
  std::string pattern = (fs::temp_directory_path() / "veneer-XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) return Error{ErrorCode::kStorage, "cannot make a folder"};
  cell->dir_ = pattern;
  std::ofstream(cell->dir_ / "veneerd.toml") << fmt::format(
      "[laser]\nkind = \"grbl\"\nport = \"serial:{}\"\n[api]\nunix = \"{}\"\nlisten = \"\"\n[store]\ndata_dir = "
      "\"{}\"\n",
      cell->laser.port(), cell->socket(), (cell->dir_ / "data").string());
  fs::create_directories(cell->dir_ / "data");
  auto daemon = ChildProcess::start(
      {(bin_dir / "veneerd").string(), "--config", (cell->dir_ / "veneerd.toml").string()}, cell->dir_ / "log");
  if (!daemon) return daemon.error();
  cell->daemon_.emplace(std::move(*daemon));
  cell->api_.emplace(cli::ApiAddress{cell->socket(), "", 0}, std::chrono::seconds(60));
  if (!cell->wait_for([&] { return cell->api_->get("/status").ok(); }))
    return Error{ErrorCode::kTimeout, "veneerd does not answer"};
  return cell;
}

LaserOnlyCell::~LaserOnlyCell() {
  if (daemon_ && daemon_->running()) daemon_->terminate();
  std::error_code ignored;
  if (!dir_.empty()) fs::remove_all(dir_, ignored);
}

Finished LaserOnlyCell::veneerctl(std::vector<std::string> arguments) const {
  arguments.insert(arguments.begin(), {(bin_dir_ / "veneerctl").string(), "--socket", socket()});
  return run_program(arguments);
}

void LaserOnlyCell::set_disk_full(bool full) const {
  rlimit limit{};
  ::prlimit(daemon_->pid(), RLIMIT_FSIZE, nullptr, &limit);
  limit.rlim_cur = full ? 0 : limit.rlim_max;
  ::prlimit(daemon_->pid(), RLIMIT_FSIZE, &limit, nullptr);
}

std::string LaserOnlyCell::state() const {
  const auto status = api_->get("/status");
  return status ? status->value("state", "") : status.error().message;
}

Status LaserOnlyCell::begin_pattern(double size_mm) const {
  const auto status = api_->get("/status");
  if (!status) return status.error();
  const auto begun = api_->post("/laser/test-pattern", {{"size_mm", size_mm}, {"confirmed", (*status)["confirm"]}});
  return begun ? Ok() : Status(begun.error());
}

// Processes say nothing when they get on; the pause only bounds how often they are asked.
bool LaserOnlyCell::wait_for(const std::function<bool()>& good) const {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!good()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

}  // namespace veneer::tests
