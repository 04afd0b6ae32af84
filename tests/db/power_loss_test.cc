// A day at the cell, and a newer program's first start on a database of years, cut short at every step of the disk:
// what was acknowledged is there, what was not is there whole or not at all, whatever the disk kept of the rest. `./dev
// soak ledger` looks at more images (VENEER_IMAGES of each kind at every VENEER_CUT_STRIDE-th step).
#include <gtest/gtest.h>

#include <array>
#include <cstdio>

#include "tests/db/a_day.h"
#include "tests/db/everything.h"
#include "tests/db/old_rows.h"
#include "tests/db/power_loss_vfs.h"
#include "tests/support/campaign_size.h"

namespace veneer::db {
namespace {

using testing::number_from;

// states[k]: the rows after k steps.
std::vector<std::string> states_of(const std::vector<Step>& day) {
  CellDatabase cell;
  std::vector<std::string> states = {rows_in(cell.database().connection())};
  for (const Step& step : day) {
    const Status done = step(cell.database());
    EXPECT_TRUE(done.ok()) << step.name << ": " << done.error().message;
    states.push_back(rows_in(cell.database().connection()));
  }
  return states;
}

// What must hold when the file is opened again after `acknowledged` steps.
void expect_true_after(const std::filesystem::path& file, std::size_t acknowledged,
                       const std::vector<std::string>& states) {
  Database database = must(Database::open_unchecked(file));
  VENEER_ASSERT_OK(database.check_integrity());
  const std::string found = rows_in(database.connection());
  EXPECT_TRUE(found == states[acknowledged] || (acknowledged + 1 < states.size() && found == states[acknowledged + 1]))
      << "after " << acknowledged << " steps";
  VENEER_EXPECT_OK(JobStore(database).recover(kLater));
  EXPECT_EQ(database.connection().execAndGet("SELECT count(*) FROM allocations WHERE state = 'cutting'").getInt(), 0);
  EXPECT_EQ(database.connection().execAndGet("SELECT count(*) FROM jobs WHERE state = 'running'").getInt(), 0);
}

// What stands beside the file when the power goes, which no image loses and each open may change: that a database was
// made there, and the mark of an orderly end.
class Beside {
 public:
  explicit Beside(const std::filesystem::path& file)
      : lock_(file.string() + ".lock"),
        clean_(file.string() + ".clean"),
        lock_bytes_(std::filesystem::file_size(lock_)) {}
  // As the image before found it.
  void put_back() const {
    std::filesystem::remove(clean_);
    std::filesystem::resize_file(lock_, lock_bytes_);
  }

