// Leases whose time has come are ended, and who is told of it.
#include "daemon/plans/lease_clerk.h"

#include <gmock/gmock.h>

#include <boost/asio/io_context.hpp>
#include <memory>

#include "base/polygon_ops.h"
#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr const char* kThen = "2026-01-01T00:00:00.000Z";

class LeaseClerkTest : public ::testing::Test {
 protected:
  void SetUp() override {
    auto opened = DatabaseThread::open(data_.path() / "veneerd.db", reactor_);
    ASSERT_TRUE(opened.ok()) << opened.error().message;
    database_ = std::move(*opened);
    clerk_ = std::make_unique<LeaseClerk>(
        *database_, [this](const PanelId& panel) { told_.push_back(panel.value); }, make_null_logger());
  }
  // A plan's piece on a panel of its own, whose wood it leases until then.
  void lease(const std::string& until) {
    const Status leased = database_->call([&](Repositories& r) -> Status {
      db::PanelRecord panel;
      panel.id = PanelId{"P-0001"};
      panel.name = "maple";
      panel.width = Millimetres(200), panel.height = Millimetres(100);
      panel.created_at = kThen;
      if (Status added = r.panels.add(panel, {}, {}); !added) return added;
      db::NewPlan plan;
      plan.name = "later";
      plan.plan_json = plan.options_json = "{}";
      db::PlannedPatch& piece = plan.pieces.emplace_back();
      piece.mark = "B7-1";
      piece.artwork_outline = {point<ArtworkFrame>(0, 0), point<ArtworkFrame>(20, 0), point<ArtworkFrame>(20, 20)};
      piece.panel = panel.id;
      piece.panel_outline = {point<PanelFrame>(80, 10), point<PanelFrame>(100, 10), point<PanelFrame>(100, 30)};
      piece.allocation = offset(Region<PanelFrame>(piece.panel_outline), Millimetres(0.27));
      plan.planned_on = {{panel.id, 1}};
      const auto id = r.plans.add(plan, kThen);
      if (!id) return id.error();
      const auto taken = r.leases.take(*id, "uid 1000", kThen, until);
      return taken ? Ok() : Status(taken.error());
    });
    ASSERT_TRUE(leased.ok()) << leased.error().message;
  }
  // When the lease that lasts ends; "" when there is none.
  std::string next_end() {
    const auto next = database_->call([](Repositories& r) { return r.leases.next_end(); });
    return next ? *next : "?";
  }
  // All that was asked of the database until now is answered on the reactor.
  std::size_t answers() {
    static_cast<void>(database_->call([](Repositories&) { return Ok(); }));
    reactor_.restart();
    return reactor_.poll();
  }

  testing::TempDirectory data_;
  boost::asio::io_context reactor_;
  std::unique_ptr<DatabaseThread> database_;
  std::vector<std::string> told_;
  std::unique_ptr<LeaseClerk> clerk_;
};

TEST_F(LeaseClerkTest, EndsWhatIsOverOnceAndTellsOfItsPanels) {
  lease("2026-01-08T00:00:00.000Z");
  clerk_->end_due();
  EXPECT_EQ(answers(), 0U) << "nobody has told of a lease";
  clerk_->changed({PanelId{"P-0001"}});
  EXPECT_THAT(told_, ElementsAre("P-0001"));
  answers();
  clerk_->end_due();
  clerk_->end_due();
  answers();
  EXPECT_EQ(next_end(), "");
  EXPECT_THAT(told_, ElementsAre("P-0001", "P-0001"));
  answers();
  clerk_->end_due();
  EXPECT_EQ(answers(), 0U) << "there is none any more";
}

TEST_F(LeaseClerkTest, LetsOneLastThatIsNotOver) {
  lease("2999-01-08T00:00:00.000Z");
  clerk_->changed({});
  answers();
  clerk_->end_due();
  EXPECT_EQ(answers(), 0U);
  EXPECT_EQ(next_end(), "2999-01-08T00:00:00.000Z");
}

// Whatever was asked last is answered on the reactor, which may run on.
TEST_F(LeaseClerkTest, WhatIsAnsweredAfterItsEndIsDropped) {
  lease("2026-01-08T00:00:00.000Z");
  clerk_->changed({});
  answers();
  clerk_->end_due();
  clerk_->changed({});
  clerk_.reset();
  EXPECT_EQ(next_end(), "") << "it was asked for, and is done";
  EXPECT_GE(answers(), 2U);
  EXPECT_THAT(told_, IsEmpty());
  database_.reset();
  reactor_.restart();
  EXPECT_EQ(reactor_.poll(), 0U);
}

}  // namespace
}  // namespace veneer::daemon
