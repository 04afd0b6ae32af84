#include "db/leases.h"

#include <gmock/gmock.h>

#include "db/audit.h"
#include "db/differences.h"
#include "tests/db/stray_sql.h"

namespace veneer::db {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::string kNextWeek = "2026-05-08T07:30:00.000Z", kJustBefore = "2026-05-08T07:29:59.999Z";

class LeasesTest : public ::testing::Test {
 protected:
  CellDatabase cell;
  PanelId panel = cell.new_panel(), other = cell.new_panel();
  Plans plans{cell.database()};
  Leases leases{cell.database()};
  PlanId plan = must(plans.add(two_pieces(10), kNow));

  NewPlan two_pieces(double x_mm) {
    return job_of({square_piece("A1", panel, x_mm, 10, 14), square_piece("A2", other, x_mm, 10, 14)});
  }
  void lease(PlanId of) { must(leases.take(of, "local:1000", kNow, kNextWeek)); }
  std::vector<AllocationState> states(const PanelId& of) {
    std::vector<AllocationState> out;
    for (const auto& [id, state] : must(cell.ledger().live_states(of))) out.push_back(state);
    return out;
  }
};

TEST_F(LeasesTest, KeepTheWoodOfAPlanFromEverybodyElse) {
  const PlanLease lease = must(leases.take(plan, "local:1000", kNow, kNextWeek));
  EXPECT_EQ(lease, (PlanLease{"local:1000", kNow, kNextWeek}));
  EXPECT_EQ(must(plans.find(plan)).lease, lease);
  EXPECT_THAT(must(plans.taken(plan)), IsEmpty());
  const auto live = must(cell.ledger().live_allocations(panel));
  ASSERT_EQ(live.size(), 1U);
  EXPECT_EQ(live[0].state, AllocationState::kLeased);
  EXPECT_EQ(live[0].leased_to, plan);
  EXPECT_EQ(live[0].piece, PieceId{});
  EXPECT_EQ(live[0].area.area(), square_piece("A1", panel, 10, 10, 14).allocation.area());

  const PlanId second = must(plans.add(two_pieces(20), kNow));
  EXPECT_THAT(must(plans.taken(second)), ElementsAre("A1", "A2"));
  for (const Status& refused : {Status(cell.jobs().create(second, kLater).error()),
                                Status(leases.take(second, "local:1000", kLater, kNextWeek).error()),
                                Status(cell.jobs().create(two_pieces(20), kLater).error())}) {
    EXPECT_EQ(refused.error().code, ErrorCode::kConflict);
    EXPECT_EQ(refused.error().message,
              "piece A1 cannot have its wood on panel P-0001, which plan 1 leases until 2026-05-08T07:30:00.000Z: plan "
              "again with the free wood, or release that with `veneerctl job release 1`");
  }
  EXPECT_EQ(cell.ledger().write_off(panel, Region<PanelFrame>(square(12, 12, 2)), "a knot", kLater).error().code,
            ErrorCode::kConflict);
  EXPECT_EQ(must(cell.jobs().list()).size(), 0U);
  EXPECT_EQ(must(plans.find(second)).lease, std::nullopt);
}

TEST_F(LeasesTest, AreRefusedWhereWoodIsReserved) {
  const JobId job = must(cell.jobs().create(two_pieces(20), kNow));
  const auto refused = leases.take(plan, "local:1000", kNow, kNextWeek);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kConflict);
  EXPECT_THAT(refused.error().message, HasSubstr("piece A1"));
  EXPECT_THAT(states(other), ElementsAre(AllocationState::kReserved));
  VENEER_ASSERT_OK(cell.jobs().cancel(job, kLater));
  VENEER_EXPECT_OK(leases.take(plan, "local:1000", kLater, kNextWeek));
}

TEST_F(LeasesTest, HandTheirWoodToTheJobOfTheirPlan) {
  lease(plan);
  const JobId job = must(cell.jobs().create(plan, kLater));
  EXPECT_EQ(must(cell.jobs().find(job)).count(PieceState::kReserved), 2);
  EXPECT_THAT(states(panel), ElementsAre(AllocationState::kReserved));
  EXPECT_EQ(must(plans.find(plan)).lease, std::nullopt);
  EXPECT_EQ(cell.database().connection().execAndGet("SELECT ended FROM leases").getString(), "taken");
  EXPECT_EQ(leases.release(plan, kLater).error().code, ErrorCode::kConflict);
  VENEER_EXPECT_OK(cell.database().check_integrity());
}

