// What an operator says over the API reaches the unit as he said it: routes see the unit as narrow interfaces, which
// are played here.
#include <gmock/gmock.h>

#include <boost/asio/post.hpp>

#include "daemon/routes/cell_routes.h"
#include "tests/support/routed_cell.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Asks who stops only once it has stopped, as the unit does.
class PlayedCommands final : public CellCommands {
 public:
  explicit PlayedCommands(std::vector<std::string>& calls) : calls_(calls) {}
  void command(CellCommand, const std::string&, Reply, std::vector<std::string>) override {}
  void stop_by(const std::function<std::string()>& who) override {
    calls_.emplace_back("stop");
    calls_.push_back(who());
  }
  TimePoint stop_given() const override { return SteadyClock().now(); }
  void stop_after_piece(const std::string&, const Reply&) override {}
  void write_off_look(const std::string&, const Reply&) override {}
  void frame(PowerFraction, const std::string&, const Reply&, const std::vector<std::string>&) override {}

 private:
  std::vector<std::string>& calls_;
};

struct PlayedJobs final : JobCommands {
  void start_job(JobId job, const std::string& who, Reply reply) override {
    calls.push_back("start " + std::to_string(job.value) + " by " + who);
    reply(answer);
  }
  void recut(std::vector<std::string> marks, std::vector<std::string> confirmed, const std::string& who,
             Reply reply) override {
    calls.push_back("recut " + marks.at(0) + ", confirmed: " + (confirmed.empty() ? "" : confirmed.at(0)) + ", by " +
                    who);
    reply(answer);
  }
  Status answer = Ok();
  std::vector<std::string> calls;
};

struct PlayedJog final : JogCommands {
  void jog(Millimetres dx, Millimetres dy, MmPerSecond speed, const std::string& who, Reply reply) override {
    way = {dx.count(), dy.count(), speed.count()};
    by = who;
    reply(answer);
  }
  void stop() override { ++stops; }
  Status corner_is_here() override { return answer; }
  Status answer = Ok();
  std::vector<double> way;
  std::string by;
  int stops = 0;
};

struct PlayedOverrides final : OverrideCommands {
  Status set(const LaserOverrides& asked) override {
    now = asked;
    return answer;
  }
  LaserOverrides wanted() const override { return now; }
  Status answer = Ok();
  LaserOverrides now;
};

class OperatorsWords : public testing::RoutedCell {
 protected:
  OperatorsWords() {
    router = Router();
    bind_laser_routes(router,
                      {*cell->runner, *cell->runner, jog, overrides, cell->tasks, config.recipe, *cell->pictures,
                       [this](std::function<void()> act) { boost::asio::post(reactor, std::move(act)); }});
    bind_job_routes(router, {*cell->plans, *cell->planner_worker, config.planner, cell->tasks, *cell->runner, jobs,
                             *cell->database, *cell->queries, *cell->pictures, cell->panel_library, [](JobId) {},
                             [](const std::vector<PanelId>&) {}, config.laser});
  }

  PlayedJobs jobs;
  PlayedJog jog;
  PlayedOverrides overrides;
};

TEST_F(OperatorsWords, StopReachesTheUnitBeforeAnybodyLooksWhoStops) {
  std::vector<std::string> calls;
  PlayedCommands commands(calls);
  const Caller caller{Role::kViewer, "somebody", TransportKind::kTcp};
  const ApiReply reply = stop_at_once(commands, *cell->runner, cell->metrics, [&]() -> const Caller& {
    calls.emplace_back("who stops?");
    return caller;
  });
  EXPECT_THAT(calls, ElementsAre("stop", "who stops?", "somebody"));
  EXPECT_EQ(body_of(reply)["state"], "Stopped") << "what the unit says, whoever was told";
}

TEST_F(OperatorsWords, AJobIsStartedByItsNumberForWhoAsks) {
  EXPECT_EQ(ask_raw("POST", "/api/v1/jobs/7/start", "").status, 200);
  EXPECT_THAT(jobs.calls, ElementsAre("start 7 by uid 1000"));
  jobs.answer = Error{ErrorCode::kConflict, "the cell is Stopped: Reset first"};
  const ApiReply refused = ask_raw("POST", "/api/v1/jobs/8/start", "");
  EXPECT_EQ(refused.status, 409);
  EXPECT_THAT(refused.body, HasSubstr("Reset first"));
}

TEST_F(OperatorsWords, NothingIsConfirmedThatWasNotSaid) {
  EXPECT_EQ(ask("POST", "/api/v1/jobs/7/recut", {{"pieces", {"A1-1"}}}).status, 200);
  EXPECT_EQ(ask("POST", "/api/v1/jobs/7/recut", {{"pieces", {"A1-2"}}, {"confirmed", {"exhaust"}}}).status, 200);
  EXPECT_THAT(jobs.calls,
              ElementsAre("recut A1-1, confirmed: , by uid 1000", "recut A1-2, confirmed: exhaust, by uid 1000"));
  EXPECT_EQ(ask("POST", "/api/v1/jobs/7/recut").status, 400) << "which pieces?";
  EXPECT_EQ(jobs.calls.size(), 2U);
}

TEST_F(OperatorsWords, AJogGoesAsFarAsItWasAskedToAndStopsAtOnce) {
  EXPECT_EQ(ask("POST", "/api/v1/laser/jog", {{"dx_mm", 3}, {"speed_mm_s", 20}}).status, 200);
  EXPECT_THAT(jog.way, ElementsAre(3, 0, 20));
  EXPECT_EQ(jog.by, "uid 1000");
  EXPECT_EQ(ask_raw("POST", "/api/v1/laser/jog/stop", "").status, 200);
  EXPECT_EQ(jog.stops, 1);
  jog.way.clear();
  EXPECT_EQ(ask("POST", "/api/v1/laser/jog", {{"dx", 3}}).status, 400);
  EXPECT_THAT(jog.way, IsEmpty());
}

// The machine may still be on its way to what was asked for before: what it reports is no base for the next.
TEST_F(OperatorsWords, AnOverrideThatIsNotNamedStaysAsItWasAskedForLast) {
  EXPECT_EQ(ask("POST", "/api/v1/laser/overrides", {{"power", 50}}).status, 200);
  EXPECT_EQ(ask("POST", "/api/v1/laser/overrides", {{"feed", 150}}).status, 200);
  EXPECT_EQ(overrides.now, (LaserOverrides{150, 100, 50}));
  overrides.answer = Error{ErrorCode::kRefused, "at most 100 % power: turn it down"};
  EXPECT_EQ(body_of(ask("POST", "/api/v1/laser/overrides", {{"rapid", 25}}))["error"]["remedy"], "turn it down");
}

}  // namespace
}  // namespace veneer::daemon
