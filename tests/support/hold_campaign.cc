#include "tests/support/hold_campaign.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <random>

#include "daemon/unit/job_runner.h"
#include "tests/support/grbl_cell.h"
#include "tests/support/laid_bed.h"
#include "tests/support/lihuiyu_cell.h"
#include "tests/support/stocked_database.h"
#include "tests/support/temp_directory.h"

namespace veneer::tests {
namespace {

using daemon::CellCommand;
using daemon::CellState;

constexpr int kHoldPieces = 4;
constexpr double kNudge = 3.4;  // mm

struct GrblFamily {
  using Cell = GrblCell;
  static const std::vector<sim::BurnSegment>& burns(const Cell& cell) { return cell.bench.burns; }
  static void connect(Cell& cell) { cell.core.connect(cell.now()); }
  static void set_lid(Cell& cell, bool open) { cell.bench.controller.set_lid(open, cell.now()); }
  static Status jog(Cell& cell, Millimetres dx, Millimetres dy, MmPerSecond speed) {
    return cell.core.jog(dx, dy, speed, cell.now());
  }
  static void stop_jog(Cell& cell) { cell.core.stop_jog(cell.now()); }
  static bool between_pieces(const Cell& cell) { return !cell.core.job_running(); }
};

struct LihuiyuFamily {
  using Cell = LihuiyuCell;
  static const std::vector<sim::BurnSegment>& burns(const Cell& cell) { return cell.burns; }
  static void connect(Cell& cell) {
    cell.host.reopen();
    cell.core.connect(cell.now());
  }
  static void set_lid(Cell& cell, bool open) { cell.board.set_lid(open, cell.now()); }
  static Status jog(Cell&, Millimetres, Millimetres, MmPerSecond) {
    return Error{ErrorCode::kRefused, "this laser cannot be jogged"};
  }
  static void stop_jog(Cell&) {}
  static bool between_pieces(const Cell&) { return false; }  // it moves in programs only
};

// The driver's core as the unit sees it: events come in a turn of their own, as ReactorLaser tells them.
template <class Family>
class CoreLaser final : public LaserDriver {
 public:
  CoreLaser(typename Family::Cell& cell, boost::asio::io_context& io) : cell_(cell), io_(io) {}

  void connect(OnEvent on_event) override {
    on_event_ = std::move(on_event);
    Family::connect(cell_);
    tell();
  }
  void home() override { cell_.core.home(cell_.now()), tell(); }
  void start(LaserJob job) override {
    if (on_start) on_start(job.strokes.front().piece);
    cell_.core.start(std::move(job), cell_.now());
    tell();
  }
  void hold() override { cell_.core.hold(cell_.now()), tell(); }
  void resume() override { cell_.core.resume(cell_.now()), tell(); }
  void stop_after_piece() override { cell_.core.stop_after_piece(), tell(); }
  void abort() noexcept override { cell_.core.abort(cell_.now()), tell(); }
  LaserStatus status() const override { return cell_.core.status(); }
  Status jog(Millimetres dx, Millimetres dy, MmPerSecond speed) override {
    const Status taken = Family::jog(cell_, dx, dy, speed);
    tell();
    return taken;
  }
  void stop_jog() override { Family::stop_jog(cell_), tell(); }

  void tell() {
    cell_.exchange();
    for (; told_ < cell_.events.size(); ++told_) {
      dones += std::holds_alternative<laser_event::Done>(cell_.events[told_]) ? 1 : 0;
      boost::asio::post(io_, [this, event = cell_.events[told_]] { on_event_(event); });
    }
  }

  int dones = 0;  // told, and perhaps not heard yet
  std::function<void(PieceId)> on_start;

 private:
  typename Family::Cell& cell_;
  boost::asio::io_context& io_;
  OnEvent on_event_;
  std::size_t told_ = 0;
};

// The bed, and who asks when the camera looks at it.
class WatchedBed final : public daemon::BedView {
 public:
  WatchedBed(LaidBed& bed, std::function<void()> on_look) : bed_(bed), on_look_(std::move(on_look)) {}
  void look(std::function<void(Result<daemon::ProvenPose>)> reply) override {
    on_look_();
    bed_.look(std::move(reply));
  }
  void hands_were_in() override { bed_.hands_were_in(); }
  void was_cut() override { bed_.was_cut(); }
  void stock_in_sight(std::function<void(Result<daemon::StockSight>)> reply) override {
    bed_.stock_in_sight(std::move(reply));
  }

 private:
  LaidBed& bed_;
  std::function<void()> on_look_;
};

template <class Family>
class HeldRun {
 public:
  HeldRun(bool lid, std::uint64_t seed) : with_lid_(lid), random_(seed * 2654435761U + 17) {
    auto opened = daemon::DatabaseThread::open(folder_.path() / "cell.db", io_);
    if (!opened) {
      complain(opened.error().message);
      return;
    }
    database_ = std::move(*opened);
    if (const Status stocked = stock_two_panels(*database_, kHoldPieces, 1); !stocked) {
      complain(stocked.error().message);
      return;
    }
    bed_.speed = MmPerSecond(20);
    options_.look_every = 2;
    runner_ = std::make_unique<daemon::JobRunner>(io_, daemon::UnitParts{laser_, *database_, watched_bed_, bed_},
                                                  options_, make_null_logger(), [this] { changed(); });
    laser_.on_start = [this](PieceId piece) {
      ++begun_[piece];
      out_.begun_after += announced_ ? 1 : 0;
      out_.begun_askew += out_.nudged ? 1 : 0;
    };
    cell_.on_step = [this] { turn_the_reactor(); };
  }

