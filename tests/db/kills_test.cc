// A process that does all that a cell does (busy_process.h), in every transaction of the stores, killed at any moment
// (kill -9): of what it acknowledged nothing is lost, of what it was at nothing is half done, and no wood is held
// twice.
// `./dev soak ledger` kills it more often (VENEER_SEED, VENEER_KILLS).
//
// What a process does is drawn from a seed and from what the database says. So a copy of the database, on which the
// same is done and nobody is killed, says what must be in the killed one, row by row.
#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <optional>
#include <random>

#include "tests/db/busy_process.h"
#include "tests/db/everything.h"
#include "tests/db/tried_transactions.h"
#include "tests/support/campaign_size.h"

namespace veneer::db {
namespace {

using testing::number_from;

constexpr int kRoundsOfOneFile = 40;  // it grows, and the wood runs out

bool answered(const Status& status) {
  return status.ok() || status.error().code == ErrorCode::kConflict || status.error().code == ErrorCode::kRefused ||
         status.error().code == ErrorCode::kNotFound;
}

// Says one byte when the database is open and after each step, until it is killed.
[[noreturn]] void child(const std::filesystem::path& file, std::uint32_t seed, int acknowledge) {
  auto database = Database::open(file);
  if (!database.ok()) ::_exit(1);
  BusyProcess process(*database, seed);
  do
    if (::write(acknowledge, ".", 1) != 1) ::_exit(1);
  while (answered(process.step()));
  ::_exit(2);
}

// Starts it, kills it at a moment that the seed chooses; what it acknowledged.
int acknowledged_before_its_death(const std::filesystem::path& file, std::uint32_t seed) {
  int ends[2];
  if (::pipe(ends) != 0) return -1;
  const pid_t pid = ::fork();
  if (pid == 0) child(file, seed, ends[1]);
  ::close(ends[1]);
  std::mt19937 random(seed + 1);
  // A fourth of them while the file is opened and what was left is recovered.
  const int wanted = random() % 4 == 0 ? 0 : 1 + static_cast<int>(random() % 24);
  int said = 0;
  char byte = 0;
  while (said < wanted && ::read(ends[0], &byte, 1) == 1) ++said;
  ::usleep(static_cast<useconds_t>(random() % (wanted == 0 ? 12'000 : 1'500)));
  ::kill(pid, SIGKILL);
  int status = 0;
  ::waitpid(pid, &status, 0);
  while (::read(ends[0], &byte, 1) == 1) ++said;
  ::close(ends[0]);
  return WIFSIGNALED(status) ? said : -1;
}

std::size_t overlaps_in(Database& database) {
  std::size_t found = 0;
  for (const PanelRecord& panel : must(Panels(database).list())) {
    const auto live = must(Ledger(database).live_allocations(panel.id));
    std::vector<Box<PanelFrame>> boxes;
    boxes.reserve(live.size());
    for (const auto& wood : live) boxes.push_back(bounds_of(wood.area));
    for (std::size_t i = 0; i < boxes.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        if (boxes[i].min.x < boxes[j].max.x && boxes[j].min.x < boxes[i].max.x && boxes[i].min.y < boxes[j].max.y &&
            boxes[j].min.y < boxes[i].max.y && overlaps(live[i].area, live[j].area))
          ++found;
  }
  return found;
}

TEST(KilledStore, LosesNothingThatItAcknowledgedAndHoldsNoWoodTwice) {
  const auto first_seed = static_cast<std::uint32_t>(number_from("VENEER_SEED", 20260501));
  const auto kills = static_cast<std::uint32_t>(number_from("VENEER_KILLS", 100 / testing::kFewer));
  std::optional<testing::TempDirectory> directory;
  long steps = 0;
  std::uint32_t while_opening = 0, in_a_step = 0;
  for (std::uint32_t round = 0; round < kills; ++round) {
    const std::uint32_t seed = first_seed + 7919 * round;
    SCOPED_TRACE(seed);
    if (round % kRoundsOfOneFile == 0) {
      directory.emplace();
      Database fresh = must(Database::open(*directory / "veneerd.db"));
      for (const char* panel : {"P-0001", "P-0002"}) VENEER_ASSERT_OK(Panels(fresh).add(sheet(PanelId{panel}), {}, {}));
    }
    const auto file = *directory / "veneerd.db", unharmed = *directory / "unharmed.db";
    for (const char* end : {"", ".clean"})
      std::filesystem::copy_file(file.string() + end, unharmed.string() + end,
                                 std::filesystem::copy_options::overwrite_existing);

    const int said = acknowledged_before_its_death(file, seed);
    ASSERT_GE(said, 0) << "it ended by itself";
    while_opening += said == 0 ? 1 : 0;
    steps += std::max(said - 1, 0);

    Database killed = must(Database::open_unchecked(file));
    VENEER_ASSERT_OK(killed.check_integrity());
    const std::string found = rows_in(killed.connection());
    Database other = must(Database::open(unharmed));
    BusyProcess same(other, seed);
    for (int i = 1; i < said; ++i) ASSERT_TRUE(answered(same.step()));
    if (found != rows_in(other.connection())) {
      ++in_a_step;
      ASSERT_TRUE(said > 0 && answered(same.step()));
      ASSERT_EQ(found, rows_in(other.connection())) << "neither as after " << said << " steps nor with the next one";
    }
    ASSERT_EQ(overlaps_in(killed), 0U);
    const auto owed = must(JobStore(killed).would_owe_clear());
    if (said > 0) {
      ASSERT_TRUE(owed || !same.clear_owed()) << "an abort that was acknowledged is not owed any more";
    }
  }
  std::printf(
      "%u kills: %ld steps acknowledged, %u killed before the first, %u with a step that was not acknowledged "
      "any more\n",
      kills, steps, while_opening, in_a_step);
}

// Or the campaign would say nothing of some of what it names.
TEST(KilledStore, IsBusyWithAllThatACellDoes) {
  TriedTransactions tried;
  std::map<std::string, int> rows;
  for (std::uint32_t seed = 20260501; seed < 20260507; ++seed) {  // each until its wood runs out
    CellDatabase cell;
    tried.watch(cell.database());
    for (int i = 0; i < 2; ++i) cell.new_panel();
    BusyProcess process(cell.database(), seed);
    for (int i = 0; i < 600; ++i) {
      const Status done = process.step();
      ASSERT_TRUE(answered(done)) << done.error().message;
    }
    ASSERT_EQ(overlaps_in(cell.database()), 0U);
    for (const char* all :
         {"parts", "carried", "merges", "splits", "scans", "sightings", "mask_edits", "mask_edit_removals", "leases",
          "job_history", "done_by WHERE kind = 'made'", "done_by WHERE kind = 'job'",
          "done_by WHERE kind = 'archiving'", "redos", "proposal_verdicts WHERE verdict = 'accepted'",
          "difference_verdicts WHERE verdict = 'written_off'", "difference_verdicts WHERE verdict = 'accepted'",
          "runs WHERE result = 'stop'", "aborts WHERE cleared = 0", "aborts WHERE cleared = 1",
          "activities WHERE under_way = 0", "audit WHERE what = 'job.settle-as-seen'",
          // NOLINTNEXTLINE(bugprone-suspicious-missing-comma): one row of several lines
          "allocation_history AS h WHERE state = 'suspect' AND (SELECT state FROM allocation_history "
          "WHERE allocation = h.allocation AND id < h.id ORDER BY id DESC LIMIT 1) = 'scrap'"})
      rows[all] += cell.database().connection().execAndGet(fmt::format("SELECT count(*) FROM {}", all)).getInt();
  }
  EXPECT_THAT(tried.left_out(), ::testing::IsEmpty());
  for (const auto& [all, count] : rows) EXPECT_GT(count, 0) << all;
}

}  // namespace
}  // namespace veneer::db
