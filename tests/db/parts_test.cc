// Panels that are sawn apart: what becomes of them, and of the wood that was gone from their parts.
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>

#include "db/part_sql.h"
#include "db/stock_facts.h"
#include "tests/db/cell_database.h"
#include "tests/db/stray_sql.h"

namespace veneer::db {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using Map = Isometry2<PanelFrame, PanelFrame>;

FiducialRecord tag(int id, Face face = Face::kShow) { return {FiducialKind::kTag, id, face, square(id, 5, 14)}; }

class PartsTest : public ::testing::Test {
 protected:
  void SetUp() override { VENEER_ASSERT_OK(panels.add(sheet(whole), {}, {tag(1), tag(2), tag(3), tag(4)})); }

  // A quarter turn to the left; the part's origin lies at (x, y) of the parent.
  static Map turned(double x, double y) {
    const Map turn(degrees(90), {});
    const auto corner = turn * point<PanelFrame>(x, y);
    return Map(degrees(90), {-corner.x, -corner.y});
  }
  PanelRecord part_of(const PanelId& parent, double width, double height) {
    PanelRecord out = sheet(must(panels.next_panel_id()));
    out.parent = parent;
    out.width = Millimetres(width), out.height = Millimetres(height);
    out.created_at = kLater;
    return out;
  }
  // Two pieces that are cut, one of which is lost, and a chip that was written off.
  void cut_pieces() {
    const JobId job = must(
        jobs.create(job_of({square_piece("A1", whole, 20, 40, 14), square_piece("A2", whole, 220, 40, 14)}), kNow));
    const auto pieces = must(jobs.pieces(job));
    const RunId run =
        must(jobs.start_run(job, whole, Isometry2<BedFrame, PanelFrame>(), 0.04_mm, kNow, {"test", {}, "[]"}));
    for (const auto& piece : pieces) {
      VENEER_ASSERT_OK(jobs.mark_cutting(piece.id, kNow));
      VENEER_ASSERT_OK(jobs.book_piece(piece.id, kNow));
    }
    EXPECT_THAT(panels.split(whole, "test", "sawn", kNow).error().message, HasSubstr("wait until the run is over"));
    VENEER_ASSERT_OK(jobs.finish_run(run, false, kNow));
    VENEER_ASSERT_OK(cell.ledger().write_off(whole, Region<PanelFrame>(square(100, 100, 8)), "a chip", kNow));
  }

