// The cell that the scenarios begin from is made once for all their processes.
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/scenarios/prepared_cell.h"

namespace veneer::tests {
namespace {

// A PreparedCell that begins from nothing.
class Preparation : public PreparedCell {
 protected:
  static void SetUpTestSuite() {}
  void SetUp() override {}
  void TearDown() override {}
};

TEST_F(Preparation, CalibratesScansAndPlans) {
  if (made_before().empty()) GTEST_SKIP() << "every process makes its own";
  std::filesystem::remove_all(made_before());
  prepare(made_before());
}

}  // namespace
}  // namespace veneer::tests
