// What the daemon takes while nothing goes on: its share of a processor over a quiet while, and its memory; newly
// started, with a console that listens, and after panels were scanned, a picture planned, cut and compared, as a day
// leaves it. By the real daemon, its workers and the twin.
//
// Memory is told in four ways. VmRSS is every page that is there, as ps and top show it: it counts pages of
// libraries that other programs use as well. PSS counts such a page in equal parts at each of them, private those that
// no other has, own those that are no file's.
#include <fmt/format.h>
#include <sys/types.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <thread>

#include "tests/demo/story.h"
#include "tests/soak/campaigns.h"
#include "tests/soak/processor_time.h"
#include "tests/support/event_listener.h"

namespace veneer::soak {
namespace {

using namespace tests;
namespace fs = std::filesystem;
using nlohmann::json;

struct IdlePlan {
  double rest_s = 90, watch_s = 120, most_percent = 1, most_mb = 60, time_scale = 40;
  int panels = 2;
  unsigned seed = 7;
  std::string dir = "out/soak-idle", out;
};

struct Footprint {
  double resident_mb = 0, pss_mb = 0, private_mb = 0, own_mb = 0;
};
Footprint footprint_of(pid_t pid) {
  std::ifstream file(fmt::format("/proc/{}/smaps_rollup", pid));
  Footprint out;
  const std::map<std::string, double*> wanted{{"Rss:", &out.resident_mb},
                                              {"Pss:", &out.pss_mb},
                                              {"Private_Clean:", &out.private_mb},
                                              {"Private_Dirty:", &out.private_mb},
                                              {"Anonymous:", &out.own_mb}};
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string name;
    double kib = 0;
    if (words >> name >> kib; wanted.contains(name)) *wanted.at(name) += kib * 1024 / 1e6;
  }
  return out;
}

// A console's ear: it reads all that it is told, and asks for nothing.
class ListeningConsole {
 public:
  static Result<std::unique_ptr<ListeningConsole>> open(const SimulatedCell& cell) {
    const auto link = cell.api().post("/console-links");
    if (!link) return link.error();
    const std::string url = link->value("url", "");
    const auto colon = url.rfind(':'), token = url.find("token=");
    if (colon == std::string::npos || token == std::string::npos)
      return Error{ErrorCode::kInternal, "no link to the console: " + url};
    const int port = std::stoi(url.substr(colon + 1));
    const auto session =
        cli::ApiClient(cli::ApiAddress{"", "127.0.0.1", port}).post("/session", {{"token", url.substr(token + 6)}});
    if (!session) return session.error();
    return std::make_unique<ListeningConsole>(port, session->value("session", ""));
  }
  ListeningConsole(int port, const std::string& session)
      : listener_(port, session), reader_([this] {
          while (!listener_.next().is_null()) ++heard_;
          has_ended_ = true;
        }) {}
  ~ListeningConsole() {
    listener_.end();
    reader_.join();
  }
  int heard() const { return heard_; }
  // False: the daemon has ended the stream, or what came over it was no event.
  bool stands() const { return !has_ended_; }

 private:
  testing::EventListener listener_;
  std::atomic<int> heard_ = 0;
  std::atomic<bool> has_ended_ = false;
  std::thread reader_;
};

class Idle {
 public:
  Idle(SimulatedCell& cell, const IdlePlan& plan) : cell_(cell), plan_(plan) {}

  Status watch_all() {
    if (Status fresh = watch("newly started"); !fresh) return fresh;
    if (Status listened = watch_with_console("newly started, a console listens"); !listened) return listened;
    if (Status lived = live_a_day(); !lived) return lived;
    if (Status after = watch("after scans, a plan, its cut and its comparison"); !after) return after;
    return watch_with_console("after that, a console listens");
  }
  json figures() const { return {{"schema_version", 1}, {"rest_s", plan_.rest_s}, {"rows", rows_}}; }
  Status judged() const {
    if (rows_.empty()) return Error{ErrorCode::kInternal, "nothing was looked at"};
    std::string missed;
    for (const json& row : rows_) {
      const double percent = row["processor_percent"], resident = row["resident_mb"];
      if (percent > plan_.most_percent)
        missed += fmt::format("{}: {:.2f} % of a processor; ", row["when"].get<std::string>(), percent);
      if (resident > plan_.most_mb)
        missed += fmt::format("{}: {:.1f} MB resident; ", row["when"].get<std::string>(), resident);
    }
    if (missed.empty()) return Ok();
    missed.resize(missed.size() - 2);
    return Error{ErrorCode::kInternal,
                 fmt::format("more than {} % or {} MB, {}", plan_.most_percent, plan_.most_mb, missed)};
  }

 private:
  static void rest(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }

  Status watch(const std::string& when, const ListeningConsole* console = nullptr) {
    rest(plan_.rest_s);
    const pid_t pid = cell_.daemon_pid();
    const int heard = console != nullptr ? console->heard() : 0;
    const auto began = std::chrono::steady_clock::now();
    const auto before = processor_seconds(pid);
    const auto threads_before = thread_times(pid);
    rest(plan_.watch_s);
    const auto after = processor_seconds(pid);
    const auto threads_after = thread_times(pid);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    const Footprint memory = footprint_of(pid);
    if (!before || !after || memory.resident_mb <= 0)
      return Error{ErrorCode::kUnavailable, fmt::format("process {} cannot be looked at", pid)};
    if (console != nullptr && !console->stands())
      return Error{ErrorCode::kUnavailable, when + ": the console's stream of events has ended"};
    const double used = *after - *before;
    std::vector<std::pair<double, std::string>> threads;
    for (const auto& [number, time] : threads_after) {
      const auto known = threads_before.find(number);
      const double here = time.seconds - (known == threads_before.end() ? 0 : known->second.seconds);
      if (here > 0) threads.emplace_back(100 * here / seconds, time.name);
    }
    std::ranges::sort(threads, std::greater());
    if (threads.size() > 4) threads.resize(4);
    json busiest = json::array();
    for (const auto& [percent, thread] : threads) busiest.push_back({{"thread", thread}, {"percent", percent}});
    rows_.push_back({{"when", when},
                     {"seconds", seconds},
                     {"processor_percent", 100 * used / seconds},
                     {"busiest", busiest},
                     {"resident_mb", memory.resident_mb},
                     {"pss_mb", memory.pss_mb},
                     {"private_mb", memory.private_mb},
                     {"own_mb", memory.own_mb},
                     {"threads", threads_after.size()},
                     {"events_heard", console != nullptr ? console->heard() - heard : 0}});
    fmt::print("{:<50} {:6.2f} % {:6.1f} MB resident, {:5.1f} PSS, {:5.1f} private, {:5.1f} own, {} threads;", when,
               100 * used / seconds, memory.resident_mb, memory.pss_mb, memory.private_mb, memory.own_mb,
               threads_after.size());
    for (const auto& [percent, thread] : threads) fmt::print(" {} {:.2f} %", thread, percent);
    fmt::print("\n");
    std::fflush(stdout);
    return Ok();
  }
  Status watch_with_console(const std::string& when) {
    auto console = ListeningConsole::open(cell_);
    if (!console) return console.error();
    return watch(when, console->get());
  }

  Status live_a_day() {
    QuietNarrator silent;
    Story story(cell_, plan_.dir, silent);
    if (Status calibrated = story.calibrate(); !calibrated) return calibrated;
    for (int i = 0; i < plan_.panels; ++i)
      if (Status scanned = story.scan_panel({fmt::format("sheet-{}", i + 1), 240, 160}); !scanned) return scanned;
    cv::Mat drawn(480, 384, CV_8UC3, cv::Scalar(60, 90, 130));
    cv::circle(drawn, {190, 240}, 130, cv::Scalar(150, 190, 220), cv::FILLED, cv::LINE_AA);
    const fs::path picture = fs::path(plan_.dir) / "picture.png";
    cv::imwrite(picture.string(), drawn);
    if (Status planned = story.plan({picture, "idle", 60, 12}); !planned) return planned;
    const std::int64_t job = story.jobs().back();
    if (Status cut = story.cut(job); !cut) return cut;
    if (Status compared = story.reconcile(job); !compared) return compared;
    // As people look at what there is.
    for (const auto& [panel, sheet] : story.panels())
      for (const char* shown : {"map.jpg?width=1600", "stock.png?width=1600", "label?format=png"})
        if (const auto bytes = cell_.api().get_bytes("/panels/" + panel + "/" + shown); !bytes) return bytes.error();
    return Ok();
  }

  SimulatedCell& cell_;
  const IdlePlan& plan_;
  json rows_ = json::array();
};

}  // namespace

int idle(int argc, char** argv) {
  CLI::App app{"What the daemon takes of a processor and of memory while nothing goes on", "veneer-soak idle"};
  IdlePlan plan;
  app.add_option("--rest-s", plan.rest_s, "Before each look: pictures are kept for a minute")->capture_default_str();
  app.add_option("--watch-s", plan.watch_s, "Over which the processor's share is counted")->capture_default_str();
  app.add_option("--most-percent", plan.most_percent, "Of one processor")->capture_default_str();
  app.add_option("--most-mb", plan.most_mb, "Resident")->capture_default_str();
  app.add_option("--time-scale", plan.time_scale,
                 "Of the twin: what the daemon asks of a machine at rest it asks by "
                 "the clock, whatever this is")
      ->capture_default_str();
  app.add_option("--panels", plan.panels, "Of 240 x 160 mm, that are scanned")->capture_default_str();
  app.add_option("--seed", plan.seed, "Of the wood")->capture_default_str();
  app.add_option("--dir", plan.dir, "Where the cell lives; made anew")->capture_default_str();
  app.add_option("--out", plan.out, "Also write the figures as JSON");
  CLI11_PARSE(app, argc - 1, argv + 1);
  fs::remove_all(plan.dir);
  fs::create_directories(plan.dir);
  auto cell = SimulatedCell::start({.dir = fs::absolute(plan.dir) / "cell",
                                    .bin_dir = fs::read_symlink("/proc/self/exe").parent_path(),
                                    .seed = plan.seed,
                                    .time_scale = plan.time_scale});
  if (!cell) {
    fmt::print(stderr, "{}\n", cell.error().message);
    return 1;
  }
  Idle looks(**cell, plan);
  Status done = looks.watch_all();
  if (!plan.out.empty()) std::ofstream(plan.out) << looks.figures().dump(2);
  if (done) done = looks.judged();
  if (!done) fmt::print(stderr, "{}\n", done.error().message);
  return done ? 0 : 1;
}

}  // namespace veneer::soak