  CellDatabase cell;
  Panels panels = cell.panels();
  JobStore jobs = cell.jobs();
  const PanelId whole{"P-0001"};
  const PartRecord as_it_lay{Map(), 3, 0.02_mm};
};

TEST_F(PartsTest, APanelThatIsSawnApartLeavesTheStockForItsParts) {
  EXPECT_THAT(must(panels.sawn()), IsEmpty());
  VENEER_ASSERT_OK(panels.split(whole, "local:1000", "sawn apart", kNow));
  EXPECT_THAT(must(panels.sawn()), ElementsAre(whole));
  const PanelRecord found = must(panels.find(whole));
  ASSERT_TRUE(found.retired);
  EXPECT_TRUE(found.retired->sawn);
  EXPECT_EQ(found.retired->reason, "sawn apart");
  EXPECT_THAT(must(panels.in_stock()), IsEmpty());

  const PanelRecord part = part_of(whole, 200, 280);
  VENEER_ASSERT_OK(panels.add_part(part, {}, {tag(1), tag(2), tag(9)}, {turned(10, 5), 2, 0.03_mm}));
  const PanelRecord entered = must(panels.find(part.id));
  EXPECT_EQ(entered.parent, whole);
  EXPECT_EQ(entered.root, whole);
  EXPECT_THAT(must(panels.parts_of(whole)), ElementsAre(part.id));
  const auto relation = must(panels.part(part.id));
  ASSERT_TRUE(relation);
  EXPECT_EQ(relation->fiducials, 2);
  EXPECT_EQ(relation->rms, 0.03_mm);
  EXPECT_NEAR(distance(relation->part_from_parent * point<PanelFrame>(10, 5), point<PanelFrame>(0, 0)).count(), 0,
              1e-9);
  EXPECT_FALSE(must(panels.part(whole)));

  // Its tags are the part's alone.
  const Status again = panels.add_part(part_of(whole, 200, 280), {}, {tag(2)}, as_it_lay);
  ASSERT_FALSE(again.ok());
  EXPECT_THAT(again.error().message, HasSubstr("panel P-0002 is in stock and carries tag 2"));
  // A part of a part knows where it all came from.
  VENEER_ASSERT_OK(panels.split(part.id, "local:1000", "sawn apart", kLater));
  EXPECT_THAT(must(panels.sawn()), ElementsAre(part.id, whole));
  const PanelRecord smaller = part_of(part.id, 50, 50);
  VENEER_ASSERT_OK(panels.add_part(smaller, {}, {tag(1), tag(9)}, as_it_lay));
  EXPECT_EQ(must(panels.find(smaller.id)).parent, part.id);
  EXPECT_EQ(must(panels.find(smaller.id)).root, whole);
}

TEST_F(PartsTest, WhatWasGoneFromAPartIsBookedInIt) {
  cut_pieces();
  VENEER_ASSERT_OK(panels.split(whole, "local:1000", "sawn apart", kLater));
  // The left half; the second piece came from the right one, from which the saw leaves a strip.
  const PanelRecord left = part_of(whole, 200, 280), right = [&] {
    PanelRecord out = part_of(whole, 210, 280);
    out.id = {"P-0003"};
    return out;
  }();
  VENEER_ASSERT_OK(panels.add_part(left, {}, {tag(1), tag(2)}, as_it_lay));
  VENEER_ASSERT_OK(
      panels.add_part(right, {}, {tag(3), tag(4)}, {Map(Radians(0), point<PanelFrame>(-225, 0)), 2, 0_mm}));

  const auto before = must(cell.ledger().live_allocations(whole));
  ASSERT_THAT(before, SizeIs(3)) << "the parent's ledger stays as it was";
  const auto in_left = must(cell.ledger().live_allocations(left.id));
  ASSERT_THAT(in_left, SizeIs(2));
  EXPECT_EQ(in_left[0].state, AllocationState::kCut);
  EXPECT_EQ(in_left[0].reason, "piece A1 of job 1, of panel P-0001");
  EXPECT_EQ(in_left[0].piece, PieceId{});
  EXPECT_EQ(in_left[0].outline, before[0].outline);
  EXPECT_EQ(in_left[0].area.micro_area().rings, before[0].area.micro_area().rings);
  EXPECT_EQ(in_left[1].state, AllocationState::kScrap);
  EXPECT_EQ(in_left[1].reason, "a chip");
  EXPECT_TRUE(in_left[1].outline.empty());
  const auto in_right = must(cell.ledger().live_allocations(right.id));
  ASSERT_THAT(in_right, SizeIs(1));
  // From 219.7 to 234.3 mm of the parent: what lies left of the saw's edge is clipped, the outline is not.
  EXPECT_NEAR(in_right[0].area.area().count(), 9.3 * 14.6, 0.01);
  EXPECT_EQ(in_right[0].outline, square(-5, 40, 14));

  // The piece is where it was cut from.
  EXPECT_EQ(must(jobs.find_piece(PieceId{1})).panel, whole);
  // And its wood here moves no more, and holds no other.
  EXPECT_FALSE(execute(cell.database(), "UPDATE allocations SET state = 'scrap' WHERE id = 4").ok());
  EXPECT_FALSE(cell.ledger().write_off(left.id, Region<PanelFrame>(square(30, 50, 5)), "burnt", kLater).ok());
  VENEER_EXPECT_OK(cell.ledger().write_off(left.id, Region<PanelFrame>(square(60, 50, 5)), "burnt", kLater));
}

TEST_F(PartsTest, APartOfAPartTakesOverWhatItsParentTookOver) {
  cut_pieces();
  VENEER_ASSERT_OK(panels.split(whole, "test", "sawn apart", kLater));
  const PanelRecord half = part_of(whole, 150, 280);
  VENEER_ASSERT_OK(panels.add_part(half, {}, {tag(1), tag(2)}, as_it_lay));
  VENEER_ASSERT_OK(cell.ledger().write_off(half.id, Region<PanelFrame>(square(60, 50, 5)), "burnt", kLater));
  VENEER_ASSERT_OK(panels.split(half.id, "test", "sawn apart", kLater));
  const PanelRecord quarter = part_of(half.id, 280, 90);
  VENEER_ASSERT_OK(panels.add_part(quarter, {}, {tag(1)}, {turned(0, 280), 2, 0_mm}));
  const auto gone = must(cell.ledger().live_allocations(quarter.id));
  ASSERT_THAT(gone, SizeIs(2)) << "the chip lay beyond";
  EXPECT_EQ(gone[0].state, AllocationState::kCut);
  EXPECT_EQ(gone[0].reason, "piece A1 of job 1, of panel P-0001");
  EXPECT_EQ(must(cell.ledger().piece_before(gone[0].id)), PieceId{1}) << "two saws ago";
  EXPECT_EQ(must(cell.ledger().piece_before(gone[1].id)), std::nullopt);
  // From 20 to 34 across and from 40 to 54 up: a quarter turn laid it far to the right.
  const auto box = bounds(gone[0].outline);
  EXPECT_EQ(box.min, point<PanelFrame>(280 - 54, 20));
  EXPECT_EQ(box.max, point<PanelFrame>(280 - 40, 34));
  EXPECT_EQ(gone[1].reason, "burnt");
}

// A beam strayed over pieces that had been cut from it, after it was sawn: of those nobody knows what the part lacks.
TEST_F(PartsTest, APartWaitsUntilItsParentsSuspectPiecesAreSettled) {
  cut_pieces();
  VENEER_ASSERT_OK(panels.split(whole, "test", "sawn apart", kLater));
  const std::vector<PieceId> strayed = {{1}};
  VENEER_ASSERT_OK(jobs.make_suspect(strayed, kLater));
  const PanelRecord part = part_of(whole, 200, 280);
  const Status early = panels.add_part(part, {}, {tag(1), tag(2)}, as_it_lay);
  ASSERT_FALSE(early.ok());
  EXPECT_EQ(early.error().code, ErrorCode::kConflict);
  EXPECT_EQ(early.error().message,
            "piece A1 of job 1, which was cut from panel P-0001, is suspect: say first what became of it with "
            "`veneerctl job settle 1 A1`, then scan the part again");
  VENEER_ASSERT_OK(jobs.settle({1}, AllocationState::kCut, kLater, "user anna"));
  VENEER_EXPECT_OK(panels.add_part(part, {}, {tag(1), tag(2)}, as_it_lay));
}

TEST_F(PartsTest, OnlyAPanelWithoutOpenPiecesIsSawnApart) {
  const JobId job = must(jobs.create(job_of({square_piece("A1", whole, 10, 10, 14)}), kNow));
  const Status held = panels.split(whole, "test", "sawn apart", kNow);
  ASSERT_FALSE(held.ok());
  EXPECT_EQ(held.error().message,
            "panel P-0001 holds 1 piece that is not cut yet of job 1: cut it, or cancel the job, first");
  EXPECT_FALSE(must(panels.find(whole)).retired);
  VENEER_ASSERT_OK(jobs.cancel(job, kLater));
  VENEER_ASSERT_OK(panels.split(whole, "test", "sawn apart", kNow));
  EXPECT_EQ(panels.split(whole, "test", "again", kNow).error().code, ErrorCode::kConflict);
  EXPECT_EQ(panels.split({"P-0009"}, "test", "sawn", kNow).error().code, ErrorCode::kNotFound);
}

TEST_F(PartsTest, ASplitIsTakenBackUntilAPartIsThere) {
  VENEER_ASSERT_OK(panels.split(whole, "test", "sawn apart", kNow));
  VENEER_ASSERT_OK(panels.restore(whole, "it was another", kLater));
  EXPECT_THAT(must(panels.sawn()), IsEmpty());
  const Status late = panels.add_part(part_of(whole, 200, 280), {}, {tag(1)}, as_it_lay);
  ASSERT_FALSE(late.ok());
  EXPECT_THAT(late.error().message, HasSubstr("put back into stock meanwhile"));
  // Retired for another reason it has no parts either, whoever writes the row.
  VENEER_ASSERT_OK(panels.retire(whole, "sold", kLater));
  EXPECT_FALSE(panels.add_part(part_of(whole, 200, 280), {}, {tag(1)}, as_it_lay).ok());
  VENEER_ASSERT_OK(panels.restore(whole, "not sold", kLater));

  VENEER_ASSERT_OK(panels.split(whole, "test", "sawn apart", kLater));
  VENEER_ASSERT_OK(panels.add_part(part_of(whole, 200, 280), {}, {tag(1)}, as_it_lay));
  VENEER_ASSERT_OK(panels.retire({"P-0002"}, "burnt", kLater));
  const Status refused = panels.restore(whole, "it was another", kLater);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().message,
            "panel P-0001 was sawn apart, and its wood is that of its parts, as of panel P-0002: use those");
  EXPECT_FALSE(
      execute(cell.database(), "INSERT INTO retirements (panel, retired, reason, at) VALUES ('P-0001', 0, 'x', 't')")
          .ok());
}

