// The database against a model of it, which knows areas as sets of unit cells (tests/db/modelled_cell.h).
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/db/modelled_cell.h"

namespace veneer::db {
namespace {

RC_GTEST_PROP(LedgerModel, TheDatabaseAgreesWithTheModelWhateverIsDone, ()) {
  ModelledCell cell(ModelledCell::Backups::kPutBack);
  const int steps = *rc::gen::inRange(20, 100);
  for (int i = 0; i < steps; ++i) {
    cell.step();
    cell.compare();
  }
  RC_ASSERT(cell.sound());
  RC_CLASSIFY(cell.panels().size() > 2, "with parts of panels that were sawn apart");
}

}  // namespace
}  // namespace veneer::db
