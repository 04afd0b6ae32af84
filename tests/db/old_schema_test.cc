// Databases of every older schema, with rows: what they hold is there after the newest program has opened them.
#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>
#include <sqlite3.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <iterator>

#include "db/audit.h"
#include "db/certificates.h"
#include "db/leases.h"
#include "db/materials.h"
#include "db/migrations.h"
#include "tests/db/cell_database.h"
#include "tests/db/old_rows.h"
#include "tests/db/stray_sql.h"

namespace veneer::db {
namespace {

using ::testing::ElementsAre;

class OldSchema : public ::testing::TestWithParam<int> {};

TEST_P(OldSchema, KeepsItsRows) {
  const testing::TempDirectory directory;
  const auto file = directory / "veneerd.db";
  {
    SQLite::Database old(file.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
    register_functions(old);
    old.exec("PRAGMA foreign_keys = ON; PRAGMA application_id = 1447970130");  // "VNER"
    VENEER_ASSERT_OK(migrate(old, migrations().first(1)));
    old.exec(kOldRows);
    VENEER_ASSERT_OK(migrate(old, migrations().first(static_cast<std::size_t>(GetParam()))));
  }
  Database database = must(Database::open(file));
  EXPECT_EQ(database.schema_version(), migrations().back().version);
  VENEER_EXPECT_OK(database.check_integrity());
  VENEER_EXPECT_OK(Plans(database).check_files());

  Panels panels(database);
  const PanelRecord rest = must(panels.find({"P-0002"}));
  EXPECT_EQ(rest.name, "rest");
  EXPECT_EQ(rest.parent, PanelId{"P-0001"});
  EXPECT_EQ(rest.map_file, "map2");
  EXPECT_EQ(rest.mask_file, "mask2");
  EXPECT_EQ(rest.map_hash, "h2");
  EXPECT_EQ(rest.mask_version, 1);
  EXPECT_EQ(must(panels.scans({"P-0001"})).at(0).max, 0.02_mm);
  EXPECT_EQ(must(panels.fiducials({"P-0001"})).size(), 2U);
  EXPECT_EQ(must(panels.next_panel_id()).value, "P-0003");

  JobStore jobs(database);
  const JobRecord job = must(jobs.find({7}));
  EXPECT_EQ(job.name, "portrait");
  EXPECT_EQ(job.state, JobState::kAborted);
  EXPECT_EQ(job.preview_file, "preview");
  EXPECT_EQ(job.options_json, "{\"o\":1}");
  const PlanRecord plan = must(Plans(database).find(job.plan));
  EXPECT_EQ(plan.placed, 3);
  EXPECT_THAT(plan.panels, ElementsAre(PlannedPanel{{"P-0001"}, 1}, PlannedPanel{{"P-0002"}, 1}));
  EXPECT_EQ(must(Plans(database).plan_json(job.plan)), "{\"schema_version\":1}");
  const auto pieces = must(jobs.pieces({7}));
  ASSERT_EQ(pieces.size(), 4U);
  EXPECT_EQ(pieces[0].id.value, 11);
  EXPECT_EQ(pieces[0].state, PieceState::kCut);
  EXPECT_EQ(pieces[1].state, PieceState::kReserved);
  EXPECT_EQ(pieces[1].panel, PanelId{"P-0002"});
  EXPECT_EQ(pieces[1].panel_from_artwork.handedness(), Handedness::kImproper);
  EXPECT_EQ(pieces[1].panel_outline[1], point<PanelFrame>(19, 0));
  EXPECT_EQ(pieces[2].state, PieceState::kUnfilled);
  EXPECT_EQ(pieces[2].panel, std::nullopt);
  EXPECT_EQ(pieces[3].state, PieceState::kSuspect);
  EXPECT_EQ(must(jobs.runs({7})).at(0).result, "stop");

  const auto live = must(Ledger(database).live_allocations({"P-0001"}));
  ASSERT_EQ(live.size(), 3U);
  EXPECT_EQ(live[0].outline.size(), 3U);
  EXPECT_EQ(live[0].changed_at, "t3");
  EXPECT_EQ(live[2].reason, "burnt");
  EXPECT_TRUE(live[2].outline.empty());
  EXPECT_EQ(must(Certificates(database).list()).at(0).id.value, 5);
  const auto noted = must(Audit(database).latest(10));
  ASSERT_EQ(noted.size(), 2U);
  EXPECT_EQ(noted[1].id, 9);
  EXPECT_EQ(noted[1].what, "job.start");
  EXPECT_NE(noted[0].hash, noted[1].hash);

  // The wood is held as before, and the day goes on.
  const auto refused = jobs.create(job_of({square_piece("B1", {"P-0001"}, 15, 0, 14)}), kNow);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kConflict);
  VENEER_EXPECT_OK(jobs.settle({14}, AllocationState::kReleased, kNow, "user anna"));
  VENEER_EXPECT_OK(jobs.cancel({7}, kNow));
  EXPECT_EQ(must(jobs.create(job_of({square_piece("B1", {"P-0001"}, 45, 20, 14)}), kNow)).value, 8);
  const auto wood = must(Ledger(database).allocations({"P-0001"}, {0}, 10));
  ASSERT_EQ(wood.size(), 4U);
  EXPECT_EQ(wood[0].id.value, 21);
  EXPECT_EQ(wood[3].id.value, 25) << "no number is handed out again";
  // Wood is leased that was booked before there were leases, and given back.
  const PlanId kept = must(Plans(database).add(job_of({square_piece("C1", {"P-0001"}, 40, 0, 9)}), kNow));
  VENEER_EXPECT_OK(Leases(database).take(kept, "local:1000", kNow, kLater));
  EXPECT_FALSE(jobs.create(job_of({square_piece("D1", {"P-0001"}, 42, 2, 5)}), kNow).ok());
  VENEER_EXPECT_OK(database.check_integrity());
}

// Ends the process as soon as so many plans are files: asked by SQLite between any two of its steps, so that it strikes
// at the same place each time.
struct Killer {
  std::filesystem::path plans;
  int after = 0;
};
int kill_in_time(void* of) {
  const auto& killer = *static_cast<const Killer*>(of);
  std::error_code none;
  const std::filesystem::directory_iterator files(killer.plans, none);
  if ((none ? 0 : std::distance(begin(files), end(files))) >= killer.after) kill(getpid(), SIGKILL);
  return 0;
}
Killer killer;  // of a child process
int let_it_be_killed(sqlite3* connection, const char**, const void*) {
  sqlite3_progress_handler(connection, 1, &kill_in_time, &killer);
  return SQLITE_OK;
}

// What plans say moves out of the database into files, whatever moment the program is killed at.
TEST(OldPlans, SurviveAKillWhileTheyAreMovedIntoFiles) {
  constexpr int kPlans = 40;
  const auto text_of = [](int id) { return fmt::format("{{\"schema_version\":1,\"id\":{}}}", id); };
  for (int kill_after = 0; kill_after < kPlans; kill_after += 3) {
    const testing::TempDirectory directory;
    const auto file = directory / "veneerd.db";
    {
      SQLite::Database old(file.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
      register_functions(old);
      old.exec("PRAGMA application_id = 1447970130; PRAGMA journal_mode = WAL");
      VENEER_ASSERT_OK(migrate(old, migrations().first(12)));
      for (int id = 1; id <= kPlans; ++id)
        old.exec(
            fmt::format("INSERT INTO plans (id, name, who, created_at, target_file, preview_file, plan_json, "
                        "options_json, report_json) VALUES ({}, 'n', 'w', 't', '', '', '{}', '{{}}', '{{}}')",
                        id, text_of(id)));
      old.exec("DELETE FROM plans WHERE id = 40");
    }
    const pid_t child = fork();
    if (child == 0) {
      killer = {directory / "plans", kill_after};
      sqlite3_auto_extension(reinterpret_cast<void (*)()>(&let_it_be_killed));
      static_cast<void>(Database::open(file));
      _exit(0);
    }
    ASSERT_GT(child, 0);
    int ended = 0;
    ASSERT_EQ(waitpid(child, &ended, 0), child);
    ASSERT_TRUE(WIFSIGNALED(ended)) << "nothing struck after " << kill_after << " files";
    std::error_code none;
    const std::filesystem::directory_iterator files(directory / "plans", none);
    EXPECT_EQ(none ? 0 : std::distance(begin(files), end(files)), kill_after);
    Database database = must(Database::open(file));
    Plans plans(database);
    VENEER_EXPECT_OK(plans.check_files());
    const auto all = must(plans.list());
    ASSERT_EQ(all.size(), static_cast<std::size_t>(kPlans - 1));
    for (const PlanRecord& plan : all)
      EXPECT_EQ(must(plans.plan_json(plan.id)), text_of(static_cast<int>(plan.id.value)));
    // The number of the one that was removed is not handed out again.
    EXPECT_EQ(must(plans.add(job_of({}), kNow)).value, kPlans + 1);
    VENEER_EXPECT_OK(database.check_integrity());
  }
}

INSTANTIATE_TEST_SUITE_P(Versions, OldSchema, ::testing::Range(1, static_cast<int>(migrations().size())));

}  // namespace
}  // namespace veneer::db
