// The database against a model of it, which knows areas as sets of unit cells (tests/db/modelled_cell.h).
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <string>

#include "tests/db/modelled_cell.h"
#include "tests/db/tried_transactions.h"

namespace veneer::db {
namespace {

// Drawn so seldom that a few sequences may leave them out: credentials are ended and recipes removed only where there
// are some, most leases are ended by what takes their wood, and few suspect pieces were seen by the scan that counts.
// The sequences of './dev soak ledger' leave out nothing.
constexpr std::array kSeldom = {"Accounts::end(", "Materials::remove_recipe(", "Leases::expire(",
                                "JobStore::settle_as_seen("};
constexpr int kMany = 10'000;  // sequences

TEST(LedgerModel, TheDatabaseAgreesWithTheModelWhateverIsDone) {
  TriedTransactions tried;
  std::map<std::string, int> given;
  int sequences = 0, made_again_at_once = 0;
  const bool agreed = rc::check("the database agrees with the model whatever is done", [&] {
    ModelledCell cell(ModelledCell::Backups::kPutBack);
    cell.on_open([&](Database& database) { tried.watch(database); });
    const int steps = *in_range(20, 100);
    for (int i = 0; i < steps; ++i) {
      cell.step();
      cell.compare();
    }
    RC_ASSERT(cell.sound());
    ++sequences;
    made_again_at_once += cell.made_again_at_once();
    for (const auto& [name, times] : cell.given()) given[name] += times;
  });
  ASSERT_TRUE(agreed);
  for (const auto& [name, times] : given) std::printf("%6d %s\n", times, name.c_str());
  std::printf("%6d times several pieces were made again at once\n", made_again_at_once);
  if (sequences < 60) return;  // somebody looks at one that failed
  EXPECT_GT(made_again_at_once, 0);
  for (const auto& command : ModelledCell::commands()) EXPECT_GT(given[command.name], 0) << command.name;
  auto left_out = tried.left_out();
  if (sequences < kMany)
    std::erase_if(left_out, [](const std::string& place) {
      return std::ranges::any_of(kSeldom,
                                 [&](const char* function) { return place.find(function) != std::string::npos; });
    });
  EXPECT_THAT(left_out, ::testing::IsEmpty()) << "a transaction that the model does not know";
}

}  // namespace
}  // namespace veneer::db