  HoldRun run() {
    if (!out_.broken.empty()) return out_;
    if (!load()) return complain("the job could not be begun"), out_;
    draw();
    await_moment();
    if (with_lid_ && !lid_while_held_) use_lid();
    wait(120, [this] { return out_.held || out_.refused || over(); });
    if (out_.held) while_held();
    finish();
    return out_;
  }

 private:
  CellState state() const { return runner_->view().state; }
  bool over() const {
    return state() == CellState::kSuspended || state() == CellState::kComplete || state() == CellState::kAborted ||
           state() == CellState::kStopped;
  }
  void count_look() {
    const auto at = laser_.status().position;
    const double away = std::max(std::abs((at.x - home_.x).count()), std::abs((at.y - home_.y).count()));
    out_.looks_past_head += away > 1 && Family::between_pieces(cell_) ? 1 : 0;
  }
  void complain(const std::string& what) {
    if (out_.broken.empty()) out_.broken = what;
  }
  void wait(double seconds, const std::function<bool()>& until = {}) {
    turn_the_reactor();
    cell_.run(seconds, until);
    turn_the_reactor();
  }
  bool command(CellCommand command, double seconds = 130) {
    std::optional<Status> answer;
    runner_->command(command, "operator", [&](Status s) { answer = std::move(s); }, {});
    wait(seconds, [&] { return answer.has_value(); });
    return answer && answer->ok();
  }
  double burnt_mm() const {
    double mm = 0;
    for (const sim::BurnSegment& burn : Family::burns(cell_)) mm += burn.length_mm();
    return mm;
  }

  // All handlers that are ready, one by one; what the database was asked for is done before each. The Hold comes
  // between two of them.
  void turn_the_reactor() {
    laser_.tell();
    for (;;) {
      database_->call([](daemon::Repositories&) { return 0; });
      io_.restart();
      if (hold_is_due()) press_hold();
      if (io_.poll_one() == 0) break;
    }
  }
  bool hold_is_due() {
    if (!armed_ || pressed_) return false;
    if (at_done_ > 0 && laser_.dones < at_done_) return false;
    if (at_done_ == 0 && cell_.now() < moment_) return false;
    return turns_-- <= 0;
  }
  void press_hold() {
    pressed_ = true;
    runner_->command(CellCommand::kHold, "operator",
                     [this](const Status& taken) {
                       (taken ? out_.held : out_.refused) = true;
                       if (!taken) announced_ = false;
                     },
                     {});
  }
  void changed() {
    if (runner_ && (state() == CellState::kHolding || state() == CellState::kHeld)) announced_ = true;
  }

  bool load() {
    if (!command(CellCommand::kReset)) return false;
    home_ = laser_.status().position;
    std::optional<Status> started;
    runner_->start_job(JobId{1}, "operator", [&](Status s) { started = std::move(s); });
    wait(1, [&] { return started.has_value(); });
    bed_.lay("P-0001");
    runner_->look_again();
    wait(0.1);
    began_ = cell_.now();
    return command(CellCommand::kUnsuspend, 30) && state() == CellState::kExecute;
  }

  // At any time of the run, in the last half second of a piece, or so many turns after a piece's end.
  void draw() {
    const auto up_to = [&](double most) { return std::uniform_real_distribution<double>(0, most)(random_); };
    const int stratum = static_cast<int>(random_() % 3);
    const double piece_s = piece_seconds();
    turns_ = static_cast<int>(random_() % 12);
    if (stratum == 2) {
      at_done_ = 1 + static_cast<int>(random_() % kHoldPieces);
    } else {
      double at = up_to(kHoldPieces * piece_s);
      if (stratum == 1) {
        const double end = piece_s * static_cast<double>(1 + random_() % kHoldPieces);
        at = end - up_to(0.5);
      }
      moment_ = began_ + Duration(static_cast<Duration::rep>(at * 1e9));
      turns_ = 0;
    }
    lid_at_ = began_ + Duration(static_cast<Duration::rep>(up_to(kHoldPieces * piece_s) * 1e9));
    nudge_ = with_lid_ && random_() % 2 == 0;
    lid_while_held_ = random_() % 2 == 0;
    armed_ = true;
  }
  // Of a piece of a run without a Hold, in device time.
  static double piece_seconds() {
    static const double kSeconds = [] {
      HeldRun run(false, 0);
      if (!run.load()) return 1.0;
      run.wait(120, [&] { return run.over(); });
      return std::chrono::duration<double>(run.cell_.now() - run.began_).count() / kHoldPieces;
    }();
    return kSeconds;
  }

