// A cell's life in short: panels are scanned, and jobs planned from them, cut and compared, one after the other, of
// such sizes that the wood lasts for all of them; then more, until no place is left for one piece. Some are cancelled,
// some pieces are lost and made again. All of it by the real daemon and its workers on the twin, through the API, as an
// operator and a viewer would. Tells how much memory the daemon has, and whether each panel's area book is what counts
// of ledger and mask say, by polygons and by points: of the panels that something was done to and of another one each
// time, and of all of them with each look at the memory.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <random>

#include "db/panels.h"
#include "tests/demo/story.h"
#include "tests/soak/campaigns.h"
#include "tests/soak/wood_places.h"
#include "tests/support/panel_areas.h"

namespace veneer::soak {
namespace {

using namespace tests;
namespace fs = std::filesystem;
using nlohmann::json;

struct Memory {
  double all_mb = 0, own_mb = 0;  // what is there, and what of it is no file's
};
Memory memory_of(pid_t pid) {
  std::ifstream status(fmt::format("/proc/{}/status", pid));
  Memory out;
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmRSS:")) out.all_mb = std::stod(line.substr(6)) * 1024 / 1e6;
    if (line.starts_with("RssAnon:")) out.own_mb = std::stod(line.substr(8)) * 1024 / 1e6;
  }
  return out;
}

// Of the least-squares line through the samples.
double slope(const std::vector<std::pair<double, double>>& samples) {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (const auto& [at, value] : samples) n += 1, x += at, y += value, xx += at * at, xy += at * value;
  const double spread = n * xx - x * x;
  return spread > 0 ? (n * xy - x * y) / spread : 0;
}

struct Plan {
  int panels = 66, jobs = 2000, every = 100;
  unsigned seed = 7;
  std::string dir = "out/soak-life", out;
};

class CellLife {
 public:
  CellLife(SimulatedCell& cell, const Plan& plan)
      : cell_(cell), plan_(plan), random_(plan.seed), jobs_(cell, plan.dir, quiet_) {}

  Status stock_up() {
    Story scanning(cell_, plan_.dir, quiet_);
    if (Status calibrated = scanning.calibrate(); !calibrated) return calibrated;
    std::map<std::string, StoryPanel> stock;
    for (int i = 0; i < plan_.panels; ++i) {
      const StoryPanel sheet{fmt::format("sheet-{}", i + 1), 200, 140};
      if (const Status scanned = scanning.scan_panel(sheet); !scanned)
        fmt::print(stderr, "{} stays out of it: {}\n", sheet.sheet, scanned.error().message);
      forget_captures();
    }
    for (const auto& [id, sheet] : scanning.panels()) {
      stock[id] = {sheet, 200, 140};
      panels_.push_back(id);
    }
    if (10 * static_cast<int>(panels_.size()) < 9 * plan_.panels)
      return Error{ErrorCode::kNotFound,
                   fmt::format("only {} of {} panels could be scanned", panels_.size(), plan_.panels)};
    jobs_.resume(stock, {1});
    places_ = WoodPlaces(static_cast<int>(panels_.size()));
    fmt::print("{} panels\n{:>6} {:>8} {:>8} {:>8}  MB\n", panels_.size(), "jobs", "resident", "own", "free cm2");
    return Ok();
  }

  // Until all jobs are done, and after that until no place is left for one piece.
  Status live() {
    if (Status told = tell(); !told) return told;
    for (;;) {
      const auto job = plan_one();
      if (!job) return job.error();
      if (!*job) break;
      if (Status lived = live(**job); !lived) return lived;
      ++done_;
      if (done_ % plan_.every == 0)
        if (Status told = tell(); !told) return told;
      if (done_ % kJobsBetweenCounts == 0)
        if (Status counted = count_free(); !counted) return counted;
    }
    used_up_ = true;
    if (Status told = tell(); !told) return told;
    return look_for_places();
  }

  // What the twin burnt, against the ledger of every panel.
  Status prove() {
    if (const Status proven = jobs_.prove(fs::read_symlink("/proc/self/exe").parent_path()); !proven) return proven;
    std::ifstream file(fs::path(plan_.dir) / "proof.json");
    proof_ = json::parse(file, nullptr, false);
    return proof_.is_object() ? Ok() : Status(Error{ErrorCode::kInternal, "proof.json is not JSON"});
  }

