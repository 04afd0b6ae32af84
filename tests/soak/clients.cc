// What hostile clients cost those who mean well: the real daemon streams a pattern to a machine in real time while a
// crowd at its doors, anonymous or of operators, is slow, huge, gone or a thousand, on every route in turn. Measured
// are STOP, from the request to the reset on the wire (GRBL: the byte at the other end of the line; Lihuiyu: the packet
// with the kernel, which umockdev plays), by anybody over TCP and over the Unix socket and by an operator's console;
// and how long after that STOP the console heard of it on the event stream.
#include <fmt/format.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>

#include "tests/soak/campaigns.h"
#include "tests/soak/client_loads.h"
#include "tests/soak/stop_loads.h"
#include "tests/soak/stop_measure.h"
#include "tests/support/board_file.h"
#include "tests/support/event_listener.h"
#include "tests/support/temp_directory.h"

namespace veneer::soak {
namespace {

using namespace tests;
namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

// Of a new console link; "" when there is none.
std::string operators_session(const LoneDaemon& daemon, int port) {
  const auto link = daemon.api().post("/console-links");
  const std::string url = link ? link->value("url", "") : "";
  const auto at = url.find("token=");
  if (at == std::string::npos) return "";
  const cli::ApiClient over_tcp(cli::ApiAddress{"", "127.0.0.1", port});
  const auto session = over_tcp.post("/session", {{"token", url.substr(at + 6)}});
  return session ? session->value("session", "") : "";
}

// The console: a session by a link, its event stream, and when each change of state was heard of.
class Console {
 public:
  static std::unique_ptr<Console> open(const LoneDaemon& daemon, int port) {
    const std::string session = operators_session(daemon, port);
    if (session.empty()) return nullptr;
    return std::unique_ptr<Console>(new Console(port, session));
  }
  ~Console() {
    listener_.end();
    thread_.join();
  }
  Console(const Console&) = delete;
  Console& operator=(const Console&) = delete;

  Status stop() const { return ask("POST", "/api/v1/stop"); }
  bool look() const { return ask("GET", "/api/v1/status").ok(); }
  // When it heard that the cell aborts, after `asked`; nothing when it did not within ten seconds.
  std::optional<Clock::time_point> heard_of_abort(Clock::time_point asked) {
    std::unique_lock lock(mutex_);
    std::optional<Clock::time_point> heard;
    news_.wait_for(lock, std::chrono::seconds(10), [&] {
      for (const auto& [at, state] : heard_)
        if (at >= asked && state.starts_with("Abort")) return heard = at, true;
      return ended_;
    });
    return heard;
  }
  std::size_t events() {
    const std::lock_guard lock(mutex_);
    return heard_.size();
  }

 private:
  Console(int port, std::string session)
      : port_(port), session_(std::move(session)), listener_(port, session_), thread_([this] { listen(); }) {}

  void listen() {
    for (;;) {
      const nlohmann::json event = listener_.next();
      const auto now = Clock::now();
      const std::lock_guard lock(mutex_);
      if (event.is_null()) ended_ = true;
      if (event.is_object() && event.value("type", "") == "status")
        heard_.emplace_back(now, event["status"].value("state", ""));
      news_.notify_all();
      if (ended_) return;
    }
  }
  Status ask(const std::string& method, const std::string& path) const {
    const cli::ApiClient api(cli::ApiAddress{"", "127.0.0.1", port_});
    const auto reply = api.raw(method, path, "", "", {{"Authorization", "Bearer " + session_}});
    if (!reply) return reply.error();
    return reply->status == 200 ? Ok() : Status(Error{ErrorCode::kRefused, reply->body});
  }

