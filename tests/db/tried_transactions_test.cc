// Faults and power cuts are tried on a day at the cell (a_day.h): what it does not do they never meet, so it leaves no
// transaction of the stores out. Of kills and of the model their own tests say it.
#include <gmock/gmock.h>

#include "tests/db/a_day.h"
#include "tests/db/tried_transactions.h"

namespace veneer::db {
namespace {

using ::testing::IsEmpty;

TEST(TriedTransactions, ADayAtTheCellLeavesNoneOut) {
  TriedTransactions tried;
  CellDatabase cell;
  tried.watch(cell.database());
  for (const Step& step : a_day()) {
    const Status done = step(cell.database());
    EXPECT_TRUE(done.ok()) << step.name << ": " << done.error().message;
  }
  EXPECT_THAT(tried.left_out(), IsEmpty());
}

}  // namespace
}  // namespace veneer::db
