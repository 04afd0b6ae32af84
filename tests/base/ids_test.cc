#include "base/ids.h"

#include <gtest/gtest.h>

#include <type_traits>
#include <unordered_set>

namespace veneer {
namespace {

static_assert(!std::is_convertible_v<JobId, PieceId>);
static_assert(!std::is_same_v<ScanId, CertificateId>);

TEST(Ids, CompareAndHashByValue) {
  EXPECT_EQ(JobId{3}, JobId{3});
  EXPECT_LT(JobId{3}, JobId{4});
  EXPECT_LT(PanelId{"P-0001"}, PanelId{"P-0002"});
  const std::unordered_set<PieceId> pieces = {{1}, {2}, {1}};
  EXPECT_EQ(pieces.size(), 2U);
  const std::unordered_set<PanelId> panels = {{"P-0001"}, {"P-0001"}};
  EXPECT_EQ(panels.size(), 1U);
}

TEST(Ids, ANumericIdIsNoneUntilTheDatabaseGivesOne) { EXPECT_EQ(JobId{}.value, 0); }

}  // namespace
}  // namespace veneer
