// A process that reserves, leases, cuts, books and settles wood, killed at any moment (kill -9): of what it
// acknowledged nothing is lost, of what it was at nothing is half done, and no wood is held twice. `./dev soak ledger`
// kills it more often (VENEER_SEED, VENEER_KILLS).
//
// What a process does is drawn from a seed and from what the database says. So a copy of the database, on which the
// same is done and nobody is killed, says what must be in the killed one, row by row.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <random>

#include "db/leases.h"
#include "tests/db/cell_database.h"
#include "tests/db/everything.h"
#include "tests/support/campaign_size.h"

namespace veneer::db {
namespace {

using testing::number_from;

constexpr int kRoundsOfOneFile = 40;  // it grows, and the wood runs out

class BusyProcess {
 public:
  BusyProcess(Database& database, std::uint32_t seed) : database_(database), jobs_(database), random_(seed) {}

  // The first step is the recovery, as at every start. kConflict when the wood is taken: an answer like another.
  Status step() {
    if (!std::exchange(recovered_, true)) return jobs_.recover(kLater).ok() ? Ok() : failed("recovery");
    const auto run = row("SELECT id FROM runs WHERE ended_at IS NULL");
    return run ? cut({*run}) : prepare();
  }

 private:
  unsigned below(unsigned limit) { return static_cast<unsigned>(random_() % limit); }
  static Status failed(const std::string& what) { return Error{ErrorCode::kStorage, what + " failed"}; }

  // One of the numbers that the query finds.
  std::optional<std::int64_t> row(const std::string& query) {
    SQLite::Statement rows(database_.connection(), query);
    std::vector<std::int64_t> all;
    while (rows.executeStep()) all.push_back(rows.getColumn(0).getInt64());
    if (all.empty()) return std::nullopt;
    return all[below(static_cast<unsigned>(all.size()))];
  }

  Status cut(RunId run) {
    const auto cutting = row("SELECT piece FROM allocations WHERE state = 'cutting'");
    if (below(12) == 0) return jobs_.abort_run(run, {}, "stop", kLater);
    if (cutting) return jobs_.book_piece({*cutting}, kNow);
    const auto next =
        row("SELECT a.piece FROM allocations AS a JOIN runs AS r ON r.job = a.job AND r.panel = a.panel WHERE "
            "r.ended_at IS NULL AND a.state = 'reserved'");
    if (!next || below(12) == 0) return jobs_.finish_run(run, below(2) == 0, kLater);
    return jobs_.mark_cutting({*next}, kNow);
  }

  PlannedPatch somewhere(const std::string& mark) {
    const PanelId panel{below(2) == 0 ? "P-0001" : "P-0002"};
    const double x = 2 + 16.0 * below(26), y = 2 + 16.0 * below(17);
    return square_piece(mark, panel, x, y, 14);
  }
  NewPlan some_plan() {
    std::vector<PlannedPatch> pieces;
    for (unsigned i = 0, n = 1 + below(5); i < n; ++i) pieces.push_back(somewhere(fmt::format("A{}", i)));
    return job_of(pieces);
  }
  Status reserve() {
    const auto made = jobs_.create(some_plan(), kNow);
    return made.ok() ? Ok() : Status(made.error());
  }
  // A plan is kept, leases its wood, and gives it back, to a job of its own or to nobody.
  Status lease() {
    Leases leases(database_);
    if (const auto leased = row("SELECT plan FROM leases WHERE ended IS NULL"); leased && below(2) == 0) {
      if (below(3) == 0) return leases.release({*leased}, kLater);
      if (below(2) == 0) return leases.expire(kLater).ok() ? Ok() : failed("expiry");
      const auto made = jobs_.create(PlanId{*leased}, kNow);
      return made.ok() ? Ok() : Status(made.error());
    }
    const auto kept = row(
        "SELECT id FROM plans WHERE id NOT IN (SELECT plan FROM jobs) AND id NOT IN (SELECT plan FROM redos) AND id "
        "NOT IN (SELECT plan FROM leases WHERE ended IS NULL)");
    if (!kept || below(3) == 0) {
      const auto stored = Plans(database_).add(some_plan(), kNow);
      return stored.ok() ? Ok() : Status(stored.error());
    }
    const auto taken = leases.take({*kept}, "local:1000", kNow, below(2) == 0 ? kLater : "2026-05-08T07:30:00.000Z");
    return taken.ok() ? Ok() : Status(taken.error());
  }
  Status redo() {
    const auto piece = row(
        "SELECT piece FROM piece_states AS s JOIN jobs AS j ON j.id = s.job WHERE j.state <> 'running' AND s.state IN "
        "('cut', 'scrap', 'released')");
    if (!piece) return reserve();
    const PieceRecord lost = must(jobs_.find_piece({*piece}));
    const auto made = jobs_.redo(lost.job, job_of({somewhere(lost.mark)}), kLater);
    return made.ok() ? Ok() : Status(made.error());
  }
  Status prepare() {
    const unsigned what = below(13);
    if (what >= 10) return lease();
    if (what < 2) return reserve();
    if (what == 2) return redo();
    if (what == 3)
      if (const auto job = row("SELECT id FROM jobs WHERE state IN ('planned', 'stopped', 'aborted')"))
        return jobs_.cancel({*job}, kLater);
    if (what == 4)
      if (const auto piece = row("SELECT piece FROM allocations WHERE state = 'suspect'")) {
        constexpr AllocationState kVerdicts[] = {AllocationState::kCut, AllocationState::kScrap,
                                                 AllocationState::kReleased};
        return jobs_.settle({*piece}, kVerdicts[below(3)], kLater);
      }
    if (what == 5) return Ledger(database_).write_off(PanelId{"P-0001"}, somewhere("").allocation, "a knot", kLater);
    const auto wood = row(
        "SELECT a.id FROM allocations AS a JOIN jobs AS j ON j.id = a.job WHERE a.state = 'reserved' AND j.state NOT "
        "IN ('complete', 'cancelled')");
    if (!wood) return reserve();
    SQLite::Statement of(database_.connection(), "SELECT job, panel FROM allocations WHERE id = ?");
    of.bind(1, *wood);
    of.executeStep();
    const auto run = jobs_.start_run({of.getColumn(0).getInt64()}, PanelId{of.getColumn(1).getString()}, {}, 0.05_mm,
                                     kNow, {"local:1000", {}, "[]"});
    return run.ok() ? Ok() : Status(run.error());
  }

  Database& database_;
  JobStore jobs_;
  std::mt19937 random_;
  bool recovered_ = false;
};

bool answered(const Status& status) { return status.ok() || status.error().code == ErrorCode::kConflict; }

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

// Told by boxes: every piece of this campaign is a square.
std::size_t overlaps_in(Database& database) {
  std::size_t found = 0;
  for (const char* panel : {"P-0001", "P-0002"}) {
    std::vector<Box<PanelFrame>> boxes;
    for (const auto& live : must(Ledger(database).live_allocations(PanelId{panel})))
      boxes.push_back(bounds(live.area.rings().front()));
    for (std::size_t i = 0; i < boxes.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        if (boxes[i].min.x < boxes[j].max.x && boxes[j].min.x < boxes[i].max.x && boxes[i].min.y < boxes[j].max.y &&
            boxes[j].min.y < boxes[i].max.y)
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
  }
  std::printf(
      "%u kills: %ld steps acknowledged, %u killed before the first, %u with a step that was not acknowledged "
      "any more\n",
      kills, steps, while_opening, in_a_step);
}

}  // namespace
}  // namespace veneer::db
