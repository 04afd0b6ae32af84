// How long a STOP takes from the request to the reset byte on the wire: the real daemon streams a pattern to a
// controller in real time while it is kept busy in one way after the other. Any client, nobody logged in, over TCP,
// over TLS with a handshake for each, and over the Unix socket; and veneerctl, a process of its own, which counts from
// its start.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "tests/soak/campaigns.h"
#include "tests/soak/stop_loads.h"
#include "tests/soak/stop_measure.h"
#include "tests/support/free_port.h"
#include "tests/support/temp_directory.h"
#include "tests/support/throwaway_certificate.h"

namespace veneer::soak {
namespace {

using namespace tests;
namespace fs = std::filesystem;

struct LoadFigures {
  std::string load, done;
  std::vector<StopDoor> doors;
  int failed = 0;
};

constexpr auto kTcp = "TCP", kTls = "TLS", kUnixSocket = "Unix socket", kVeneerctl = "veneerctl";

Result<LoadFigures> measure(const StopLoadKind& kind, const std::vector<std::string>& doors, int stops,
                            const fs::path& bin_dir, const fs::path& data, const fs::path& dir, unsigned seed) {
  LoadFigures out;
  out.load = kind.name;
  LoneDaemonOptions options;
  options.listen = "127.0.0.1:0";
  options.data = data;
  options.tables = table_of_camera(data);
  const veneer::testing::ThrowawayCertificate made(dir / "tls");
  const int tls_port = veneer::testing::free_port();
  options.api = fmt::format("listen_tls = \"127.0.0.1:{}\"\ntls_certificate = \"{}\"\ntls_key = \"{}\"\n", tls_port,
                            made.certificate.string(), made.key.string());
  std::optional<FullPipe> full;
  if (kind.stalled_log) {
    options.log = dir / "log";
    full.emplace(options.log);
  }
  auto cell = LaserOnlyCell::start(bin_dir, hasty_laser(), options);
  if (!cell) return cell.error();
  LaserOnlyCell& c = **cell;
  // Its port is known only now, and the database is the daemon's alone while it runs.
  c.end();
  if (const Status certified = certify_kerf(data, c.laser.port()); !certified) return certified.error();
  if (const Status started = c.kill_and_start_again(); !started) return started.error();
  const int port = c.tcp_port();
  const cli::ApiClient over_tcp(cli::ApiAddress{"", "127.0.0.1", port}, std::chrono::seconds(60));
  const cli::ApiClient over_tls(cli::ApiAddress{"", "127.0.0.1", tls_port, true, made.certificate.string()},
                                std::chrono::seconds(60));
  const cli::ApiClient over_unix(cli::ApiAddress{c.socket(), "", 0}, std::chrono::seconds(60));
  out.doors = {{kTcp, [&] { return told_of(over_tcp.post("/stop")); }, {}},
               {kTls, [&] { return told_of(over_tls.post("/stop")); }, {}},
               {kUnixSocket, [&] { return told_of(over_unix.post("/stop")); }, {}},
               {kVeneerctl,
                [&] {
                  const Finished said = c.veneerctl({"stop"});
                  return said.status == 0 ? Ok() : Status(Error{ErrorCode::kInternal, said.output});
                },
                {}}};
  std::erase_if(out.doors, [&](const StopDoor& door) { return !std::ranges::count(doors, door.name); });
  std::mt19937 random(seed);
  {
    const auto load = kind.begin(c, bin_dir, dir);
    // By turns, so that all meet the same load.
    for (int i = 0; i < stops; ++i)
      for (StopDoor& door : out.doors) {
        const OneStop stop = one_stop(machine_of(c), door, random);
        fmt::print(stderr, "{} {} of {}: {} {:.1f} ms {}\n", kind.name, i + 1, stops, door.name, stop.ms, stop.failed);
        if (stop.ms < 0)
          ++out.failed;
        else
          door.ms.push_back(stop.ms);
      }
    if (const Status applied = load->applied(); !applied) return applied.error();
    if (full && !full->is_full()) return Error{ErrorCode::kUnavailable, "somebody has read the log: it never stalled"};
    out.done = load->done();
  }
  for (StopDoor& door : out.doors) door.stop = nullptr;
  return out;
}

}  // namespace

int stop_latency(int argc, char** argv) {
  CLI::App app{"STOP, from the request to the byte on the wire", "veneer-soak stop-latency"};
  int stops = 100;
  double limit_ms = 50;
  unsigned seed = 7;
  std::string out, only;
  app.add_option("--stops", stops, "How many by each door under each load")->capture_default_str();
  app.add_option("--seed", seed, "Of the moments")->capture_default_str();
  std::vector<std::string> loads;
  for (const StopLoadKind& kind : stop_loads()) loads.push_back(kind.name);
  app.add_option("--load", only, "Only this one")->check(CLI::IsMember(loads));
  std::vector<std::string> doors{kTcp, kTls, kUnixSocket, kVeneerctl};
  app.add_option("--door", doors, "Only by these")->check(CLI::IsMember(doors));
  app.add_option("--limit-ms", limit_ms, "For the 99th percentile of each")->capture_default_str();
  app.add_option("--out", out, "Also write the figures as JSON");
  CLI11_PARSE(app, argc - 1, argv + 1);

  const fs::path bin_dir = fs::read_symlink("/proc/self/exe").parent_path();
  const veneer::testing::TempDirectory data(veneer::testing::TempDirectory::Place::kDisk);
  if (const Status prepared = prepare_stop_data(data.path()); !prepared) {
    fmt::print(stderr, "{}\n", prepared.error().message);
    return 1;
  }
  const EmptyBed bed(data.path());
  nlohmann::json rows = nlohmann::json::array();
  bool good = true;
  for (const StopLoadKind& kind : stop_loads()) {
    if (!only.empty() && kind.name != only) continue;
    const veneer::testing::TempDirectory dir(veneer::testing::TempDirectory::Place::kDisk);
    const auto figures = measure(kind, doors, stops, bin_dir, data.path(), dir.path(), seed);
    if (!figures) {
      fmt::print("{:<15} {}\n", kind.name, figures.error().message);
      good = false;
      continue;
    }
    good = good && figures->failed == 0;
    for (const StopDoor& door : figures->doors) {
      const double p99 = percentile(door.ms, 0.99);
      good = good && p99 <= limit_ms;
      fmt::print("{:<15} {:<12} {:>4} stops  p50 {:8.2f} ms  p99 {:8.2f} ms  max {:8.2f} ms\n", kind.name, door.name,
                 door.ms.size(), percentile(door.ms, 0.5), p99, percentile(door.ms, 1));
      rows.push_back({{"load", kind.name},
                      {"by", door.name},
                      {"stops", door.ms.size()},
                      {"p50_ms", percentile(door.ms, 0.5)},
                      {"p99_ms", p99},
                      {"max_ms", percentile(door.ms, 1)},
                      {"samples_ms", door.ms}});
    }
    fmt::print("{:<15} {} stops failed; {}\n", kind.name, figures->failed, figures->done);
    std::fflush(stdout);
  }
  if (!out.empty()) std::ofstream(out) << nlohmann::json{{"schema_version", 1}, {"stops", rows}}.dump(2);
  return good ? 0 : 1;
}

}  // namespace veneer::soak
