// How much of the database a piece takes, from its plan to its last state: less than 1 KB of a grid, 3 KB of a curved
// one. Plans that say all of it are files beside it. With how the last run cut it, too: daemon/unit/kept_cuts_test.cc.
#include <gtest/gtest.h>

#include <cstdio>

#include "tests/db/sized_pieces.h"

namespace veneer::db {
namespace {

void expect_smaller_than(double most, int corners) {
  const double bytes = database_bytes_a_piece(
      3, corners, [](JobStore& jobs, const PieceRecord& piece, RunId) { return jobs.book_piece(piece.id, kLater); });
  std::printf("%.0f bytes a piece of %d corners\n", bytes, corners);
  EXPECT_LT(bytes, most);
}

TEST(DatabaseSize, OfAPieceOfAGridIsLessThanAKilobyte) { expect_smaller_than(1024, 4); }
TEST(DatabaseSize, OfACurvedPieceIsLessThanThree) { expect_smaller_than(3 * 1024, 70); }

}  // namespace
}  // namespace veneer::db