// A part that was scanned badly is retired and scanned anew; unless wood was booked in it meanwhile, which the new one
// would know nothing of.
TEST_F(PartsTest, APartIsScannedAnewWhileNothingWasCutFromIt) {
  cut_pieces();
  VENEER_ASSERT_OK(panels.split(whole, "test", "sawn apart", kLater));
  const PanelRecord first = part_of(whole, 200, 280);
  VENEER_ASSERT_OK(panels.add_part(first, {}, {tag(1), tag(2)}, as_it_lay));
  VENEER_ASSERT_OK(panels.retire(first.id, "scanned with the lid open", kLater));
  const PanelRecord second = part_of(whole, 201, 280);
  VENEER_ASSERT_OK(panels.add_part(second, {}, {tag(1), tag(2)}, as_it_lay));
  EXPECT_THAT(must(cell.ledger().live_allocations(second.id)), SizeIs(2));
  VENEER_ASSERT_OK(panels.retire(second.id, "the first was right", kLater));
  VENEER_ASSERT_OK(panels.restore(first.id, "it was right", kLater));
  VENEER_ASSERT_OK(cell.ledger().write_off(first.id, Region<PanelFrame>(square(60, 50, 5)), "burnt", kLater));
  VENEER_ASSERT_OK(panels.retire(first.id, "or was it?", kLater));
  const Status refused = panels.add_part(part_of(whole, 200, 280), {}, {tag(1), tag(2)}, as_it_lay);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, HasSubstr("booked under panel P-0002: run `veneerctl panel restore P-0002`"));
  EXPECT_FALSE(panels.restore(second.id, "it was right", kLater).ok());
  VENEER_EXPECT_OK(panels.restore(first.id, "it was right", kLater));
}