  json figures() const {
    // The first quarter is when what is known of each panel for the first time is kept.
    std::vector<std::pair<double, double>> later;
    for (const auto& sample : samples_)
      if (sample.first >= done_ / 4.0) later.push_back(sample);
    return {{"schema_version", 1},
            {"panels", panels_.size()},
            {"jobs", done_},
            {"jobs_wanted", plan_.jobs},
            {"used_up", used_up_},
            {"panels_with_places", with_places_},
            {"free_mm2", free_},
            {"free_at_first_mm2", free_at_first_},
            {"pieces_cut", cut_},
            {"refused", refused_},
            {"cancelled", cancelled_},
            {"made_again", again_},
            {"scans", scans_},
            {"books_checked", books_},
            {"differences", jobs_.differences()},
            {"untrue_panels", proof_.value("untrue_panels", json())},
            {"wood_used_twice", proof_.value("wood_used_twice", json())},
            {"unclaimed_cuts", proof_.value("unclaimed_cuts", json())},
            {"samples_mb", samples_},
            {"own_mb_per_100_jobs", 100 * slope(later)}};
  }
  // What was lived is enough to be judged, the books were true to the wood, and the memory was level. 30 MB are what a
  // life as long as the soak's may gain.
  Status judged() const {
    if (!jobs_.differences().empty())
      return Error{ErrorCode::kInternal,
                   fmt::format("scans told {} differences between wood and ledger that nobody made",
                               jobs_.differences().size())};
    if (proof_.value("untrue_panels", json()) != json::array() || proof_.value("wood_used_twice", json()) != 0 ||
        proof_.value("unclaimed_cuts", json()) != 0)
      return Error{
          ErrorCode::kInternal,
          fmt::format("the ledger is not what was burnt: panels {}, {} pieces of wood used twice, {} cuts that "
                      "nobody claims",
                      proof_.value("untrue_panels", json()).dump(), proof_.value("wood_used_twice", json()).dump(),
                      proof_.value("unclaimed_cuts", json()).dump())};
    if (samples_.size() < 5)
      return Error{ErrorCode::kRefused,
                   fmt::format("{} looks at the memory in {} jobs are too few: choose more jobs, or a smaller --every",
                               samples_.size(), done_)};
    if (done_ < plan_.jobs)
      return Error{
          ErrorCode::kInternal,
          fmt::format("the wood lasted for {} of {} jobs: choose fewer jobs, or more panels", done_, plan_.jobs)};
    if (!with_places_.empty())
      return Error{ErrorCode::kInternal,
                   fmt::format("no plan was to be had although {:.0f} of {:.0f} mm2 are free, and squares of {} mm on "
                               "panels {}",
                               free_, free_at_first_, kSurelyFits, with_places_.dump())};
    const double young = samples_[samples_.size() / 4].second, old = samples_.back().second;
    if (old < young + 30) return Ok();
    return Error{ErrorCode::kInternal, fmt::format("the daemon's memory grew from {:.0f} to {:.0f} MB", young, old)};
  }

 private:
  // Masks are kept at 300 px an inch.
  static constexpr double kPixelMm = 25.4 / 300;
  // Pieces of 12 mm had 28 places on a panel of narrow strips: 60 such panels would not last for the soak's jobs.
  static constexpr int kPiece = 10;  // mm
  // Where a square of so many mm is free, a piece with its kerf and margin fits, on whatever grid a plan looks.
  static constexpr int kSurelyFits = 12;
  static constexpr int kJobsBetweenCounts = 25;

  unsigned below(unsigned limit) { return static_cast<unsigned>(random_() % limit); }
  void forget_captures() const {
    for (const auto& capture : fs::directory_iterator(cell_.twin_dir() / "captures")) fs::remove(capture);
  }

