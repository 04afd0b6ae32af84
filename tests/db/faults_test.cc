// The n-th operation of the disk fails, or the n-th piece of memory is refused, in every transaction of the stores: it
// is done or it is not, it says in one sentence why not, and it succeeds when it is tried again. CI tries some of the
// n, `./dev soak ledger` every one (VENEER_SEED, VENEER_FAULT_STRIDE).
#include <gmock/gmock.h>

#include <cstdio>
#include <map>
#include <optional>
#include <random>

#include "db/backup.h"
#include "tests/db/a_day.h"
#include "tests/db/everything.h"
#include "tests/db/old_rows.h"
#include "tests/db/power_loss_vfs.h"
#include "tests/db/scarce_memory.h"
#include "tests/support/campaign_size.h"

namespace veneer::db {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using testing::number_from;
namespace fs = std::filesystem;

struct Fault {
  const char* name;
  std::optional<DiskFault> disk;  // else memory
  bool lasts = false;             // until the attempt is over
};
constexpr Fault kFaults[] = {
    {"a read", DiskFault::kRead},
    {"a write", DiskFault::kWrite},
    {"a sync", DiskFault::kSync},
    {"an open", DiskFault::kOpen},
    {"a lock", DiskFault::kLock},
    {"a full disk", DiskFault::kFull},
    {"memory", std::nullopt},
    {"a dead disk", DiskFault::kWrite, true},
    {"no sync", DiskFault::kSync, true},
    {"a disk that stays full", DiskFault::kFull, true},
    {"no memory left", std::nullopt, true},
};

// One sentence for an operator: what, and behind the last colon or semicolon the remedy.
void expect_clear(const Error& error) {
  EXPECT_TRUE(error.code == ErrorCode::kStorage || error.code == ErrorCode::kUnavailable)
      << to_string(error.code) << ": " << error.message;
  EXPECT_THAT(error.message, Not(HasSubstr("\n")));
  EXPECT_TRUE(error.message.find(": ") != std::string::npos || error.message.find("; ") != std::string::npos)
      << error.message;
  EXPECT_THAT(error.message, Not(HasSubstr("damaged"))) << "the file is sound";
}

class FaultsTest : public ::testing::Test {
 protected:
  fs::path file() const { return directory_ / "veneerd.db"; }
  void open() { database_.emplace(must(Database::open(file()))); }
  // The files as they are when nobody has them open.
  void keep() { copy_files(file(), kept()); }
  void put_back() { copy_files(kept(), file()); }
  void copy_files(const fs::path& from, const fs::path& to) {
    database_.reset();
    for (const char* end : {"", ".clean"}) {
      fs::remove(to.string() + end);
      if (fs::exists(from.string() + end)) fs::copy_file(from.string() + end, to.string() + end);
    }
    open();
  }
  // As whoever reads next finds it.
  std::string rows() {
    VENEER_EXPECT_OK(Panels(*database_).list());
    return rows_in(database_->connection());
  }

  void arm(const Fault& fault, int nth) {
    fault.disk ? disk_.fail_at(*fault.disk, nth, fault.lasts) : memory_.fail_at(nth, fault.lasts);
  }
  bool disarm() {
    const bool disk = disk_.mend(), memory = memory_.mend();
    return disk || memory;
  }

  // Tries `step` with every `nth` of the fault until it is done without meeting it.
  void try_under(const Fault& fault, const Step& step) {
    const std::string before = rows();
    // A transaction asks the disk some ten times and for memory some thousand times.
    const unsigned stride = fault.disk ? 1 + stride_ / 20 : stride_;
    for (int nth = 1 + static_cast<int>(random_() % stride);;
         nth += 1 + static_cast<int>(random_() % (2 * stride - 1))) {
      SCOPED_TRACE(fmt::format("{}, {} {}", step.name, fault.name, nth));
      arm(fault, nth);
      const Status done = step(*database_);
      const bool met = disarm();
      if (!met) {
        VENEER_ASSERT_OK(done);
        return;
      }
      ++tried_[fault.name];
      if (!done.ok()) expect_clear(done.error());
      const std::string after = rows();
      if (done.ok()) {
        ++unharmed_[fault.name];
        ASSERT_TRUE(after != before) << "it says that it is done";
        put_back();
      } else {
        ASSERT_TRUE(after == before) << "something is half done";
        // A fault that lasts may leave SQLite nothing to know by what it has forgotten.
        const auto doubt = database_->take_doubt();
        EXPECT_TRUE(fault.lasts || !doubt) << *doubt;
      }
      if (HasFailure()) return;
    }
  }

  ScarceMemory memory_;
  PowerLossVfs disk_;
  testing::TempDirectory directory_;
  std::optional<Database> database_;
  std::mt19937 random_{static_cast<std::uint32_t>(number_from("VENEER_SEED", 20260501))};
  unsigned stride_ = static_cast<unsigned>(number_from("VENEER_FAULT_STRIDE", 120 * testing::kFewer));
  std::map<std::string, int> tried_, unharmed_;