TEST_F(PartsTest, APartIsAsThickAndAsFinishedAsItsParent) {
  StockFacts facts(cell.database());
  VENEER_ASSERT_OK(facts.set_panel(whole, {"A3", 0.6_mm, 1.5_mm, "test", kNow},
                                   {{TreatmentKind::kFinish, "shellac", "2026-04-30", "", ""}}));
  VENEER_ASSERT_OK(panels.split(whole, "test", "sawn apart", kLater));
  const PanelRecord part = part_of(whole, 200, 280);
  VENEER_ASSERT_OK(panels.add_part(part, {}, {tag(1)}, as_it_lay));
  const auto known = must(facts.history_of(part.id));
  ASSERT_THAT(known, SizeIs(1));
  EXPECT_EQ(known[0].veneer, 0.6_mm);
  EXPECT_EQ(known[0].substrate, 1.5_mm);
  EXPECT_FALSE(known[0].shelf) << "nobody has said where it lies";
  const auto treatments = must(facts.treatments(part.id));
  ASSERT_THAT(treatments, SizeIs(1));
  EXPECT_EQ(treatments[0].product, "shellac");
}

TEST_F(PartsTest, TheSchemaLetsNobodyInventCutWood) {
  const char* const kCut =
      "INSERT INTO allocations (panel, state, area_um, reason, changed_at) VALUES ('P-0001', 'cut', '~0,0 10,0 0,10', "
      "'x', 't')";
  EXPECT_FALSE(execute(cell.database(), kCut).ok()) << "it is no part";
  EXPECT_FALSE(execute(cell.database(), "INSERT INTO parts VALUES ('P-0001', 0, 0, 0, 0, 3, 0)").ok());
  VENEER_ASSERT_OK(panels.split(whole, "test", "sawn apart", kNow));
  VENEER_ASSERT_OK(panels.add_part(part_of(whole, 200, 280), {}, {tag(1)}, as_it_lay));
  for (const char* edit :
       {"UPDATE splits SET who = 'x'", "DELETE FROM splits", "UPDATE parts SET rms_mm = 0", "DELETE FROM parts"})
    EXPECT_FALSE(execute(cell.database(), edit).ok()) << edit;
}