TEST_F(LeasesTest, StayWhenTheJobIsRefused) {
  lease(plan);
  must(cell.panels().add_mask(other, {0, "map", "mask", "hash", kLater}, 1));
  EXPECT_EQ(cell.jobs().create(plan, kLater).error().code, ErrorCode::kConflict);
  EXPECT_EQ(must(plans.find(plan)).lease->until, kNextWeek);
  EXPECT_THAT(states(panel), ElementsAre(AllocationState::kLeased));
}

// Nobody has to look at a clock for it: whoever wants the wood ends the lease whose time has come.
TEST_F(LeasesTest, EndWithTheirTime) {
  lease(plan);
  const NewPlan wanted = two_pieces(20);
  EXPECT_FALSE(cell.jobs().create(wanted, kJustBefore).ok());
  EXPECT_THAT(must(leases.expire(kJustBefore)), IsEmpty());
  EXPECT_EQ(must(leases.next_end()), kNextWeek);
  must(cell.jobs().create(wanted, kNextWeek));
  EXPECT_EQ(must(plans.find(plan)).lease, std::nullopt);
  EXPECT_THAT(states(panel), ElementsAre(AllocationState::kReserved));
  EXPECT_EQ(must(leases.next_end()), "");
  EXPECT_THAT(must(leases.expire(kNextWeek)), IsEmpty());
  const auto noted = must(Audit(cell.database()).latest(1));
  ASSERT_EQ(noted.size(), 1U);
  EXPECT_EQ(noted[0].what, "lease.end");
  EXPECT_EQ(noted[0].detail, "the lease of plan 1, expired");
  // What has ended stays so when the clock is set back.
  EXPECT_FALSE(cell.jobs().create(plan, kNow).ok());
}

TEST_F(LeasesTest, EndWhenSomebodyLooksAtTheClock) {
  lease(plan);
  EXPECT_THAT(must(leases.expire(kNextWeek)), ElementsAre(plan));
  EXPECT_THAT(states(panel), IsEmpty());
  EXPECT_THAT(states(other), IsEmpty());
  EXPECT_EQ(must(cell.ledger().allocations(panel, {0}, 10))[0].changed_at, kNextWeek);
}

// Past its time, but nobody else came: the plan's own job has the wood all the same.
TEST_F(LeasesTest, HandWoodOverAlsoAfterTheirTime) {
  lease(plan);
  must(cell.jobs().create(plan, kNextWeek));
  EXPECT_THAT(states(panel), ElementsAre(AllocationState::kReserved));
}

TEST_F(LeasesTest, AreRenewedAndReleased) {
  lease(plan);
  EXPECT_EQ(must(leases.take(plan, "local:1001", kLater, "2026-05-20T00:00:00.000Z")).who, "local:1001");
  EXPECT_THAT(must(leases.expire(kNextWeek)), IsEmpty());
  EXPECT_EQ(must(plans.find(plan)).lease, (PlanLease{"local:1001", kLater, "2026-05-20T00:00:00.000Z"}));
  EXPECT_EQ(must(cell.ledger().allocations(panel, {0}, 10)).size(), 1U) << "the same wood";
  VENEER_EXPECT_OK(leases.release(plan, kLater));
  EXPECT_THAT(states(panel), IsEmpty());
  EXPECT_EQ(leases.release(plan, kLater).error().message, "plan 1 leases no wood: see `veneerctl job plans`");
  VENEER_EXPECT_OK(leases.take(plan, "local:1000", kLater, kNextWeek));
  VENEER_EXPECT_OK(cell.database().check_integrity());
}

