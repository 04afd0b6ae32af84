// veneerd: arguments, signals, exit codes. 0 = ended as asked, 1 = could not work, 2 = unusable arguments, 3 = ended
// itself after an error of its own program, 4 = somebody asked for a restart. The service manager answers 3 and 4 with
// a new start.
#include <grp.h>
#include <malloc.h>
#include <sys/resource.h>
#include <systemd/sd-daemon.h>

#include <CLI/CLI.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "base/journal.h"
#include "daemon/api/account_routes.h"
#include "daemon/api/console_routes.h"
#include "daemon/api/http_server.h"
#include "daemon/api/watchdog.h"
#include "daemon/guarded_laser.h"
#include "daemon/guardian_link.h"
#include "daemon/records/account_store.h"
#include "daemon/routes/bind_routes.h"
#include "daemon/routes/cell_routes.h"
#include "daemon/store/restore.h"
#include "daemon/threads/reactor_run.h"
#include "daemon/threads/reactor_timer.h"
#include "daemon/threads/thread_priority.h"
#include "daemon/unit/cell_health.h"
#include "daemon/wiring.h"

namespace {

using namespace veneer;
using namespace veneer::daemon;

constexpr int kCouldNotWork = 1, kBroken = 3, kRestart = 4;

int fail(const Error& error, int status = kCouldNotWork) {
  std::fprintf(stderr, "veneerd: %s\n", error.message.c_str());
  return status;
}

HttpServerOptions server_options(const Config& config) {
  HttpServerOptions options;
  options.unix_path = config.api.unix_socket;
  options.listen = config.api.listen;
  options.listen_tls = config.api.listen_tls;
  options.tls_certificate = config.api.tls_certificate;
  options.tls_key = config.api.tls_key;
  // Called once, before any other thread exists.
  const auto members_of = [](const std::string& name) -> std::optional<unsigned> {
    const group* g = name.empty() ? nullptr : getgrnam(name.c_str());  // NOLINT(concurrency-mt-unsafe)
    return g ? std::optional<unsigned>(g->gr_gid) : std::nullopt;
  };
  options.operator_gid = members_of(config.api.operator_group);
  options.maintainer_gid = members_of(config.api.maintainer_group);
  return options;
}

// A core would keep the laser's port open until all of it is written, and the guardian could not darken the machine.
// One byte, since of zero the kernel still feeds a core to a program that collects them.
void leave_no_core() {
  const rlimit one_byte{1, 1};
  setrlimit(RLIMIT_CORE, &one_byte);
}

// A map that was looked at leaves memory when nobody looks any more. Left to itself the C library takes ever larger
// blocks, up to 32 MB, from its own heaps, one for each thread, and keeps twice as much of each.
void give_memory_back() {
  // NOLINTBEGIN(concurrency-mt-unsafe): no other thread has begun
  mallopt(M_ARENA_MAX, 4);
  mallopt(M_MMAP_THRESHOLD, 256 << 10);
  mallopt(M_TRIM_THRESHOLD, 1 << 20);
  // NOLINTEND(concurrency-mt-unsafe)
}

GuardianOptions guardian_options(const Config& config, const std::string& socket) {
  GuardianOptions options;
  options.socket = socket;
  std::error_code ignored;
  options.program = std::filesystem::read_symlink("/proc/self/exe", ignored).parent_path() / "veneer-guardian";
  options.record = config.store.data_dir / "guarded";
  options.machine = guarded_machine(config);
  return options;
}

// Ends what goes on, beam first, and stops the reactor once the database has written what the abort told it.
class OrderlyEnd {
 public:
  OrderlyEnd(boost::asio::io_context& reactor, Cell& cell) : reactor_(reactor), cell_(cell), deadline_(reactor) {}

  void begin(const std::string& reason) {
    cell_.runner->end(reason);
    stop_when_written();
  }
  // Nobody vouches for what the program did last: that is an abort, whatever the cell was at.
  void begin_broken(const std::string& reason) {
    cell_.runner->abort(reason);
    stop_when_written();
  }

 private:
  void stop_when_written() {
    cell_.integrity->cancel();
    deadline_.expires_after(kPatience);
    deadline_.async_wait([this](const boost::system::error_code& cancelled) {
      if (!cancelled) reactor_.stop();
    });
    cell_.runner->when_written([this] { reactor_.stop(); });
  }

  static constexpr std::chrono::seconds kPatience{5};  // a disk that hangs must not keep the laser's port from others