// Convex shapes in cells of a lattice that touch each other, moved by any isometry: what was gone stays gone, to the
// rounding along borders, and no two overlap.
RC_GTEST_PROP(Parts, MovedWoodNeitherOverlapsNorBecomesFree, ()) {
  const auto number = [](int from, int to) { return *rc::gen::inRange(from, to); };
  std::vector<Region<PanelFrame>> areas;
  const int columns = number(1, 5), rows = number(1, 4);
  // Corners of the lattice shift by up to a third of its step, in whole micrometres: slanted borders, shared by two.
  std::vector<std::vector<Point<PanelFrame>>> corners(static_cast<std::size_t>(rows) + 1);
  for (int r = 0; r <= rows; ++r)
    for (int c = 0; c <= columns; ++c) {
      const double x = c * 12 + number(-4000, 4000) / 1000.0, y = r * 12 + number(-4000, 4000) / 1000.0;
      corners[static_cast<std::size_t>(r)].push_back(point<PanelFrame>(x, y));
    }
  for (std::size_t r = 0; r < static_cast<std::size_t>(rows); ++r)
    for (std::size_t c = 0; c < static_cast<std::size_t>(columns); ++c)
      if (number(0, 4) > 0)
        areas.emplace_back(
            Ring<PanelFrame>{corners[r][c], corners[r][c + 1], corners[r + 1][c + 1], corners[r + 1][c]});
  const Radians turn(number(-3142, 3142) / 1000.0);
  const double right = number(-40000, 40000) / 1000.0, up = number(-40000, 40000) / 1000.0;
  const Map map(turn, point<PanelFrame>(right, up));
  const Ring<PanelFrame> sheet{point<PanelFrame>(0, 0), point<PanelFrame>(37, 0), point<PanelFrame>(37, 29),
                               point<PanelFrame>(0, 29)};
  const Region<PanelFrame> within{sheet};
  const auto carried = moved_apart(areas, map, within);
  RC_ASSERT(carried.size() == areas.size());
  const auto all = unite(carried);
  const auto well_within = offset(within, Millimetres(-0.01));
  for (std::size_t i = 0; i < areas.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) RC_ASSERT(!overlaps(carried[i], carried[k]));
    RC_ASSERT(subtract(carried[i], within).empty());
    // Point by point: what lay 10 um within a place that was gone lies in one that is gone.
    const auto sure = offset(areas[i], Millimetres(-0.01));
    for (int times = 0; times < 20 && !areas[i].rings().empty(); ++times) {
      const auto ring = areas[i].rings().front();
      const auto& p = ring[static_cast<std::size_t>(number(0, static_cast<int>(ring.size())))];
      const auto& q = ring[static_cast<std::size_t>(number(0, static_cast<int>(ring.size())))];
      const double along = number(0, 1001) / 1000.0;
      const double beside = number(-500, 500) / 1000.0, above = number(-500, 500) / 1000.0;
      const auto place = point<PanelFrame>(p.x.count() + along * (q.x - p.x).count() + beside,
                                           p.y.count() + along * (q.y - p.y).count() + above);
      if (sure.contains(place) && well_within.contains(map * place)) RC_ASSERT(all.contains(map * place));
    }
  }
  // And by polygons: what of the moved wood is not carried over is thinner than 8 um.
  std::vector<Region<PanelFrame>> moved;
  for (const auto& area : areas) moved.emplace_back(map * area.rings().at(0));
  const auto missing = subtract(intersect(unite(moved), within), all);
  RC_ASSERT(offset(missing, Millimetres(-0.004)).empty());
}

}  // namespace
}  // namespace veneer::db