  const int port_;
  const std::string session_;
  veneer::testing::EventListener listener_;
  std::mutex mutex_;
  std::condition_variable news_;
  std::vector<std::pair<Clock::time_point, std::string>> heard_;  // guarded by mutex_
  bool ended_ = false;                                            // guarded by mutex_
  std::thread thread_;
};

struct CrowdFigures {
  std::vector<StopDoor> stops;
  std::vector<double> events_ms, looks_ms;
  std::string done;
  int failed = 0;
};

// The daemon with one of the two families. What it is connected to outlives it.
class Machine {
 public:
  static Result<std::unique_ptr<Machine>> start(bool lihuiyu, const fs::path& bin_dir, const fs::path& data) {
    LoneDaemonOptions options;
    options.listen = "127.0.0.1:0";
    options.data = data;
    options.tables = table_of_camera(data);
    auto out = std::make_unique<Machine>();
    if (!lihuiyu) {
      auto cell = LaserOnlyCell::start(bin_dir, hasty_laser(), options);
      if (!cell) return cell.error();
      out->grbl_ = std::move(*cell);
      return out;
    }
    out->board_ = std::make_unique<BoardFile>(quick_board());
    out->lihuiyu_ = std::make_unique<LoneDaemon>();
    const Status started =
        out->lihuiyu_->start(bin_dir, "kind = \"lihuiyu\"\nport = \"usb:1a86:5512\"\nboard = \"m3\"\n", options);
    if (!started) return started.error();
    return out;
  }
  ~Machine() { lihuiyu_.reset(); }

  StopMachine stop_machine() {
    if (grbl_) return machine_of(*grbl_);
    return {*lihuiyu_,
            [this] { return board_->with_board([](sim::LihuiyuBoard& board) { return board.beam_commanded(); }); },
            [this] { return board_->resets(); }, 150};
  }

 private:
  // In a hurry where no beam is on.
  static sim::BoardOptions quick_board() {
    sim::BoardOptions options;
    options.m3 = true;
    options.travel_x_mm = 300;
    options.travel_y_mm = 200;
    options.rapid_mm_s = 3000;
    options.homing_mm_s = 3000;
    options.acceleration_mm_s2 = 1e6;
    options.boot_time = std::chrono::milliseconds(1);
    return options;
  }

  std::unique_ptr<LaserOnlyCell> grbl_;
  std::unique_ptr<BoardFile> board_;
  std::unique_ptr<LoneDaemon> lihuiyu_;
};

Result<CrowdFigures> measure(const ClientLoadKind& kind, bool lihuiyu, int count, const fs::path& bin_dir,
                             const fs::path& data, unsigned seed) {
  auto machine = Machine::start(lihuiyu, bin_dir, data);
  if (!machine) return machine.error();
  const StopMachine stop_machine = (*machine)->stop_machine();
  const LoneDaemon& c = stop_machine.daemon;
  const int port = c.tcp_port();
  const auto console = Console::open(c, port);
  const ClientDoors doors{port, c.socket(), operators_session(c, port)};
  if (!console || doors.session.empty()) return Error{ErrorCode::kInternal, "no console's session can be opened"};
  const cli::ApiClient over_tcp(cli::ApiAddress{"", "127.0.0.1", port}), over_unix(cli::ApiAddress{c.socket(), "", 0});
  CrowdFigures out;
  out.stops = {{"TCP", [&] { return told_of(over_tcp.post("/stop")); }, {}},
               {"Unix socket", [&] { return told_of(over_unix.post("/stop")); }, {}},
               {"console", [&] { return console->stop(); }, {}}};
  std::mt19937 random(seed);
  {
    const auto load = kind.begin(doors);
    for (int i = 0; i < count; ++i)
      for (StopDoor& door : out.stops) {
        const OneStop stop = one_stop(stop_machine, door, random);
        const auto heard = stop.ms < 0 ? std::nullopt : console->heard_of_abort(stop.asked);
        const auto asked = Clock::now();
        const bool looked = console->look();
        if (stop.ms < 0 || !heard || !looked) {
          ++out.failed;
        } else {
          door.ms.push_back(stop.ms);
          out.events_ms.push_back(ms_between(stop.asked, *heard));
          out.looks_ms.push_back(ms_between(asked, Clock::now()));
        }
        fmt::print(stderr, "{} {} of {}: {} {:.1f} ms {}\n", kind.name, i + 1, count, door.name, stop.ms, stop.failed);
      }
    out.done = fmt::format("{}; the console heard {} events", load->done(), console->events());
  }
  for (StopDoor& door : out.stops) door.stop = nullptr;
  return out;
}

class Table {
 public:
  void row(const std::string& load, const std::string& what, const std::vector<double>& ms) {
    fmt::print("{:<12} {:<26} {:>5}  p50 {:8.2f} ms  p99 {:8.2f} ms  max {:8.2f} ms\n", load, what, ms.size(),
               percentile(ms, 0.5), percentile(ms, 0.99), percentile(ms, 1));
    rows.push_back({{"load", load},
                    {"what", what},
                    {"count", ms.size()},
                    {"p50_ms", percentile(ms, 0.5)},
                    {"p99_ms", percentile(ms, 0.99)},
                    {"max_ms", percentile(ms, 1)},
                    {"samples_ms", ms}});
  }
  nlohmann::json rows = nlohmann::json::array();
};

// A thousand connections need as many descriptors here.
void allow_descriptors() {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, 8192);
  setrlimit(RLIMIT_NOFILE, &limit);
}

}  // namespace

