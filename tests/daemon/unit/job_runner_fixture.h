// A job runner on a simulated laser, with two panels in stock and a job of three pieces.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/unit/job_runner.h"
#include "tests/support/laid_bed.h"
#include "tests/support/little_room.h"
#include "tests/support/sim_laser.h"
#include "tests/support/stocked_database.h"
#include "tests/support/temp_directory.h"

namespace veneer::daemon {

using tests::kThen;
using tests::LaidBed;
using P = db::PieceState;

class JobRunnerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    auto opened = DatabaseThread::open(dir_.path() / "test.db", io_);
    ASSERT_TRUE(opened.ok());
    database_ = std::move(*opened);
    stock();
    make_runner();
  }
  void TearDown() override {
    runner_.reset();
    database_.reset();
  }

  void make_runner() {
    runner_ = std::make_unique<JobRunner>(io_, UnitParts{laser_, *database_, bed_, bed_, may_book_}, options_,
                                          make_null_logger(), [] {});
  }

  // As the next start of the program finds the cell.
  void restart() {
    runner_.reset();
    const auto recovery = database_->call([](Repositories& r) { return r.jobs.recover("2026-05-01T09:00:00.000Z"); });
    ASSERT_TRUE(recovery.ok());
    make_runner();
    runner_->begin(*recovery);
    settle();
  }

  void measure_axes_anew() {
    const auto anew = database_->call([](Repositories& r) {
      db::CertificateRecord axes = **r.certificates.last(db::CertificateKind::kAxes);
      axes.id = {};
      return r.certificates.issue(axes);
    });
    ASSERT_TRUE(anew.ok());
  }

  // Two panels; a job with two pieces on the first and one on the second.
  void stock() {
    const Status stocked = tests::stock_two_panels(*database_, 2, 1);
    ASSERT_TRUE(stocked.ok()) << stocked.error().message;
  }

  // One handler of the reactor, waited for.
  void turn() {
    io_.restart();
    io_.run_one();
  }
  // While it lives the database answers nobody: a disk that takes its time.
  class SlowDatabase {
   public:
    explicit SlowDatabase(DatabaseThread& database) {
      database.async([wait = go_.get_future().share()](Repositories&) { return wait.wait(), 0; }, [](int) {});
    }
    ~SlowDatabase() { go_.set_value(); }
    SlowDatabase(const SlowDatabase&) = delete;
    SlowDatabase& operator=(const SlowDatabase&) = delete;

   private:
    std::promise<void> go_;
  };
  // What is ready now, while the database may be slow.
  void poll() {
    io_.restart();
    io_.poll();
  }

  // Runs the reactor until nothing is left to do, the database's thread included.
  void settle() {
    for (int i = 0; i < 200; ++i) {
      database_->call([](Repositories&) { return 0; });
      io_.restart();
      if (io_.poll() == 0 && i > 2) return;
    }
    FAIL() << "the reactor does not come to rest";
  }

  // Nothing is confirmed by name, and nobody waits for what follows.
  void tell(
      CellCommand command, JobRunner::Reply reply = [](const Status&) {}, const std::string& who = "test") {
    runner_->command(command, who, std::move(reply), {});
  }
  // As an operator burns it who does not change his mind while the camera looks.
  void burn_wanted(Pattern pattern, JobRunner::Reply reply, std::vector<std::string> confirmed = {}) {
    runner_->burn_pattern(std::move(pattern), "test", std::move(reply), std::move(confirmed), Ok);
  }

  Status command(CellCommand command, std::vector<std::string> confirmed = {}) {
    std::optional<Status> out;
    runner_->command(
        command, "test", [&](Status s) { out = std::move(s); }, std::move(confirmed));
    settle();
    return out ? *out : Status(Error{ErrorCode::kInternal, "no reply"});
  }
  Status start() {
    std::optional<Status> out;
    runner_->start_job(JobId{1}, "test", [&](Status s) { out = std::move(s); });
    settle();
    return out ? *out : Status(Error{ErrorCode::kInternal, "no reply"});
  }
  // Nobody waits for the reply of what goes on after these return.
  Status frame(double power = 0, const std::vector<std::string>& confirmed = {}) {
    const auto out = std::make_shared<std::optional<Status>>();
    runner_->frame(
        PowerFraction(power), "test", [out](Status s) { *out = std::move(s); }, confirmed);
    settle();
    return *out ? **out : Status(Error{ErrorCode::kInternal, "no reply"});
  }
  Status recut(std::vector<std::string> marks, std::vector<std::string> confirmed = {}) {
    const auto out = std::make_shared<std::optional<Status>>();
    runner_->recut(std::move(marks), std::move(confirmed), "test", [out](Status s) { *out = std::move(s); });
    settle();
    return *out ? **out : Status(Error{ErrorCode::kInternal, "no reply"});
  }
  Status jog(double dx_mm, double dy_mm = 0) {
    std::optional<Status> out;
    runner_->jogging().jog(Millimetres(dx_mm), Millimetres(dy_mm), MmPerSecond(50), "test",
                           [&](Status s) { out = std::move(s); });
    settle();
    return out ? *out : Status(Error{ErrorCode::kInternal, "no reply"});
  }
  std::string reason() const { return runner_->view().reason; }
  std::string sentence() const { return runner_->view().load ? runner_->view().load->sentence : ""; }
  void look() {
    runner_->look_again();
    settle();
  }
  std::ptrdiff_t starts() const { return std::count(laser_.calls.begin(), laser_.calls.end(), "start"); }
  CellState state() const { return runner_->view().state; }
  std::vector<db::PieceState> piece_states() {
    auto pieces = database_->call([](Repositories& r) { return r.jobs.pieces(JobId{1}); });
    std::vector<db::PieceState> out;
    for (const auto& piece : *pieces) out.push_back(piece.state);
    return out;
  }
  db::JobState job_state() {
    return database_->call([](Repositories& r) { return r.jobs.find(JobId{1}); })->state;
  }
  // A scan finds wood gone where the first piece is to be cut, as difference 1.
  void find_hole() {
    db::DifferenceRecord hole;
    hole.gone = true, hole.area = SquareMillimetres(9);
    const auto pieces = database_->call([](Repositories& r) { return r.jobs.pieces(JobId{1}); });
    hole.shape = Region<PanelFrame>(pieces->front().panel_outline);
    hole.place = pieces->front().panel_outline.front();
    ASSERT_TRUE(database_->call([&](Repositories& r) { return r.differences.found({"P-0001"}, {hole}, kThen); }).ok());
  }
  void decide(db::DifferenceVerdict verdict) {
    ASSERT_TRUE(database_
                    ->call([verdict](Repositories& r) {
                      return r.differences.decide({"P-0001"}, {1}, verdict, "uid 1000", "", kThen);
                    })
                    .ok());
  }
  // Idle -> Suspended with the first panel laid and found.
  void load_first_panel() {
    ASSERT_TRUE(command(CellCommand::kReset).ok());
    ASSERT_TRUE(start().ok());
    bed_.lay("P-0001");
    look();
    ASSERT_TRUE(runner_->view().load && runner_->view().load->found);
  }

  boost::asio::io_context io_;
  veneer::testing::TempDirectory dir_;
  std::unique_ptr<DatabaseThread> database_;
  tests::SimLaser laser_{io_};
  LaidBed bed_{io_};
  RunnerOptions options_;
  std::function<Status()> may_book_;
  std::unique_ptr<JobRunner> runner_;
};

}  // namespace veneer::daemon
