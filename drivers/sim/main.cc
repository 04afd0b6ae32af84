// veneer-twin: the simulated cell as a process of its own.
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "base/clock.h"
#include "base/log.h"
#include "drivers/sim/board_port.h"
#include "drivers/sim/laser_port.h"
#include "drivers/sim/truth_files.h"
#include "drivers/sim/twin_config.h"
#include "drivers/sim/twin_server.h"
#include "drivers/sim/twin_service.h"
#include "drivers/sim/wood.h"
#include "drivers/sim/world.h"

namespace {

using namespace veneer;

int fail(const Error& error, int exit_status = 1) {
  std::fprintf(stderr, "veneer-twin: %s\n", error.message.c_str());
  return exit_status;
}

// Two twins on one state directory would write each other's truth.
Status lock_state(const std::filesystem::path& dir) {
  std::error_code ignored;
  std::filesystem::create_directories(dir, ignored);
  const int fd = ::open((dir / "lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0640);
  if (fd < 0) {
    return Error{ErrorCode::kStorage,
                 "cannot write to the state directory " + dir.string() + ": check its permissions"};
  }
  // Held until the process ends.
  if (::flock(fd, LOCK_EX | LOCK_NB) != 0) {
    ::close(fd);
    return Error{ErrorCode::kConflict, "another twin uses the state directory " + dir.string()};
  }
  return Ok();
}

template <class Port, class Options>
Result<std::unique_ptr<sim::LaserBench>> open_port(boost::asio::io_context& io, const Clock& clock, sim::World& world,
                                                   Options options, const Logger& log) {
  auto port = std::make_unique<Port>(io, clock, world, std::move(options), log);
  if (const Status opened = port->open(); !opened.ok()) return opened.error();
  return std::unique_ptr<sim::LaserBench>(std::move(port));
}

Result<std::unique_ptr<sim::LaserBench>> make_laser(boost::asio::io_context& io, const Clock& clock, sim::World& world,
                                                    const sim::TwinConfig& config, const std::filesystem::path& path,
                                                    const Logger& log) {
  const sim::TwinSettings& settings = world.truth().settings;
  const double width = settings.bed.width_mm, height = settings.bed.height_mm;
  if (config.controller == "grbl")
    return open_port<sim::LaserPort>(
        io, clock, world,
        sim::LaserPortOptions{path, config.reset_on_open, width, height, config.boot_seconds, settings.seed}, log);
  return open_port<sim::BoardPort>(
      io, clock, world,
      sim::BoardPortOptions{path, config.controller == "lihuiyu-m3", width, height, config.boot_seconds, settings.seed},
      log);
}

int run(const sim::TwinConfig& config, const std::filesystem::path& state_dir, const std::string& socket,
        bool journal) {
  const Logger log = make_stderr_logger("veneer-twin", journal);
  if (const Status s = lock_state(state_dir); !s.ok()) return fail(s.error());
  const Result<std::unique_ptr<sim::World>> world = sim::World::open(config.settings, state_dir, log);
  if (!world.ok()) return fail(world.error());
  boost::asio::io_context io;
  const ScaledClock clock(config.settings.time_scale);
  auto laser = make_laser(io, clock, **world, config, state_dir / "laser", log);
  if (!laser.ok()) return fail(laser.error());
  sim::TwinService service(**world, **laser, log);
  sim::TwinServer server(io, service, log);
  if (const Status s = server.listen(socket); !s.ok()) return fail(s.error());
  boost::asio::signal_set signals(io, SIGINT, SIGTERM);
  signals.async_wait([&io](boost::system::error_code, int) { io.stop(); });
  log->info("the twin listens on {}, its laser is {}", socket, (state_dir / "laser").string());
  io.run();
  server.stop();
  log->info("the twin stopped");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("The simulated scan-to-cut cell: scanner, bed camera and laser with a truth of their own",
               "veneer-twin");
  std::string config_file, state_dir, socket, swatches, preset;
  std::optional<std::uint64_t> seed;
  bool journal = false, check = false;
  app.add_option("--config", config_file, "TOML file with [twin]");
  app.add_option("--state-dir", state_dir, "where the truth is kept");
  app.add_option("--socket", socket, "Unix socket to listen on");
  app.add_option("--seed", seed, "instead of the configuration's");
  app.add_option("--preset", preset, "how unkind the workshop is, instead of the configuration's")
      ->check(CLI::IsMember({"bench", "workshop", "rough"}));
  app.add_flag("--journal", journal, "log with priorities for journald");
  app.add_flag("--check-config", check, "only say whether the configuration is right");
  app.add_option("--swatches", swatches, "only write a picture of all woods to this file");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    const int status = app.exit(e);
    return status == 0 ? 0 : 2;
  }
  if (!swatches.empty()) {
    const Status s = sim::write_picture(swatches, sim::draw_swatches(seed.value_or(1)));
    return s.ok() ? 0 : fail(s.error());
  }
  if (config_file.empty()) return fail({ErrorCode::kInvalidArgument, "--config is missing: name the TOML file"}, 2);
  Result<sim::TwinConfig> config = sim::load_twin_config(config_file, preset);
  if (!config.ok()) return fail(config.error(), 2);
  if (check) return 0;
  if (state_dir.empty() || socket.empty()) {
    return fail({ErrorCode::kInvalidArgument, "--state-dir and --socket are needed to run"}, 2);
  }
  if (seed) config->settings.seed = *seed;
  return run(*config, state_dir, socket, journal);
}