int clients(int argc, char** argv) {
  CLI::App app{"Hostile clients: what they cost STOP and the console", "veneer-soak clients"};
  int stops = 50;
  unsigned seed = 7;
  double stop_limit_ms = 50, event_limit_ms = 1000;
  std::string out, only, family = "grbl";
  app.add_option("--stops", stops, "How many by each door under each load")->capture_default_str();
  app.add_option("--seed", seed, "Of the moments")->capture_default_str();
  app.add_option("--load", only, "Only this one, by its name in the table");
  app.add_option("--laser", family, "The family of the machine")
      ->check(CLI::IsMember({"grbl", "lihuiyu"}))
      ->capture_default_str();
  app.add_option("--stop-limit-ms", stop_limit_ms, "For the 99th percentile of each door")->capture_default_str();
  app.add_option("--event-limit-ms", event_limit_ms, "For the slowest event")->capture_default_str();
  app.add_option("--out", out, "Also write the figures as JSON");
  CLI11_PARSE(app, argc - 1, argv + 1);

  const bool lihuiyu = family == "lihuiyu";
  if (lihuiyu) be_under_umockdev(argc, argv);
  allow_descriptors();
  std::setvbuf(stdout, nullptr, _IOLBF, 0);  // a row appears when it is done, in a file too
  const fs::path bin_dir = fs::read_symlink("/proc/self/exe").parent_path();
  const veneer::testing::TempDirectory data(veneer::testing::TempDirectory::Place::kDisk);
  if (const Status prepared = prepare_stop_data(data.path()); !prepared) {
    fmt::print(stderr, "{}\n", prepared.error().message);
    return 1;
  }
  const EmptyBed bed(data.path());
  Table table;
  bool good = true;
  for (const ClientLoadKind& kind : client_loads()) {
    if (!only.empty() && kind.name != only) continue;
    const auto figures = measure(kind, lihuiyu, stops, bin_dir, data.path(), seed);
    if (!figures) {
      fmt::print("{:<12} {}\n", kind.name, figures.error().message);
      good = false;
      continue;
    }
    for (const StopDoor& door : figures->stops) {
      table.row(kind.name, "STOP by " + door.name, door.ms);
      good = good && percentile(door.ms, 0.99) <= stop_limit_ms;
    }
    table.row(kind.name, "the console hears of it", figures->events_ms);
    table.row(kind.name, "the console asks the status", figures->looks_ms);
    good = good && figures->failed == 0 && percentile(figures->events_ms, 1) <= event_limit_ms;
    fmt::print("{:<12} {}: {} failed; {}\n", kind.name, kind.what, figures->failed, figures->done);
  }
  if (!out.empty())
    std::ofstream(out) << nlohmann::json{{"schema_version", 1}, {"laser", family}, {"clients", table.rows}}.dump(2);
  return good && !table.rows.empty() ? 0 : 1;
}

}  // namespace veneer::soak