  // Another picture each time.
  std::string picture() {
    const auto tone = [&] { return static_cast<double>(below(256)); };
    const auto colour = [&] { return cv::Scalar{tone(), tone(), tone()}; };
    cv::Mat drawn(120, 120, CV_8UC3, colour());
    const cv::Point middle{static_cast<int>(below(120)), static_cast<int>(below(120))};
    const int radius = 20 + static_cast<int>(below(60));
    cv::circle(drawn, middle, radius, colour(), cv::FILLED, cv::LINE_AA);
    std::vector<unsigned char> png;
    cv::imencode(".png", drawn, png);
    return {png.begin(), png.end()};
  }
  Result<std::int64_t> plan_of(double size_mm, const std::vector<std::string>& panels) {
    std::string from;
    for (const auto& panel : panels) from += (from.empty() ? "" : ",") + panel;
    const auto started = cell_.api().request(
        "POST", fmt::format("/jobs?name=life&size_mm={}&patch_mm={}&panels={}", size_mm, kPiece, from), picture(),
        "application/octet-stream");
    if (!started) return started.error();
    const auto planned = cell_.api().wait_task((*started)["task"], [](const json&) { return true; });
    if (!planned) return planned.error();
    return (*planned)["job"].get<std::int64_t>();
  }
  // The planner's own words for it: a panel that waits for a scan is refused, too, or a disk that is full.
  static bool says_no_wood(const Error& error) {
    return error.code == ErrorCode::kRefused && error.message.find("no free wood was left") != std::string::npos;
  }
  // In pieces along a side: so many that the wood lasts for all jobs, and more of it for none after the last.
  int pieces_across() {
    const int left = plan_.jobs - done_;
    if (left <= 0) return across_at_last_;
    return places_.across(left, below(1000) / 1000.0);
  }
  // Three of the half that has the most wood.
  std::vector<std::string> some_panels() {
    std::vector<std::string> some = panels_;
    std::ranges::sort(some, std::greater<>(), [&](const std::string& panel) { return free_of_[panel]; });
    some.resize(std::max<std::size_t>((some.size() + 1) / 2, std::min<std::size_t>(some.size(), 3)));
    std::shuffle(some.begin(), some.end(), random_);
    some.resize(std::min<std::size_t>(some.size(), 3));
    return some;
  }
  // Of some panels; where these have no wood for it, of any; then smaller ones; nothing once no panel has wood for one
  // piece.
  Result<std::optional<std::int64_t>> plan_one() {
    const int wanted = pieces_across();
    for (int across = wanted; across > 0; --across)
      for (const auto& panels : {some_panels(), panels_}) {
        const auto job = plan_of(kPiece * across, panels);
        if (job) {
          planned_ = across * across;
          places_.take(planned_);
          return std::optional(*job);
        }
        if (!says_no_wood(job.error())) return job.error();
        ++refused_;
        // After the last job larger ones are not tried again: wood comes back only where a job is cancelled.
        if (panels.size() == panels_.size()) across_at_last_ = std::max(1, across - 1);
      }
    return std::optional<std::int64_t>();
  }
  // What searches say at the end.
  Status look_for_places() {
    const auto found = cell_.api().get_all(fmt::format("/panels?patch_mm={}", kSurelyFits), "panels");
    if (!found) return found.error();
    for (const auto& panel : (*found)["panels"]) with_places_.push_back(panel["id"]);
    return Ok();
  }

