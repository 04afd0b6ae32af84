// veneerd: arguments, signals, exit codes. 0 = ended as asked, 1 = could not work, 2 = unusable arguments.
#include <grp.h>
#include <systemd/sd-daemon.h>

#include <CLI/CLI.hpp>
#include <boost/asio/signal_set.hpp>
#include <csignal>
#include <cstdio>

#include "daemon/api/console_routes.h"
#include "daemon/api/http_server.h"
#include "daemon/api/task_routes.h"
#include "daemon/api/watchdog.h"
#include "daemon/cell_health.h"
#include "daemon/cell_routes.h"
#include "daemon/wiring.h"

namespace {

using namespace veneer;
using namespace veneer::daemon;

int fail(const Error& error) {
  std::fprintf(stderr, "veneerd: %s\n", error.message.c_str());
  return 1;
}

HttpServerOptions server_options(const Config& config) {
  HttpServerOptions options;
  options.unix_path = config.api.unix_socket;
  options.listen = config.api.listen;
  // Called once, before any other thread exists.
  if (!config.api.operator_group.empty())
    if (const group* g = getgrnam(config.api.operator_group.c_str()))  // NOLINT(concurrency-mt-unsafe)
      options.operator_gid = g->gr_gid;
  return options;
}

int run(const Config& config) {
  const Logger log =
      make_stderr_logger("veneerd", getenv("JOURNAL_STREAM") != nullptr);  // NOLINT(concurrency-mt-unsafe)
  log->set_level(spdlog::level::from_str(config.log_level));
  boost::asio::io_context reactor(1);
  const SteadyClock real_clock;
  const ScaledClock device_clock(config.sim.time_scale);

  auto devices = make_devices(config, device_clock, reactor, log);
  if (!devices) return fail(devices.error());
  auto cell = Cell::open(reactor, config, std::move(*devices), real_clock, log);
  if (!cell) return fail(cell.error());
  Cell& c = **cell;

  Router router;
  ConsoleLinks links(real_clock);
  int tcp_port = 0;
  bind_unit_routes(router, c);
  bind_stock_routes(router, c);
  bind_job_routes(router, c);
  bind_laser_routes(router, c);
  bind_recipe_routes(router, c);
  bind_task_routes(router, c.tasks);
  bind_console_routes(router, links, [&] { return tcp_port; });
  auto server = HttpServer::open(
      reactor, server_options(config), router, c.hub, links,
      [&c](const Caller& caller) { return stop_at_once(c, caller); }, log);
  if (!server) return fail(server.error());
  tcp_port = (*server)->tcp_port();

  SystemdNotifier notifier;
  CellHealth health(real_clock, {[&c](std::function<void()> answered) {
                                   c.database->async([](Repositories&) { return 0; },
                                                     [answered = std::move(answered)](int) { answered(); });
                                 },
                                 [&c] { return may_move(c.runner->view().state) || c.runner->view().framing; },
                                 [&c] { return c.devices.laser->status().connected; }});
  Watchdog watchdog(notifier, make_reactor_timer(reactor), [&] {
    if (health.good()) return true;
    log->error("the watchdog is not fed: {}", health.sentence());
    return false;
  });
  // A file that may not grow is an error to be told, like a full disk; it must not end a job.
  std::signal(SIGXFSZ, SIG_IGN);
  boost::asio::signal_set signals(reactor, SIGTERM, SIGINT);
  signals.async_wait([&](const boost::system::error_code& error, int) {
    if (error) return;
    log->info("ending: the beam is switched off");
    watchdog.stopping();
    c.runner->abort("the daemon was told to end");
    // What the abort writes goes through the database's thread, which is asked last.
    c.database->async([](Repositories&) { return 0; }, [&](int) { reactor.stop(); });
  });
  watchdog.ready();
  log->info("veneerd is ready: {}{}", config.api.unix_socket.string(),
            tcp_port != 0 ? ", http://127.0.0.1:" + std::to_string(tcp_port) : "");
  reactor.run();
  (*server)->close();
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"veneerd runs one scan-to-cut cell", "veneerd"};
  std::string file;
  bool check_only = false;
  app.add_option("--config", file, "configuration file (TOML)")->required();
  app.add_flag("--check-config", check_only, "read the configuration, say whether it is good, and end");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  const auto config = load_config(file);
  if (!config) return fail(config.error());
  if (check_only) {
    std::printf("%s is good\n", file.c_str());
    return 0;
  }
  return run(*config);
}