  void await_moment() {
    const bool lid_first = with_lid_ && !lid_while_held_;
    const auto enough = [&] { return pressed_ || over() || (lid_first && cell_.now() >= lid_at_); };
    wait(120, enough);
  }
  void use_lid() {
    wait(120, [this] { return lid_while_held_ || cell_.now() >= lid_at_ || over(); });
    if (over()) return;
    Family::set_lid(cell_, true);
    wait(1);  // the machine brakes, and the driver hears of it
    const double burnt = burnt_mm();
    if (nudge_) {
      out_.nudged = true;
      bed_.lay("P-0001", true, 300 + kNudge);
    }
    wait(0.5 + static_cast<double>(random_() % 20) / 10);
    Family::set_lid(cell_, false);
    wait(2);
    if (burnt_mm() != burnt) complain("burnt on after the lid was opened");
    if (state() == CellState::kExecute) complain("went on by itself after the lid was closed");
  }

  void while_held() {
    const double burnt = burnt_mm();
    wait(5);
    if (with_lid_ && lid_while_held_) use_lid();
    out_.burnt_held_mm = burnt_mm() - burnt;
    if (out_.held && state() != CellState::kHeld && state() != CellState::kAborted)
      complain(fmt::format("held, and then {}", to_string(state())));
    if (!command(CellCommand::kHold) && state() == CellState::kHeld) complain("a second Hold was refused");
  }

  void finish() {
    for (int tries = 0; tries < 6 && !over(); ++tries) {
      if (state() == CellState::kHeld) {
        const bool held_for_good = out_.nudged;
        announced_ = held_for_good;
        if (command(CellCommand::kUnhold) == held_for_good)
          complain(held_for_good ? "Unhold took a panel that moved" : "Unhold was refused: " + runner_->view().reason);
        if (held_for_good) break;
      }
      wait(120, [this] { return over() || state() == CellState::kHeld; });
    }
    out_.aborted = state() == CellState::kAborted;
    const bool whole = state() == CellState::kSuspended;  // it waits for the second panel
    if (!whole && !out_.aborted && !(out_.nudged && state() == CellState::kHeld))
      complain(fmt::format("ended {}: {}", to_string(state()), runner_->view().reason));
    if (out_.aborted && !with_lid_) complain("aborted: " + runner_->view().reason);
    for (const auto& [piece, times] : begun_)
      if (times > 1) complain(fmt::format("piece {} was begun {} times", piece.value, times));
    if (whole && begun_.size() != kHoldPieces) complain("not all pieces were burnt");
  }

  const bool with_lid_;
  std::mt19937_64 random_;
  HoldRun out_;
  veneer::testing::TempDirectory folder_;
  boost::asio::io_context io_;
  typename Family::Cell cell_;
  CoreLaser<Family> laser_{cell_, io_};
  LaidBed bed_{io_};
  WatchedBed watched_bed_{bed_, [this] { count_look(); }};
  daemon::RunnerOptions options_;
  std::unique_ptr<daemon::DatabaseThread> database_;
  std::unique_ptr<daemon::JobRunner> runner_;
  std::map<PieceId, int> begun_;
  Point<MachineFrame> home_;
  TimePoint began_{}, moment_{}, lid_at_{};
  int at_done_ = 0, turns_ = 0;
  bool armed_ = false, pressed_ = false, announced_ = false, nudge_ = false, lid_while_held_ = false;
};

}  // namespace

HoldRun run_with_hold(std::string_view kind, std::uint64_t seed) {
  const bool lid = kind.ends_with("lid");
  return kind.starts_with("grbl") ? HeldRun<GrblFamily>(lid, seed).run() : HeldRun<LihuiyuFamily>(lid, seed).run();
}

HoldRow run_hold_campaign(std::string_view kind, int runs, std::uint64_t first_seed) {
  HoldRow row;
  row.kind = kind;
  for (std::uint64_t seed = first_seed; seed < first_seed + static_cast<std::uint64_t>(runs); ++seed) {
    const HoldRun run = run_with_hold(kind, seed);
    ++row.runs;
    row.held += run.held ? 1 : 0;
    row.refused += run.refused ? 1 : 0;
    row.aborted += run.aborted ? 1 : 0;
    row.nudged += run.nudged ? 1 : 0;
    row.begun_after += run.begun_after;
    row.begun_askew += run.begun_askew;
    row.looks_past_head += run.looks_past_head;
    row.burnt_held_mm += run.burnt_held_mm;
    row.broken += run.broken.empty() ? 0 : 1;
    if (run.begun_after > 0) row.complaints.push_back(fmt::format("{}, seed {}: begun after Holding", kind, seed));
    if (run.begun_askew > 0) row.complaints.push_back(fmt::format("{}, seed {}: begun in an old pose", kind, seed));
    if (run.burnt_held_mm > 0)
      row.complaints.push_back(fmt::format("{}, seed {}: {:.3f} mm burnt while held", kind, seed, run.burnt_held_mm));
    if (!run.broken.empty()) row.complaints.push_back(fmt::format("{}, seed {}: {}", kind, seed, run.broken));
  }
  return row;
}

}  // namespace veneer::tests