TEST_F(LeasesTest, AreOfAPlanThatAJobCanBeMadeOf) {
  EXPECT_EQ(leases.take({9}, "local:1000", kNow, kNextWeek).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(leases.release({9}, kNow).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(leases.take(plan, "local:1000", kNow, kNow).error().code, ErrorCode::kInvalidArgument);
  PlannedPatch gap = square_piece("A1", panel, 0, 0, 14);
  gap.panel.reset(), gap.panel_outline.clear(), gap.allocation = {};
  const PlanId empty = must(plans.add(job_of({gap}), kNow));
  EXPECT_THAT(leases.take(empty, "local:1000", kNow, kNextWeek).error().message, HasSubstr("takes no wood"));
  must(cell.panels().add_mask(other, {0, "map", "mask", "hash", kLater}, 1));
  EXPECT_EQ(leases.take(plan, "local:1000", kLater, kNextWeek).error().message,
            "panel P-0002 was scanned again after this was planned, or a scan was taken back: plan again");
  EXPECT_EQ(cell.database().connection().execAndGet("SELECT count(*) FROM leases").getInt(), 0);
}

TEST_F(LeasesTest, KeepTheirPlanAndTheirPanels) {
  lease(plan);
  EXPECT_EQ(plans.remove(plan).error().message,
            "plan 1 leases its wood until 2026-05-08T07:30:00.000Z: release it first with `veneerctl job release 1`");
  EXPECT_EQ(cell.panels().retire(panel, "split", kLater).error().message,
            "plan 1 leases wood of panel P-0001 until 2026-05-08T07:30:00.000Z: release it first with `veneerctl job "
            "release 1`");
  VENEER_EXPECT_OK(cell.panels().retire(panel, "split", kNextWeek));
  VENEER_EXPECT_OK(plans.remove(plan));
  // What it leased is known all the same.
  EXPECT_EQ(must(cell.ledger().allocations(panel, {0}, 10))[0].leased_to, plan);
  VENEER_EXPECT_OK(cell.database().check_integrity());
}

TEST_F(LeasesTest, EndWhenTheirWoodIsGone) {
  const PlanId beside = must(plans.add(two_pieces(100), kNow));
  lease(plan);
  lease(beside);
  Differences differences(cell.database());
  DifferenceRecord gone;
  gone.gone = true, gone.place = point<PanelFrame>(13, 13), gone.area = SquareMillimetres(9);
  gone.shape = Region<PanelFrame>(square(12, 12, 3));
  VENEER_ASSERT_OK(differences.found(panel, {gone}, kLater));
  EXPECT_THAT(must(differences.decide(panel, {1}, DifferenceVerdict::kWrittenOff, "local:1000", "", kLater)),
              IsEmpty());
  EXPECT_EQ(must(plans.find(plan)).lease, std::nullopt);
  EXPECT_TRUE(must(plans.find(beside)).lease);
  EXPECT_THAT(states(panel), ElementsAre(AllocationState::kLeased, AllocationState::kScrap));
  EXPECT_THAT(states(other), ElementsAre(AllocationState::kLeased));
  EXPECT_FALSE(cell.jobs().create(plan, kLater).ok());
}

TEST_F(LeasesTest, AreKeptByTheDatabaseItself) {
  const PlanId second = must(plans.add(two_pieces(20), kNow));
  lease(plan);
  const auto refused = [&](const std::string& sql, const std::string& why) {
    const Status done = execute(cell.database(), sql);
    ASSERT_FALSE(done.ok()) << sql;
    EXPECT_THAT(done.error().message, HasSubstr(why)) << sql;
  };
  refused("UPDATE allocations SET state = 'released' WHERE state = 'leased'", "when its lease ends");
  refused("UPDATE allocations SET state = 'reserved' WHERE state = 'leased'", "refuses");
  refused("UPDATE leases SET plan = 2", "of one plan");
  refused("DELETE FROM leases", "never removed");
  refused("DELETE FROM placements WHERE plan = 1", "never removed");
  refused("INSERT INTO leases (plan, who, at, until) VALUES (1, 'x', 'a', 'b')", "refuses");
  refused("INSERT INTO leases (plan, who, at, until) VALUES (77, 'x', 'a', 'b')", "plan that is there");
  refused(
      "INSERT INTO allocations (panel, lease, state, area_um, reason, changed_at) SELECT panel, 1, 'leased', "
      "area_um, '', 't' FROM placements WHERE plan = 2",
      "held for another piece or plan");
  refused(
      "INSERT INTO allocations (panel, lease, state, area_um, reason, changed_at) SELECT panel, 1, 'scrap', "
      "'[[[0,0],[9,0],[0,9]]]', '', 't' FROM placements WHERE plan = 2",
      "leased, or written off");
  VENEER_ASSERT_OK(leases.release(plan, kLater));
  refused("UPDATE leases SET ended = NULL, ended_at = NULL", "never edited");
  refused(
      "INSERT INTO allocations (panel, lease, state, area_um, reason, changed_at) SELECT panel, 1, 'leased', "
      "area_um, '', 't' FROM placements WHERE plan = 2",
      "a lease that lasts");
  lease(second);
  VENEER_EXPECT_OK(cell.database().check_integrity());
}

TEST_F(LeasesTest, LastThroughARestart) {
  lease(plan);
  cell.reopen();
  must(cell.jobs().recover(kLater));
  Plans again(cell.database());
  EXPECT_EQ(must(again.find(plan)).lease->until, kNextWeek);
  EXPECT_THAT(states(panel), ElementsAre(AllocationState::kLeased));
}

}  // namespace
}  // namespace veneer::db
