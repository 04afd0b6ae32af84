// How a piece was cut is written so that it can be cut again, and in little room.
#include "daemon/unit/kept_cuts.h"

#include <gmock/gmock.h>

#include <cstdio>

#include "tests/db/sized_pieces.h"
#include "tests/support/burnt_piece.h"

namespace veneer::daemon {
namespace {

using db::kLater;
using db::kNow;
using db::must;
using testing::burnt_piece;
using ::testing::HasSubstr;

// A run in which piece 1 is being cut.
db::RunId start(db::CellDatabase& cell) {
  must(cell.jobs().create(db::job_of({db::square_piece("A1", cell.new_panel(), 20, 40, 14)}), kNow));
  const db::RunId run = must(cell.jobs().start_run({1}, {"P-0001"}, {}, 0.05_mm, kNow));
  VENEER_EXPECT_OK(cell.jobs().mark_cutting({1}, kNow));
  return run;
}

class KeptCutsTest : public ::testing::Test {
 protected:
  Result<KeptCuts> read() {
    Repositories r(cell.database());
    return KeptCuts::read(r);
  }

  db::CellDatabase cell;
  const db::RunId run = start(cell);
};

TEST_F(KeptCutsTest, ACutIsReadAsItWasBurnt) {
  PieceBurn burn = must(burnt_piece({1}, db::square(20, 40, 14)));
  Stroke& cut = burn.strokes.strokes.front();
  cut.speed = MmPerSecond(12.5), cut.power = PowerFraction(0.85), cut.passes = 3, cut.air = true;
  cut.overscan = Millimetres(0.25);
  Stroke engraved = cut;
  engraved.role = StrokeRole::kEngrave;
  burn.strokes.strokes.insert(burn.strokes.strokes.begin(), engraved);
  VENEER_ASSERT_OK(cell.jobs().book_and_keep(KeptCuts::to_record(burn, run, "Grbl"), kLater));
  const auto kept = must(read());
  ASSERT_EQ(kept.count(), 1);
  const PieceBurn* found = kept.find("A1");
  ASSERT_NE(found, nullptr);
  ASSERT_EQ(found->strokes.strokes.size() + 1, burn.strokes.strokes.size()) << "engraving is not repeated";
  const Stroke& again = found->strokes.strokes.front();
  const Stroke& was = burn.strokes.strokes[1];
  EXPECT_EQ(again.piece, was.piece);
  EXPECT_EQ(again.role, StrokeRole::kCut);
  EXPECT_EQ(again.speed, was.speed);
  EXPECT_EQ(again.power, was.power);
  EXPECT_EQ(again.passes, was.passes);
  EXPECT_EQ(again.air, was.air);
  EXPECT_EQ(again.overscan, was.overscan);
  EXPECT_EQ(again.closed(), was.closed());
  ASSERT_EQ(again.path.size(), was.path.size());
  for (std::size_t i = 0; i < was.path.size(); ++i) {
    EXPECT_NEAR(again.path[i].x.count(), was.path[i].x.count(), 0.0005001) << i;
    EXPECT_NEAR(again.path[i].y.count(), was.path[i].y.count(), 0.0005001) << i;
  }
}

TEST_F(KeptCutsTest, AClosedCutStaysClosed) {
  PieceBurn burn{{1}, "A1", {}, 0};
  Stroke& cut = burn.strokes.strokes.emplace_back();
  // Its ends are the same place, on both sides of where micrometres are rounded.
  cut.path = {point<MachineFrame>(1.00049999, 1), point<MachineFrame>(5, 1), point<MachineFrame>(5, 5),
              point<MachineFrame>(1.00050001, 1)};
  ASSERT_TRUE(cut.closed());
  VENEER_ASSERT_OK(cell.jobs().book_and_keep(KeptCuts::to_record(burn, run, "Grbl"), kLater));
  const auto kept = must(read());
  EXPECT_TRUE(kept.find("A1")->strokes.strokes.front().closed());
}

// It is cut back and forth, and not round and round.
TEST_F(KeptCutsTest, AnOpenCutWhoseEndsNearlyMeetStaysOpen) {
  PieceBurn burn{{1}, "A1", {}, 0};
  Stroke& cut = burn.strokes.strokes.emplace_back();
  cut.path = {point<MachineFrame>(1, 1), point<MachineFrame>(5, 1), point<MachineFrame>(5, 5),
              point<MachineFrame>(1.0003, 1)};
  ASSERT_FALSE(cut.closed());
  VENEER_ASSERT_OK(cell.jobs().book_and_keep(KeptCuts::to_record(burn, run, "Grbl"), kLater));
  const auto kept = must(read());
  const Stroke& again = kept.find("A1")->strokes.strokes.front();
  EXPECT_FALSE(again.closed());
  EXPECT_NEAR(distance(again.path.back(), cut.path.back()).count(), 0, 0.0010001);
}

TEST_F(KeptCutsTest, WhatAnOlderProgramWroteIsReadStill) {
  const std::string older =
      R"([{"path_mm":[[60.25,70.5],[74.25,70.5]],"speed_mm_s":12.5,"power":0.85,"passes":2,"air":true,"overscan_mm":0.0}])";
  VENEER_ASSERT_OK(cell.jobs().book_and_keep({{1}, "", run, "Grbl", older}, kLater));
  const auto kept = must(read());
  ASSERT_NE(kept.find("A1"), nullptr);
  const Stroke& stroke = kept.find("A1")->strokes.strokes.front();
  EXPECT_EQ(stroke.path, (Polyline<MachineFrame>{point<MachineFrame>(60.25, 70.5), point<MachineFrame>(74.25, 70.5)}));
  EXPECT_EQ(stroke.passes, 2);
  EXPECT_TRUE(stroke.air);
}

TEST(KeptCuts, ACutThatCannotBeReadIsNamedWithTheWayOut) {
  for (const char* broken : {R"([["",12.5,0.85,2,true,0]])", R"([["??",12.5,0.85,2,true,0]])",
                             R"([["??S",1,1,1,true,0]])", R"([["??S!",1,1,1,true,0]])", R"([["??S?"]])", R"([7])"}) {
    db::CellDatabase cell;
    const db::RunId run = start(cell);
    VENEER_ASSERT_OK(cell.jobs().book_and_keep({{1}, "", run, "Grbl", broken}, kLater));
    Repositories r(cell.database());
    const auto kept = KeptCuts::read(r);
    ASSERT_FALSE(kept.ok()) << broken;
    EXPECT_EQ(kept.error().code, ErrorCode::kStorage);
    EXPECT_THAT(kept.error().message, HasSubstr("veneerctl job redo 1 A1 --lost"));
  }
}

// All pieces of a cell were cut in one run, so that of each its cut is kept.
void expect_smaller_than(double most, int corners) {
  std::size_t vertices = 0, kept = 0;
  const auto keep = [&](db::JobStore& jobs, const db::PieceRecord& piece, db::RunId run) {
    const PieceBurn burn = must(burnt_piece(piece.id, piece.panel_outline));
    const db::KeptCut cut = KeptCuts::to_record(burn, run, "GRBL 1.1h of serial 7");
    for (const Stroke& stroke : burn.strokes.strokes) vertices += stroke.path.size();
    kept += cut.strokes_json.size();
    return jobs.book_and_keep(cut, kLater);
  };
  const double bytes = db::database_bytes_a_piece(1, corners, keep);
  constexpr int kPieces = db::kSizedColumns * db::kSizedRows;
  std::printf("%.0f bytes a piece of %d corners, of them %zu for its cut of %zu places\n", bytes, corners,
              kept / kPieces, vertices / kPieces);
  EXPECT_LT(bytes, most);
}

TEST(SizeWithKeptCuts, OfAPieceOfAGridIsLessThanAKilobyte) { expect_smaller_than(1000, 4); }
TEST(SizeWithKeptCuts, OfACurvedPieceIsLessThanThree) { expect_smaller_than(3000, 70); }

}  // namespace
}  // namespace veneer::daemon