  Status live(std::int64_t job) {
    const std::string target = fmt::format("/jobs/{}", job);
    if (Status looked = look_around(target); !looked) return looked;
    if (Status reserved = check_job(target); !reserved) return reserved;
    if (below(12) == 0) {
      ++cancelled_;
      places_.give_back(planned_);
      const auto cancelled = cell_.api().post(target + "/cancel");
      return cancelled ? check_job(target) : Status(cancelled.error());
    }
    if (Status cut = jobs_.cut(job); !cut) return cut;
    if (Status checked = check_job(target); !checked) return checked;
    if (below(15) == 0) {
      if (Status redone = lose_and_redo(job); !redone) return redone;
      if (Status checked = check_job(target); !checked) return checked;
    }
    if (below(8) == 0) {
      ++scans_;
      if (Status compared = jobs_.reconcile(job); !compared) return compared;
      forget_captures();
      if (Status checked = check_job(target); !checked) return checked;
    }
    if (below(50) == 0)
      if (const auto archived = cell_.api().post("/jobs/archive-done"); !archived) return archived.error();
    return count_cut(target);
  }
  // The first piece; refused where no wood is left for it.
  Status lose_and_redo(std::int64_t job) {
    const auto pieces = cell_.api().get(fmt::format("/jobs/{}/pieces", job));
    if (!pieces) return pieces.error();
    const auto redone = cell_.api().post_and_wait(
        fmt::format("/jobs/{}/redo", job), {{"pieces", json::array({(*pieces)["pieces"][0]["mark"]})}, {"lost", true}});
    if (!redone) {
      if (!says_no_wood(redone.error())) return redone.error();
      ++refused_;
      return Ok();
    }
    ++again_;
    places_.take(1);
    if (Status checked = check_job(fmt::format("/jobs/{}", job)); !checked) return checked;
    return jobs_.cut(job);
  }
  // What a page and a shelf's keeper ask for.
  Status look_around(const std::string& job) {
    const std::string panel = "/panels/" + panels_[below(static_cast<unsigned>(panels_.size()))];
    for (const std::string& target :
         {job + "/preview.png", panel + "/stock.png?width=1600", panel + "/map.png?width=640",
          panel + "/label?format=png", std::string("/panels?limit=100"),
          fmt::format("/panels?limit=100&tone=dark&patch_mm={}", 5 + below(20)), std::string("/jobs?limit=50"),
          panel + "/ledger?limit=100"})
      if (const auto bytes = cell_.api().get_bytes(target); !bytes) return bytes.error();
    return Ok();
  }
  // The picture of the mask that counts: the file that the newest version names.
  Result<cv::Mat> mask_of(const std::string& panel) const {
    auto reading = db::Database::open_for_reading(cell_.database_file());
    if (!reading) return reading.error();
    const auto record = db::Panels(*reading).find({panel});
    if (!record) return record.error();
    cv::Mat mask = cv::imread((cell_.data_dir() / record->mask_file).string(), cv::IMREAD_GRAYSCALE);
    if (mask.empty())
      return Error{ErrorCode::kNotFound, fmt::format("the mask of {} cannot be read: {}", panel, record->mask_file)};
    return mask;
  }
  // Each class of the area book against a count of what the ledger and the mask say.
  Status check_areas(const std::string& panel) {
    const auto told = cell_.api().get("/panels/" + panel);
    if (!told) return told.error();
    const auto ledger = cell_.api().get_all("/panels/" + panel + "/ledger", "allocations");
    if (!ledger) return ledger.error();
    const auto mask = mask_of(panel);
    if (!mask) return mask.error();
    const std::string wrong = testing::disagreement(
        (*told)["area_book_mm2"], testing::plain_wood((*ledger)["allocations"]), {*mask, kPixelMm},
        (*told)["width_mm"].get<double>(), (*told)["height_mm"].get<double>(), true);
    ++books_;
    return wrong.empty() ? Ok() : Status(Error{ErrorCode::kInternal, panel + ": " + wrong});
  }
  Status check_all_areas() {
    for (const std::string& panel : panels_)
      if (Status checked = check_areas(panel); !checked) return checked;
    return Ok();
  }
  // Of the job's panels, and of one more that nothing may have happened to.
  Status check_job(const std::string& job) {
    const auto record = cell_.api().get(job);
    if (!record) return record.error();
    for (const auto& used : (*record)["panels"])
      if (Status checked = check_areas(used["panel"].get<std::string>()); !checked) return checked;
    return check_areas(panels_[below(static_cast<unsigned>(panels_.size()))]);
  }
  Status count_cut(const std::string& job) {
    const auto pieces = cell_.api().get_all(job + "/pieces", "pieces");
    if (!pieces) return pieces.error();
    for (const auto& piece : (*pieces)["pieces"]) cut_ += piece["state"] == "cut" ? 1 : 0;
    return Ok();
  }
  Status count_free() {
    const auto panels = cell_.api().get_all("/panels", "panels");
    if (!panels) return panels.error();
    free_ = 0;
    for (const auto& panel : (*panels)["panels"]) free_ += free_of_[panel["id"]] = panel.value("free_mm2", 0.0);
    return Ok();
  }
  Status tell() {
    if (Status checked = check_all_areas(); !checked) return checked;
    if (Status counted = count_free(); !counted) return counted;
    if (samples_.empty()) free_at_first_ = free_;
    const Memory memory = memory_of(cell_.daemon_pid());
    samples_.emplace_back(done_, memory.own_mb);
    fmt::print("{:>6} {:>8.1f} {:>8.1f} {:>8.0f}\n", done_, memory.all_mb, memory.own_mb, free_ / 100);
    std::fflush(stdout);
    return Ok();
  }