 private:
  std::filesystem::path lock_, clean_;
  std::uintmax_t lock_bytes_;
};

// The steps that were acknowledged before the power went.
std::size_t live_through(const std::vector<Step>& day, const std::filesystem::path& file) {
  auto database = Database::open(file);
  if (!database.ok()) return 0;
  std::size_t acknowledged = 0;
  for (const Step& step : day) {
    if (!step(*database).ok()) break;
    ++acknowledged;
  }
  return acknowledged;
}

TEST(PowerLoss, LeavesTheDatabaseTrueAtEveryStepOfTheDisk) {
  const auto day = a_day();
  const auto states = states_of(day);
  int total = 0;
  {
    PowerLossVfs disk;
    const testing::TempDirectory directory;
    ASSERT_EQ(live_through(day, directory / "veneerd.db"), day.size());
    total = disk.steps();
  }
  ASSERT_GT(total, 100);
  const auto seed = static_cast<std::uint32_t>(number_from("VENEER_SEED", 20260501));
  const auto images = static_cast<std::uint32_t>(number_from("VENEER_IMAGES", 1));
  const auto stride = static_cast<int>(number_from("VENEER_CUT_STRIDE", 40 * testing::kFewer));
  std::array<int, 3> looked_at{};
  for (int step = 1 + static_cast<int>(seed % static_cast<std::uint32_t>(stride)); step <= total; step += stride) {
    PowerLossVfs disk;
    const testing::TempDirectory directory;
    const auto file = directory / "veneerd.db";
    disk.cut_at(step);
    const std::size_t acknowledged = live_through(day, file);
    ASSERT_TRUE(disk.is_cut());
    const Beside beside(file);
    for (const Loss loss : {Loss::kDropped, Loss::kTorn, Loss::kReordered})
      for (std::uint32_t i = 0; i < (loss == Loss::kDropped ? 1 : images); ++i) {
        beside.put_back();
        disk.settle(loss, seed + static_cast<std::uint32_t>(step) * images + i);
        SCOPED_TRACE(fmt::format("step {} of the disk, loss {}, image {}", step, static_cast<int>(loss), i));
        expect_true_after(file, acknowledged, states);
        if (HasFailure()) return;
        ++looked_at[static_cast<std::size_t>(loss)];
      }
  }
  std::printf("%d steps of the disk; images: %d with all dropped, %d torn, %d reordered\n", total, looked_at[0],
              looked_at[1], looked_at[2]);
  // What a soak promises.
  if (stride == 1) {
    EXPECT_GE(looked_at[0] + looked_at[1] + looked_at[2], 2000);
  }
}

// ---- while a database of an older schema is brought to the newest
// -----------------------------------------------------

class PowerLossInAMigration : public ::testing::TestWithParam<int> {
 protected:
  // The database that has grown to that schema, as years of it left it.
  void SetUp() override {
    {
      SQLite::Database old(grown_.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
      ASSERT_NO_FATAL_FAILURE(grow(old, GetParam()));
    }
    std::filesystem::copy_file(grown_, directory_ / "migrated.db");
    Database migrated = must(Database::open(directory_ / "migrated.db"));
    ASSERT_EQ(migrated.schema_version(), migrations().back().version);
    wanted_ = rows_in(migrated.connection());
  }

  // Steps of the disk that the migration takes; the power goes before the `step`-th of them, never for 0.
  int migrate_on(PowerLossVfs& disk, const std::filesystem::path& file, int step) {
    std::filesystem::copy_file(grown_, file);
    const int before = disk.steps();
    disk.cut_at(step);
    if (const auto opened = Database::open(file); step == 0) VENEER_EXPECT_OK(opened);
    return disk.steps() - before;
  }

  void expect_migrated_anew(const std::filesystem::path& file) {
    Database database = must(Database::open(file));
    EXPECT_EQ(database.schema_version(), migrations().back().version);
    VENEER_ASSERT_OK(database.check_integrity());
    EXPECT_EQ(rows_in(database.connection()), wanted_);
  }

  testing::TempDirectory directory_;
  std::filesystem::path grown_ = directory_ / "grown.db";
  std::string wanted_;  // all rows, after a migration that nothing disturbs
};

TEST_P(PowerLossInAMigration, LosesNothing) {
  int total = 0;
  {
    PowerLossVfs disk;
    total = migrate_on(disk, directory_ / "undisturbed.db", 0);
  }
  ASSERT_GT(total, 10);
  const auto seed = static_cast<std::uint32_t>(number_from("VENEER_SEED", 20260501));
  const auto images = static_cast<std::uint32_t>(number_from("VENEER_IMAGES", 1));
  const auto stride = static_cast<int>(number_from("VENEER_CUT_STRIDE", std::max(1, total / 6)));
  std::printf("from schema %d: %d steps of the disk\n", GetParam(), total);
  for (int step = 1 + static_cast<int>(seed % static_cast<std::uint32_t>(stride)); step <= total; step += stride) {
    PowerLossVfs disk;
    const testing::TempDirectory folder;
    const auto file = folder / "veneerd.db";
    migrate_on(disk, file, step);
    ASSERT_TRUE(disk.is_cut());
    const Beside beside(file);
    for (const Loss loss : {Loss::kDropped, Loss::kTorn, Loss::kReordered})
      for (std::uint32_t i = 0; i < (loss == Loss::kDropped ? 1 : images); ++i) {
        beside.put_back();
        disk.settle(loss, seed + static_cast<std::uint32_t>(step) * images + i);
        SCOPED_TRACE(fmt::format("step {} of the disk, loss {}, image {}", step, static_cast<int>(loss), i));
        expect_migrated_anew(file);
        if (HasFailure()) return;
      }
  }
}
INSTANTIATE_TEST_SUITE_P(From, PowerLossInAMigration, ::testing::Values(1, 12, migrations().back().version - 1));

}  // namespace
}  // namespace veneer::db
