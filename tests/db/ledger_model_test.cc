// The database against a model of it, which knows areas as sets of unit cells (tests/db/modelled_cell.h).
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/db/modelled_cell.h"

namespace veneer::db {
namespace {

RC_GTEST_PROP(LedgerModel, TheDatabaseAgreesWithTheModelWhateverIsDone, ()) {
  ModelledCell cell;
  const int steps = *rc::gen::inRange(20, 100);
  for (int i = 0; i < steps; ++i) {
    cell.step();
    cell.compare();
  }
  RC_ASSERT(cell.sound());
}

}  // namespace
}  // namespace veneer::db
