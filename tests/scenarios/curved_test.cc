// Jobs with curved borders and without rows: whatever falls out of the panel is a piece, and booked, at every moment.
#include <gmock/gmock.h>
#include <signal.h>

#include "base/files.h"
#include "tests/scenarios/operated_cell.h"

namespace veneer::tests {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class Curved : public OperatedCell {
 protected:
  // In place of the prepared job, whose wood is released. What the task tells.
  json plan(const std::string& options) {
    EXPECT_EQ(post(fmt::format("/jobs/{}/cancel", kJob)), "");
    auto started = cell_->api().request("POST", "/jobs?name=curved&size_mm=48&patch_mm=12&" + options, target(),
                                        "application/octet-stream");
    if (!started.ok()) return started.error().message;
    auto planned = cell_->api().wait_task((*started)["task"]);
    if (!planned.ok()) return planned.error().message;
    job_ = (*planned)["job"];
    story_->resume({}, {job_});
    EXPECT_EQ(get(fmt::format("/jobs/{}", job_))["options"]["web_mm"], 0.2);
    return std::move(*planned);
  }

  void plan_curved() {
    const json planned = plan("refine=dp&rematch=2&optimize=global");
    ASSERT_TRUE(planned["refined"].is_object()) << planned.dump();
    EXPECT_LT(planned["refined"]["cost"], planned["refined"]["cost_before"]);
    EXPECT_EQ(get(fmt::format("/jobs/{}", job_))["refined"], planned["refined"]);
    std::size_t corners = 0;
    const json pieces = get(fmt::format("/jobs/{}/pieces", job_));
    for (const auto& piece : pieces["pieces"]) corners += piece["panel_outline_mm"].size();
    EXPECT_GT(corners, 16U * 8) << "the pieces are curved";
  }

  // The whole of it, with what is wrong where.
  std::string proof() const { return read_whole(dir_ / "proof.json").value_or("there is none"); }

  std::int64_t job_ = 0;
};

TEST_F(Curved, PiecesAndNothingElseFallOut) {
  ASSERT_NO_FATAL_FAILURE(plan_curved());
  const Status cut = story_->cut(job_);
  ASSERT_TRUE(cut.ok()) << cut.error().message;
  EXPECT_THAT(red(), IsEmpty()) << proof();
  EXPECT_EQ(get(fmt::format("/jobs/{}", job_))["state"], "complete");
}

TEST_F(Curved, AMosaicIsCutAsItWasPlanned) {
  const json planned = plan("layout=mosaic");
  ASSERT_TRUE(planned.is_object()) << planned.dump();
  const Status cut = story_->cut(job_);
  ASSERT_TRUE(cut.ok()) << cut.error().message;
  EXPECT_THAT(red(), IsEmpty()) << proof();
  EXPECT_EQ(get(fmt::format("/jobs/{}", job_))["state"], "complete");
}

// Neighbours of pieces that are out stay whole, and what lies between them stays in the panel.
TEST_F(Curved, AKilledDaemonLeavesTheLedgerTrueBetweenNeighbours) {
  ASSERT_NO_FATAL_FAILURE(plan_curved());
  ASSERT_EQ(post("/commands/reset"), "");
  ASSERT_EQ(post(fmt::format("/jobs/{}/start", job_)), "");
  lay();
  wait_found();
  signal_at_burn(cell_->daemon_pid(), SIGKILL, 360);
  ASSERT_EQ(post("/commands/unsuspend"), "");
  ASSERT_EQ(cell_->wait_daemon(), 128 + SIGKILL);
  ASSERT_TRUE(cell_->start_daemon().ok());
  EXPECT_EQ(get("/status")["state"], "Aborted");
  const json job = get(fmt::format("/jobs/{}", job_));
  EXPECT_GE(job["cut"], 4);
  EXPECT_LT(job["cut"], 16);
  lift();
  for (const std::string& figure : red()) {
    EXPECT_THAT(figure, ::testing::Not(HasSubstr("ledger_matches_burn"))) << proof();
    EXPECT_THAT(figure, ::testing::Not(HasSubstr("edge_"))) << proof();
  }
}

}  // namespace
}  // namespace veneer::tests