 private:
  fs::path kept() const { return directory_ / "kept.db"; }
};

TEST_F(FaultsTest, EveryTransactionIsDoneOrNotAndSaysWhyNot) {
  open();
  for (const Step& step : a_day()) {
    keep();
    for (const Fault& fault : kFaults) {
      if (fault.name != std::string(kFaults[0].name)) put_back();
      try_under(fault, step);
      if (HasFailure()) return;
    }
  }
  VENEER_EXPECT_OK(database_->check_integrity());
  for (const auto& [name, tries] : tried_)
    std::printf("%-22s %6d times in a transaction, %d of them harmless\n", name.c_str(), tries, unharmed_[name]);
}

TEST_F(FaultsTest, ADayTouchesEveryTable) {
  open();
  const std::string fresh = rows();
  for (const Step& step : a_day()) VENEER_ASSERT_OK(step(*database_));
  for (const auto& table : tables(database_->connection()))
    EXPECT_GT(database_->connection().execAndGet("SELECT count(*) FROM " + table).getInt(), 0)
        << table << ": the day (a_day.h) has no step for it";
}

TEST_F(FaultsTest, ADatabaseIsOpenedOrNotAndNothingIsLost) {
  open();
  for (const Step& step : a_day()) VENEER_ASSERT_OK(step(*database_));
  const std::string wanted = rows();
  int opened = 0, refused = 0;
  for (const bool checked : {false, true})
    for (const Fault& fault : kFaults)
      for (int nth = 1 + static_cast<int>(random_() % stride_);;
           nth += 1 + static_cast<int>(random_() % (40 * stride_))) {
        SCOPED_TRACE(fmt::format("{} {}, {}", fault.name, nth, checked ? "checked whole" : "closed in order"));
        database_.reset();
        if (checked) fs::remove(file().string() + ".clean");
        arm(fault, nth);
        {
          const auto result = Database::open(file());
          if (!result.ok()) expect_clear(result.error());
          (result.ok() ? opened : refused) += 1;
        }
        const bool met = disarm();
        open();
        ASSERT_EQ(rows(), wanted);
        if (HasFailure()) return;
        if (!met) break;
      }
  std::printf("opened %d times, refused %d times\n", opened, refused);
}

// Whoever reads that the backup's disk failed looks at the wrong one.
TEST_F(FaultsTest, ACopyThatFailsSaysWhichOfTheTwoDisksItWas) {
  open();
  for (const Step& step : a_day()) VENEER_ASSERT_OK(step(*database_));
  const fs::path copy = directory_ / "copy.db";
  for (const DiskFault kind : {DiskFault::kRead, DiskFault::kWrite})
    for (const int nth : {3, 5, 20}) {  // the first reads ask whether the copy is empty
      SCOPED_TRACE(nth);
      Database reading = must(Database::open_for_reading(file()));
      disk_.fail_at(kind, nth, false);
      const Status failed = copy_database(reading, copy, {}, {});
      EXPECT_TRUE(disk_.mend());
      ASSERT_FALSE(failed.ok());
      expect_clear(failed.error());
      EXPECT_THAT(failed.error().message, HasSubstr((kind == DiskFault::kRead ? file() : copy).string()));
      EXPECT_FALSE(fs::exists(copy));
      VENEER_EXPECT_OK(copy_database(reading, copy, {}, {}));
      fs::remove(copy);
    }
}

TEST_F(FaultsTest, ANewDatabaseIsMadeWholeOrMadeByTheNextStart) {
  open();
  const std::string wanted = everything_in(database_->connection());
  for (const Fault& fault : kFaults)
    for (int nth = 1 + static_cast<int>(random_() % stride_);;
         nth += 1 + static_cast<int>(random_() % (40 * stride_))) {
      SCOPED_TRACE(fmt::format("{} {}", fault.name, nth));
      database_.reset();
      for (const char* end : {"", "-wal", "-shm", ".clean"}) fs::remove(file().string() + end);
      arm(fault, nth);
      {
        const auto result = Database::open(file());
        if (!result.ok()) expect_clear(result.error());
      }
      const bool met = disarm();
      open();
      ASSERT_EQ(everything_in(database_->connection()), wanted);
      if (HasFailure()) return;
      if (!met) break;
    }
}

// What older programs wrote is all there, in the newest schema: after this start, or after the next one.
TEST_F(FaultsTest, AnOldDatabaseIsBroughtUpToDateByThisStartOrTheNext) {
  const int newest = static_cast<int>(migrations().size());
  int brought = 0, left = 0;
  for (const int version : {1, 12, newest - 1}) {
    const fs::path old = directory_ / fmt::format("old-{}", version);
    fs::create_directory(old);
    {
      SQLite::Database connection((old / "veneerd.db").string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
      grow(connection, version);
    }
    const auto lay = [&] {
      database_.reset();
      for (const char* end : {"", "-wal", "-shm", ".clean"}) fs::remove(file().string() + end);
      fs::remove_all(directory_ / "plans");
      fs::copy(old, directory_.path(), fs::copy_options::recursive);
    };
    lay();
    open();
    const std::string wanted = everything_in(database_->connection());
    for (const Fault& fault : kFaults) {
      const unsigned stride = fault.disk ? 4 * stride_ : 400 * stride_;
      for (int nth = 1 + static_cast<int>(random_() % stride);;
           nth += 1 + static_cast<int>(random_() % (2 * stride - 1))) {
        SCOPED_TRACE(fmt::format("schema {}, {} {}", version, fault.name, nth));
        lay();
        arm(fault, nth);
        {
          const auto result = Database::open(file());
          if (!result.ok()) expect_clear(result.error());
          (result.ok() ? brought : left) += 1;
        }
        const bool met = disarm();
        open();
        ASSERT_EQ(everything_in(database_->connection()), wanted);
        VENEER_EXPECT_OK(Plans(*database_).check_files());
        if (HasFailure()) return;
        if (!met) break;
      }
    }
  }
  std::printf("brought up to date %d times, left for the next start %d times\n", brought, left);
}

}  // namespace
}  // namespace veneer::db