  SimulatedCell& cell_;
  const Plan& plan_;
  std::mt19937 random_;
  QuietNarrator quiet_;
  Story jobs_;
  std::vector<std::string> panels_;
  std::vector<std::pair<double, double>> samples_;  // jobs, own memory in MB
  double free_ = 0, free_at_first_ = 0;             // mm2 of all panels, as last counted
  std::map<std::string, double> free_of_;           // of each
  WoodPlaces places_{0};
  int planned_ = 0;                   // pieces of the newest job
  bool used_up_ = false;              // no place is left for one piece
  int across_at_last_ = 3;            // of jobs after the last, in pieces
  json with_places_ = json::array();  // panels that have one for all that, as a search says
  json proof_ = json::object();
  int done_ = 0, cut_ = 0, refused_ = 0, cancelled_ = 0, again_ = 0, scans_ = 0, books_ = 0;
};

}  // namespace

int cell_life(int argc, char** argv) {
  CLI::App app{"Jobs on the simulated cell until its wood is used up, and the daemon's memory",
               "veneer-soak cell-life"};
  Plan plan;
  app.add_option("--panels", plan.panels, "Panels of 200 x 140 mm")->capture_default_str();
  app.add_option("--jobs", plan.jobs,
                 "Jobs that the wood has to last for, of one to nine pieces; then more until it is used up")
      ->capture_default_str();
  app.add_option("--every", plan.every, "Jobs between two looks at the memory")->capture_default_str();
  app.add_option("--seed", plan.seed, "Of the wood, the pictures and what happens")->capture_default_str();
  app.add_option("--dir", plan.dir, "Where the cell lives; made anew")->capture_default_str();
  app.add_option("--out", plan.out, "Also write the figures as JSON");
  CLI11_PARSE(app, argc - 1, argv + 1);
  fs::remove_all(plan.dir);
  fs::create_directories(plan.dir);
  auto cell = SimulatedCell::start({.dir = fs::absolute(plan.dir) / "cell",
                                    .bin_dir = fs::read_symlink("/proc/self/exe").parent_path(),
                                    .seed = plan.seed,
                                    .time_scale = 100});
  if (!cell) {
    fmt::print(stderr, "{}\n", cell.error().message);
    return 1;
  }
  CellLife life(**cell, plan);
  Status lived = life.stock_up();
  if (lived) lived = life.live();
  if (lived) lived = life.prove();
  const json figures = life.figures();
  if (!plan.out.empty()) std::ofstream(plan.out) << figures.dump(2);
  if (lived)
    fmt::print("no place is left for one piece more: {} jobs, {} were wanted; {:.0f} of {:.0f} mm2 are free\n",
               figures["jobs"].get<int>(), figures["jobs_wanted"].get<int>(), figures["free_mm2"].get<double>(),
               figures["free_at_first_mm2"].get<double>());
  fmt::print(
      "{} jobs, {} books checked, {} pieces cut, {} cancelled, {} plans refused, {} pieces made again, {} scans; "
      "{:+.2f} "
      "MB in 100 jobs\n",
      figures["jobs"].get<int>(), figures["books_checked"].get<int>(), figures["pieces_cut"].get<int>(),
      figures["cancelled"].get<int>(), figures["refused"].get<int>(), figures["made_again"].get<int>(),
      figures["scans"].get<int>(), figures["own_mb_per_100_jobs"].get<double>());
  if (lived) lived = life.judged();
  if (!lived) fmt::print(stderr, "{}\n", lived.error().message);
  return lived ? 0 : 1;
}

}  // namespace veneer::soak