  boost::asio::io_context& reactor_;
  Cell& cell_;
  boost::asio::steady_timer deadline_;
};

int serve(const Config& config, boost::asio::io_context& reactor, GuardianLink& guardian, const Logger& log) {
  const SteadyClock real_clock;
  const ScaledClock device_clock(config.sim.time_scale);

  if (const Status one = means_one_machine({}, config.laser); !one) return fail(one.error());
  if (const Status one = means_one_camera({}, config.camera); !one) return fail(one.error());
  auto devices = make_devices(config, device_clock, reactor, log);
  if (!devices) return fail(devices.error());
  devices->laser =
      std::make_unique<GuardedLaser>(reactor, std::move(devices->laser), [&guardian] { return guardian.ready(); });
  auto cell = Cell::open(reactor, config, std::move(*devices), real_clock, log);
  if (!cell) return fail(cell.error());
  Cell& c = **cell;
  // Most databases are checked in milliseconds after an unclean end: then the first answer says how things stand. A
  // check that takes longer goes on behind open doors.
  const auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(1);
  while (c.integrity->state() == DatabaseCheck::State::kChecking && std::chrono::steady_clock::now() < patience)
    reactor.run_one_until(patience);
  reactor.restart();

  Router router;
  DatabaseAccountStore account_store(*c.database);
  Accounts accounts(utc_timestamp, account_store);
  auto stored = stored_accounts(*c.database);
  if (!stored) log->error("nobody can sign in with a password or a token: {}", stored.error().message);
  const bool new_cell = stored && stored->new_cell;
  if (stored) accounts.load(std::move(stored->users), std::move(stored->credentials));
  accounts.on_ended([&] { c.hub.drop_unless([&](const Caller& caller) { return accounts.holds(caller); }); });
  ConsoleLinks links(real_clock);
  links.count_on_from(accounts.last_link());
  Passwords passwords(reactor);
  SignInThrottle throttle(real_clock);
  std::string console_url;
  const AccountServices sign_in{accounts, passwords, throttle, links, [&] { return console_url; }, log};
  IdempotencyKeys keys(real_clock);
  router.remember_in(keys);
  router.on_change([&c](const Router::Change& change) { c.changes->note(change); });
  SystemdNotifier notifier;
  Watchdog watchdog(notifier, make_reactor_timer(reactor));
  OrderlyEnd end(reactor, c);
  bool restart = false;
  if (is_systemds_own())
    c.restart = [&] {
      if (std::exchange(restart, true)) return;
      log->info("ending, to be started again: the beam is switched off");
      watchdog.stopping();
      end.begin("the daemon is started again");
    };
  c.guarded = [&guardian] { return guardian.ready(); };
  bind_routes(router, c);
  bind_console_routes(router);
  bind_session_routes(router, sign_in);
  bind_account_routes(router, sign_in);
  HttpServerOptions options = server_options(config);
  options.on_broken_change = [&c](const std::string& sentence) {
    if (c.runner->may_move()) c.runner->abort(sentence);
  };
  auto server = HttpServer::open(
      reactor, std::move(options), router, c.hub, accounts,
      [&c](const WhoAsks& who_asks) { return stop_at_once(*c.runner, *c.runner, c.metrics, who_asks); }, log);
  if (!server) return fail(server.error());
  console_url = (*server)->console_url();
  c.connections = [&server] { return (*server)->connections(); };

  CellHealth health(real_clock,
                    {[&c](std::function<void()> answered) {
                       c.database->async([](Repositories&) { return 0; },
                                         [answered = std::move(answered)](int) { answered(); });
                     },
                     [&c] { return c.runner->may_move(); }, [&c] { return c.devices.laser->status().connected; },
                     [&](const std::string& sentence) {
                       c.runner->abort(sentence);
                       log->error("what was going on is stopped: {}", sentence);
                     }});
  Repeater look_after(make_reactor_timer(reactor), std::chrono::seconds(1), [&health] { health.look(); });
  Repeater forget(make_reactor_timer(reactor), std::chrono::seconds(60), [&accounts] { accounts.forget_expired(); });
  // A file that may not grow is an error to be told, like a full disk; so is somebody who reads no more of what is
  // written to him (a log that goes down a pipe). Neither may end a job. (Asio ignores SIGPIPE too, in passing.)
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  boost::asio::signal_set signals(reactor, SIGTERM, SIGINT);
  signals.async_wait([&](const boost::system::error_code& error, int) {
    if (error) return;
    log->info("ending: the beam is switched off");
    restart = false;
    watchdog.stopping();
    end.begin("the daemon was told to end");
  });
  // Long enough for a machine that a killed daemon left behind to be darkened, before anybody can say Reset.
  guardian.begin(std::chrono::seconds(6));
  guardian.on_change([&c] { c.broadcast_status(); });
  look_after.begin();
  forget.begin();
  watchdog.ready();
  log->info("{}", describe_devices(config));
  log->info("veneerd is ready: {}{}{}", config.api.unix_socket.string(), console_url.empty() ? "" : ", " + console_url,
            (*server)->tls_port() != 0 ? ", TLS at " + config.api.listen_tls : "");
  if (new_cell && !console_url.empty())
    if (const auto link = links.new_link("the first start", Role::kAdmin))
      log->info(
          "this cell is new: whoever opens {}/console#token={} in a browser on this machine, once and within five "
          "minutes, may do everything, and make accounts. Later: veneerctl console",
          console_url, *link);
  if (!set_thread_nice(kLoopNice))
    log->info(
        "STOP takes its turn among all programs here: veneerd may not have the priority nice {}, which the shipped "
        "unit gives it (LimitNICE=)",
        kLoopNice);
  const Status ran = run_reactor(reactor, [&](const std::string& sentence) {
    end.begin_broken(sentence);
    log->critical("{}", sentence);
  });
  guardian.on_change({});
  c.guarded = {};
  c.connections = {};
  (*server)->close();
  if (!ran) return fail(ran.error(), kBroken);
  return restart ? kRestart : 0;
}

int run(const Config& config, const std::string& guardian_socket) {
  const bool under_systemd = getenv("JOURNAL_STREAM") != nullptr;  // NOLINT(concurrency-mt-unsafe)
  const Logger log = under_systemd ? make_journal_logger("veneerd") : make_stderr_logger("veneerd", false);
  log->set_level(spdlog::level::from_str(config.log_level));
  leave_no_core();
  give_memory_back();
  boost::asio::io_context reactor(1);
  GuardianLink guardian(reactor, guardian_options(config, guardian_socket), log);
  const int status = serve(config, reactor, guardian, log);
  // The laser's driver has commanded the beam off and closed its port. After an error of the program nobody vouches for
  // that: then the guardian resets the machine once more.
  if (status != kBroken) guardian.done();
  return status;
}

// A backup in the place of the data, while no daemon runs; then it ends.
int restore(const Config& config, const std::string& backup, bool nothing_cut_since) {
  std::string last;
  const RestoreOrder order{backup, config.store.data_dir, "uid " + std::to_string(::geteuid()), utc_timestamp(),
                           nothing_cut_since};
  const auto restored = restore_backup(order, [&last](double, const std::string& text) {
    // "picture 7 of 80": the kind of work is enough.
    const std::string kind = text.substr(0, text.find_first_of("0123456789"));
    if (std::exchange(last, kind) != kind) std::printf("%s\n", text.c_str());
  });
  if (!restored) return fail(restored.error());
  std::printf("%s", describe(*restored, describe_devices(config)).c_str());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"veneerd runs one scan-to-cut cell", "veneerd"};
  std::string file, guardian, backup;
  bool check_only = false, nothing_cut_since = false;
  app.add_option("--config", file, "configuration file (TOML)")->required();
  app.add_option(
      "--guardian", guardian,
      "socket of the veneer-guardian that darkens the laser should this process die; without it one is started");
  app.add_flag("--check-config", check_only, "read the configuration, say whether it is good, and end");
  const CLI::Option* restoring =
      app.add_option(
             "--restore,--import", backup,
             "a folder that `veneerctl db backup` wrote, or a file of `veneerctl db export`: check it, put it in the "
             "place of the data, and end; what was there is kept")
          ->check([](const std::string& from) { return from.empty() ? "name a backup's folder or file" : ""; });
  app.add_flag(
         "--nothing-cut-since", nothing_cut_since,
         "with --restore: no panel was cut since the backup was made, as when a cell only moves; without it each "
         "panel has to be scanned before it is used. It says nothing of Clear: what was broken off is still to be "
         "cleared")
      ->needs("--restore");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  auto config = load_config(file);
  // What was chosen may be what a restore is to mend, and it moves nothing.
  if (!config && restoring->count() > 0) config = load_written_config(file);
  if (!config) return fail(config.error());
  if (check_only) {
    std::printf("%s is good\n", file.c_str());
    return 0;
  }
  if (restoring->count() > 0) return restore(*config, backup, nothing_cut_since);
  return run(*config, guardian);
}
