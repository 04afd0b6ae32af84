#include "db/differences.h"

#include <gmock/gmock.h>

#include "tests/db/cell_database.h"

namespace veneer::db {
namespace {

using ::testing::HasSubstr;

class DifferencesTest : public ::testing::Test {
 protected:
  CellDatabase cell;
  PanelId panel = cell.new_panel();
  Differences differences{cell.database()};

  static DifferenceRecord at(double x, double y, bool gone) {
    DifferenceRecord out;
    out.gone = gone;
    out.place = point<PanelFrame>(x + 1, y + 1);
    out.shape = rectangle(x, y, 4, 3);
    out.area = SquareMillimetres(9.5);
    return out;
  }
  void find(const std::vector<DifferenceRecord>& seen, const std::string& when = kNow) {
    VENEER_ASSERT_OK(differences.found(panel, seen, when));
  }
  int open() { return must(cell.panels().summaries(panel)).at(panel).open_differences; }
  Result<std::vector<PieceId>> decide(int number, DifferenceVerdict verdict) {
    return differences.decide(panel, {number}, verdict, "local:1000", "seen", kLater);
  }
};

TEST_F(DifferencesTest, StayAsTheyWereFoundUntilSomebodyDecides) {
  DifferenceRecord hangs = at(50, 60, false);
  hangs.pieces_json = R"([{"job":1,"mark":"A6","state":"cut"}])";
  find({at(10, 20, true), hangs});
  EXPECT_EQ(open(), 2);
  const auto all = must(differences.of(panel));
  ASSERT_EQ(all.size(), 2U);
  EXPECT_FALSE(all[0].gone);
  EXPECT_EQ(all[0].place, point<PanelFrame>(51, 61));
  EXPECT_EQ(all[0].shape.micro_area().rings, rectangle(50, 60, 4, 3).micro_area().rings);
  EXPECT_DOUBLE_EQ(all[0].area.count(), 9.5);
  EXPECT_EQ(all[0].pieces_json, hangs.pieces_json);
  EXPECT_EQ(all[0].found_at, kNow);
  EXPECT_FALSE(all[0].decision);

  VENEER_ASSERT_OK(decide(2, DifferenceVerdict::kAccepted));
  EXPECT_EQ(open(), 1);
  const auto decision = must(differences.of(panel))[0].decision;
  ASSERT_TRUE(decision);
  EXPECT_EQ(decision->who, "local:1000");
  EXPECT_EQ(decision->note, "seen");
  EXPECT_EQ(decide(2, DifferenceVerdict::kAccepted).error().code, ErrorCode::kConflict);
  EXPECT_EQ(decide(3, DifferenceVerdict::kAccepted).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(differences.of({"P-0099"}).error().code, ErrorCode::kNotFound);
}

TEST_F(DifferencesTest, ALaterScanFindsTheSameOnceAndClosesWhatItDoesNotSee) {
  find({at(10, 20, true), at(50, 60, false), at(90, 20, true)});
  VENEER_ASSERT_OK(decide(3, DifferenceVerdict::kAccepted));
  // One that was accepted is told by each scan.
  find({at(10.5, 20.5, true), at(50, 60, true), at(90, 20, true)}, kLater);
  const auto all = must(differences.of(panel));
  ASSERT_EQ(all.size(), 4U) << "the first again; another kind at the second's place; nothing new at the third's";
  EXPECT_FALSE(all[3].decision) << "the first";
  EXPECT_EQ(all[3].found_at, kNow);
  EXPECT_EQ(all[2].decision->verdict, DifferenceVerdict::kNotSeenAgain);
  EXPECT_EQ(all[1].decision->verdict, DifferenceVerdict::kAccepted) << "decided is decided";
  EXPECT_FALSE(all[0].decision);
  find({}, kLater);
  EXPECT_EQ(open(), 0);
}

// A stain that somebody accepted is as large as a hand: what is found in it later is something else.
TEST_F(DifferencesTest, WhatWasAcceptedIsOneDifferenceAndNoMore) {
  DifferenceRecord stain = at(100, 100, true);
  stain.shape = rectangle(100, 100, 60, 60), stain.area = SquareMillimetres(3600);
  find({stain});
  VENEER_ASSERT_OK(decide(1, DifferenceVerdict::kAccepted));
  find({at(110, 110, true), stain, at(140, 150, true)}, kLater);
  EXPECT_EQ(open(), 2);
  // It is not seen any more: so much as was accepted is not accepted for ever.
  find({at(110, 110, true), at(120, 120, true)}, kLater);
  auto all = must(differences.of(panel));
  ASSERT_EQ(all.size(), 4U);
  EXPECT_EQ(all[3].decision->verdict, DifferenceVerdict::kNotSeenAgain);
  EXPECT_FALSE(all[2].decision);
  EXPECT_EQ(all[1].decision->verdict, DifferenceVerdict::kNotSeenAgain);
  EXPECT_FALSE(all[0].decision);
  find({stain, at(110, 110, true), at(120, 120, true)}, kLater);
  EXPECT_EQ(open(), 3);
  VENEER_EXPECT_OK(cell.database().check_integrity());
}

// Boxes meet where shapes do not: a crack beside a hole is not the same as the hole.
TEST_F(DifferencesTest, TheSameMeansTheSamePlace) {
  DifferenceRecord corner = at(100, 100, true);
  corner.shape = unite(rectangle(100, 100, 30, 2), rectangle(100, 100, 2, 30)), corner.area = SquareMillimetres(116);
  find({corner});
  VENEER_ASSERT_OK(decide(1, DifferenceVerdict::kAccepted));
  find({corner, at(115, 115, true)}, kLater);
  EXPECT_EQ(open(), 1);
  // A crack of half a millimetre, which two scans show at places a little apart.
  DifferenceRecord crack = at(200, 20, true), again = crack;
  crack.shape = rectangle(200, 20, 0.5, 40), again.shape = rectangle(200.3, 20.2, 0.5, 40);
  crack.area = again.area = SquareMillimetres(20);
  find({corner, crack}, kLater);
  const auto known = must(differences.of(panel)).front().id;
  find({corner, again}, kLater);
  EXPECT_EQ(must(differences.of(panel)).front().id, known);
  EXPECT_EQ(open(), 1);
}

// The first map is lost: a later one shows the hole, so that a comparison with it does not.
TEST_F(DifferencesTest, WoodThatIsGoneIsNotBackWhereOnlyALaterMapWasCompared) {
  find({at(10, 20, true), at(50, 60, false), at(90, 20, true)});
  VENEER_ASSERT_OK(decide(3, DifferenceVerdict::kAccepted));
  VENEER_ASSERT_OK(differences.found(panel, {at(150, 20, true)}, kLater, true));
  const auto all = must(differences.of(panel));
  ASSERT_EQ(all.size(), 4U);
  EXPECT_FALSE(all[3].decision);
  EXPECT_EQ(all[2].decision->verdict, DifferenceVerdict::kNotSeenAgain) << "by this scan alone";
  EXPECT_EQ(all[1].decision->verdict, DifferenceVerdict::kAccepted);
  EXPECT_FALSE(all[0].decision);
  EXPECT_EQ(differences.found(panel, {DifferenceRecord()}, kLater).error().code, ErrorCode::kInvalidArgument);
}

// The next scan tells all that is gone, the new beside the old.
TEST_F(DifferencesTest, WhatGrewIsEnteredAnew) {
  find({at(10, 20, true), at(50, 60, true)});
  VENEER_ASSERT_OK(decide(2, DifferenceVerdict::kAccepted));
  DifferenceRecord wider = at(10, 20, true), larger = at(50, 60, true), beside = at(13, 20, true);
  wider.shape = rectangle(10, 20, 12, 3), wider.area = SquareMillimetres(36);
  larger.area = SquareMillimetres(30);  // within what was accepted
  find({wider, larger}, kLater);
  auto all = must(differences.of(panel));
  ASSERT_EQ(all.size(), 4U);
  EXPECT_EQ(all[3].decision->verdict, DifferenceVerdict::kGrown);
  EXPECT_DOUBLE_EQ(all[1].shape.area().count(), 36);
  EXPECT_FALSE(all[1].decision);
  EXPECT_FALSE(all[0].decision);
  EXPECT_EQ(all[2].decision->verdict, DifferenceVerdict::kGrown) << "what was accepted is not what is there now";
  // More of it beside what is seen as before.
  beside.shape = rectangle(21, 20, 19, 3);
  find({wider, larger, beside}, kLater);
  EXPECT_EQ(must(differences.of(panel)).size(), 5U);
  // In pages: what comes behind the last of the page before.
  std::vector<DifferenceId> paged, known;
  for (const auto& one : must(differences.of(panel))) known.push_back(one.id);
  for (DifferenceId before; paged.size() < known.size(); before = paged.back()) {
    const auto page = must(differences.of(panel, before, 2));
    ASSERT_EQ(page.size(), std::min<std::size_t>(2, known.size() - paged.size()));
    for (const auto& one : page) paged.push_back(one.id);
  }
  EXPECT_EQ(paged, known);
  EXPECT_EQ(open(), 3);
}

TEST_F(DifferencesTest, WoodThatIsGoneIsWrittenOffBesideWhatIsBooked) {
  const JobId job = must(cell.jobs().create(job_of({square_piece("A1", panel, 12, 10, 14)}), kNow));
  const PieceId piece = must(cell.jobs().pieces(job)).front().id;
  find({at(10, 20, true), at(50, 60, false)});
  // It was to be cut from wood that is not there.
  EXPECT_EQ(must(decide(1, DifferenceVerdict::kWrittenOff)), std::vector<PieceId>{piece});
  EXPECT_EQ(must(cell.jobs().find_piece(piece)).state, PieceState::kSuspect);
  VENEER_EXPECT_OK(cell.jobs().settle(piece, AllocationState::kScrap, kLater, "user anna"));
  const auto live = must(cell.ledger().live_allocations(panel));
  ASSERT_EQ(live.size(), 2U);
  EXPECT_EQ(live[1].state, AllocationState::kScrap);
  EXPECT_THAT(live[1].reason, HasSubstr("difference 1"));
  // 4 x 3 mm from x = 10 on, of which the piece and its kerf take all from 12 - k on.
  constexpr double kRounding = 0.003;  // stays free
  EXPECT_NEAR(live[1].area.area().count(), (2 - kSquareKerf - kRounding) * 3, 1e-3);
  EXPECT_EQ(decide(2, DifferenceVerdict::kWrittenOff).error().code, ErrorCode::kInvalidArgument)
      << "it is booked as cut already";
  EXPECT_EQ(open(), 1);
  VENEER_EXPECT_OK(cell.database().check_integrity());
}

// Of a corner that broke off, or a crack, the box around it is mostly sound wood.
TEST_F(DifferencesTest, WoodBetweenTheLegsOfAShapeStaysWood) {
  const JobId job = must(cell.jobs().create(job_of({square_piece("A1", panel, 15, 25, 14)}), kNow));
  DifferenceRecord corner = at(10, 20, true);
  corner.shape = unite(rectangle(10, 20, 24, 3), rectangle(10, 20, 3, 24)), corner.area = SquareMillimetres(135);
  find({corner});
  EXPECT_TRUE(must(decide(1, DifferenceVerdict::kWrittenOff)).empty());
  EXPECT_EQ(must(cell.jobs().pieces(job)).front().state, PieceState::kReserved);
  const auto live = must(cell.ledger().live_allocations(panel));
  ASSERT_EQ(live.size(), 2U);
  EXPECT_NEAR(live[1].area.area().count(), 24 * 3 + 3 * 21, 1e-6);
}

// Where two slanted borders meet the grid of micrometres lets them overlap a little.
TEST_F(DifferencesTest, WoodBesideTurnedPiecesIsWrittenOffToo) {
  for (int i = 0; i < 30; ++i) {
    const PanelId sheet = cell.new_panel();
    PlannedPatch turned = square_piece("A1", sheet, 0, 0, 14);
    const Isometry2<PanelFrame, PanelFrame> turn(degrees(3.7 * i + 1.3), point<PanelFrame>(100.0 + 0.137 * i, 60));
    for (auto& corner : turned.panel_outline) corner = turn * corner;
    Ring<PanelFrame> wood;
    for (const auto& corner : {point<PanelFrame>(-0.1, -0.1), point<PanelFrame>(14.1, -0.1),
                               point<PanelFrame>(14.1, 14.1), point<PanelFrame>(-0.1, 14.1)})
      wood.push_back(turn * corner);
    turned.allocation = Region<PanelFrame>(wood);
    must(cell.jobs().create(job_of({turned}), kNow));
    DifferenceRecord gone = at(0, 0, true);
    const auto box = bounds(Ring<PanelFrame>{wood[0], wood[1]});
    gone.shape = rectangle(box.min.x.count() - 1, box.min.y.count(), box.width().count() + 1, box.height().count());
    VENEER_ASSERT_OK(differences.found(sheet, {gone}, kNow));
    const auto number = must(differences.of(sheet)).front().id;
    const auto decided = differences.decide(sheet, number, DifferenceVerdict::kWrittenOff, "", "", kLater);
    ASSERT_TRUE(decided.ok()) << i << ": " << decided.error().message;
    EXPECT_EQ(must(cell.ledger().live_allocations(sheet)).size(), 2U) << i;
  }
}

// What sticks out of the panel is no wood.
TEST_F(DifferencesTest, OnlyWoodOfThePanelIsWrittenOff) {
  find({at(-2, 20, true)});
  VENEER_ASSERT_OK(decide(1, DifferenceVerdict::kWrittenOff));
  EXPECT_NEAR(must(cell.ledger().live_allocations(panel)).front().area.area().count(), 2 * 3, 1e-6);
}

TEST_F(DifferencesTest, NothingIsWrittenOffWhileThePanelIsCut) {
  const JobId job = must(cell.jobs().create(job_of({square_piece("A1", panel, 12, 10, 14)}), kNow));
  const RunId run = must(cell.jobs().start_run(
      job, panel, Isometry2<BedFrame, PanelFrame>(Radians(0), point<BedFrame>(0, 0)), 0.04_mm, kNow));
  find({at(10, 20, true)});
  EXPECT_EQ(decide(1, DifferenceVerdict::kWrittenOff).error().code, ErrorCode::kConflict);
  VENEER_ASSERT_OK(cell.jobs().abort_run(run, {}, "stopped", kLater));
  VENEER_EXPECT_OK(decide(1, DifferenceVerdict::kWrittenOff));
}

// All of it was booked meanwhile: there is nothing to write off, and the difference is decided.
TEST_F(DifferencesTest, WoodThatWasBookedMeanwhileIsNotBookedTwice) {
  find({at(12, 12, true)});
  must(cell.jobs().create(job_of({square_piece("A1", panel, 10, 10, 14)}), kNow));
  EXPECT_EQ(must(decide(1, DifferenceVerdict::kWrittenOff)).size(), 1U) << "and that is in doubt";
  EXPECT_EQ(must(cell.ledger().live_allocations(panel)).size(), 1U);
}

}  // namespace
}  // namespace veneer::db
