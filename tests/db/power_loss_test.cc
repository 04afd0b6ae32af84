// A day at the cell, cut short at every step of the disk and by kill -9: what was acknowledged is there, what was not
// is there whole or not at all.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <SQLiteCpp/SQLiteCpp.h>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <random>

#include "db/audit.h"
#include "db/certificates.h"
#include "tests/db/cell_database.h"
#include "tests/db/power_loss_vfs.h"

namespace veneer::db {
namespace {

using Step = std::function<Status(Database&)>;

template <class T>
Status dropped(const Result<T>& result) {
  return result.ok() ? Ok() : Status(result.error());
}

// Ids are what a fresh database hands out: job 1 has pieces 1 to 4, job 2 has piece 5.
std::vector<Step> a_day() {
  const PanelId oak{"P-0001"}, ash{"P-0002"};
  const KeyedRequest request{"local:1000", "newJob", "k-1", "hash"};
  const auto with_jobs = [](auto action) {
    return [action](Database& database) -> Status { return action(JobStore(database)); };
  };
  const auto mark = [&](int piece) {
    return with_jobs([piece](JobStore jobs) { return jobs.mark_cutting({piece}, kNow); });
  };
  const auto book = [&](int piece) {
    return with_jobs([piece](JobStore jobs) { return jobs.book_piece({piece}, kNow); });
  };
  const auto run = [&](const PanelId& panel) {
    return with_jobs([panel](JobStore jobs) { return dropped(jobs.start_run({1}, panel, {}, 0.05_mm, kNow)); });
  };
  return {
      [=](Database& db) { return Panels(db).add(sheet(oak), {}, {}); },
      [=](Database& db) { return Panels(db).add(sheet(ash), {}, {}); },
      [](Database& db) {
        return dropped(Certificates(db).issue({{}, CertificateKind::kKerf, kNow, kLater, 0.01_mm, "{}"}));
      },
      with_jobs([=](JobStore jobs) {
        return dropped(jobs.create(job_of({square_piece("A1", oak, 10, 10, 14), square_piece("A2", oak, 30, 10, 14),
                                           square_piece("A3", oak, 50, 10, 14), square_piece("A4", ash, 10, 10, 14)}),
                                   kNow));
      }),
      with_jobs(
          [=](JobStore jobs) { return dropped(jobs.create(job_of({square_piece("B1", ash, 100, 10, 14)}), kNow)); }),
      run(oak),
      mark(1),
      book(1),
      mark(2),
      with_jobs([](JobStore jobs) { return jobs.abort_run({1}, {}, "stop", kLater); }),
      with_jobs([](JobStore jobs) { return jobs.settle({2}, AllocationState::kScrap, kLater); }),
      run(oak),
      mark(3),
      book(3),
      with_jobs([](JobStore jobs) { return jobs.finish_run({2}, true, kLater); }),
      run(ash),
      mark(4),
      book(4),
      with_jobs([](JobStore jobs) { return jobs.finish_run({3}, true, kLater); }),
      with_jobs([](JobStore jobs) { return jobs.cancel({2}, kLater); }),
      [=](Database& db) {
        return dropped(Panels(db).add_mask(ash, {0, "map", "mask", "hash", kLater}, 1));
      },
      [=](Database& db) {
        NewPlan plan = job_of({square_piece("C1", ash, 200, 10, 14), square_piece("C2", ash, 230, 10, 14)});
        plan.planned_on[0].mask_version = 2;
        plan.parent = PlanId{2};
        return dropped(Plans(db).add(plan, kLater));
      },
      [=](Database& db) { return dropped(RequestKeys(db).begin(request, kLater)); },
      with_jobs([=](JobStore jobs) { return dropped(jobs.create(PlanId{3}, kLater, request)); }),
      with_jobs([](JobStore jobs) { return jobs.cancel({3}, kLater); }),
      [](Database& db) {
        return Audit(db).append({0, kLater, "test", "day.end", ""});
      },
  };
}

// Everything the day can change, in one line.
std::string digest(Database& database) {
  return database.connection()
      .execAndGet(
          "SELECT (SELECT group_concat(id) FROM panels) || '/' || (SELECT count(*) FROM certificates) || '/' || "
          "coalesce((SELECT group_concat(state || changed_at) FROM jobs), '') || '/' || (SELECT count(*) FROM pieces) "
          "|| '/' || coalesce((SELECT group_concat(state || changed_at) FROM allocations), '') || '/' || "
          "coalesce((SELECT group_concat(result || coalesce(ended_at, '')) FROM runs), '') || '/' || "
          "(SELECT count(*) FROM audit) || '/' || (SELECT count(*) FROM masks) || '/' || (SELECT count(*) FROM plans) "
          "|| "
          "'/' || (SELECT count(*) FROM placements) || '/' || coalesce((SELECT group_concat(coalesce(result, '-')) "
          "FROM "
          "request_keys), '')")
      .getString();
}

// digests[k]: after k steps.
std::vector<std::string> digests_of(const std::vector<Step>& day) {
  CellDatabase cell;
  std::vector<std::string> digests = {digest(cell.database())};
  for (const Step& step : day) {
    const Status done = step(cell.database());
    EXPECT_TRUE(done.ok()) << done.error().message;
    digests.push_back(digest(cell.database()));
  }
  return digests;
}

// What `./dev soak ledger` changes.
std::uint32_t number_from(const char* variable, std::uint32_t otherwise) {
  const char* text = std::getenv(variable);  // NOLINT(concurrency-mt-unsafe)
  return text == nullptr ? otherwise : static_cast<std::uint32_t>(std::strtoul(text, nullptr, 10));
}

// Sanitizers make a day long; then every fourth step and a fourth of the kills must do: the optimised build does all.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr int kStride = 4;
#else
constexpr int kStride = 1;
#endif

// What must hold when the file is opened again after `acknowledged` steps.
void expect_true_after(const std::filesystem::path& file, std::size_t acknowledged,
                       const std::vector<std::string>& digests) {
  Database database = must(Database::open(file));
  VENEER_EXPECT_OK(database.check_integrity());
  const std::string found = digest(database);
  EXPECT_TRUE(found == digests[acknowledged] ||
              (acknowledged + 1 < digests.size() && found == digests[acknowledged + 1]))
      << "after " << acknowledged << " steps: " << found << "\nexpected " << digests[acknowledged];
  VENEER_EXPECT_OK(JobStore(database).recover(kLater));
  EXPECT_EQ(database.connection().execAndGet("SELECT count(*) FROM allocations WHERE state = 'cutting'").getInt(), 0);
  EXPECT_EQ(database.connection().execAndGet("SELECT count(*) FROM jobs WHERE state = 'running'").getInt(), 0);
}

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
  const auto digests = digests_of(day);
  int total = 0;
  {
    PowerLossVfs disk;
    const testing::TempDirectory directory;
    ASSERT_EQ(live_through(day, directory / "veneerd.db"), day.size());
    total = disk.steps();
  }
  ASSERT_GT(total, 100);
  const std::uint32_t seed = number_from("VENEER_SEED", 0);
  for (int step = 1; step <= total; step += kStride) {
    PowerLossVfs disk;
    const testing::TempDirectory directory;
    disk.cut_at(step);
    const std::size_t acknowledged = live_through(day, directory / "veneerd.db");
    ASSERT_TRUE(disk.is_cut());
    disk.settle(seed + static_cast<std::uint32_t>(step));
    SCOPED_TRACE(step);
    expect_true_after(directory / "veneerd.db", acknowledged, digests);
    if (HasFailure()) return;
  }
}

// The child lives the day and says one byte after each step, until it is killed.
[[noreturn]] void child(const std::filesystem::path& file, const std::vector<Step>& day, int acknowledge) {
  auto database = Database::open(file);
  if (!database.ok()) ::_exit(1);
  for (const Step& step : day)
    if (!step(*database).ok() || ::write(acknowledge, ".", 1) != 1) ::_exit(1);
  for (;;) ::pause();
}

TEST(PowerLoss, AKilledDaemonLeavesTheDatabaseTrue) {
  const auto day = a_day();
  const auto digests = digests_of(day);
  std::mt19937 random(number_from("VENEER_SEED", 20260501));
  for (std::uint32_t round = 0, rounds = number_from("VENEER_KILLS", 60 / kStride); round < rounds; ++round) {
    const testing::TempDirectory directory;
    int ends[2];
    ASSERT_EQ(::pipe(ends), 0);
    const pid_t pid = ::fork();
    ASSERT_GE(pid, 0);
    if (pid == 0) child(directory / "veneerd.db", day, ends[1]);
    ::close(ends[1]);
    const std::size_t wanted = 1 + random() % day.size();
    std::size_t acknowledged = 0;
    char byte = 0;
    while (acknowledged < wanted && ::read(ends[0], &byte, 1) == 1) ++acknowledged;
    ASSERT_EQ(acknowledged, wanted);
    ::kill(pid, SIGKILL);
    ::waitpid(pid, nullptr, 0);
    while (::read(ends[0], &byte, 1) == 1) ++acknowledged;
    ::close(ends[0]);
    SCOPED_TRACE(round);
    expect_true_after(directory / "veneerd.db", acknowledged, digests);
    if (HasFailure()) return;
  }
}

}  // namespace
}  // namespace veneer::db
