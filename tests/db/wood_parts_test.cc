// The wood of a piece told apart: the piece, the band of kerf around it, and what its lead-in burns.
#include "db/wood_parts.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include "db/leases.h"
#include "db/shapes.h"
#include "db/sql.h"
#include "tests/db/cell_database.h"
#include "tests/db/stray_sql.h"

namespace veneer::db {
namespace {

using ::testing::HasSubstr;

constexpr double kMm2 = 1e-6;  // square micrometres
// An edge of 10 mm that is cut by another one ends at a whole micrometre, which turns it.
constexpr double kTurned = 0.01;

MicroPoint at(double x_mm, double y_mm) { return {std::llround(x_mm * 1000), std::llround(y_mm * 1000)}; }

// A star about the middle of the panel, its corners at random; many of them make a curved piece, whose border waves.
MicroRing any_outline() {
  const int corners = *rc::gen::elementOf(std::vector<int>{3, 4, 5, 8, 40, 160});
  const double wave = *rc::gen::inRange(0, 100) * 0.01;
  MicroRing out;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * kPi * i / corners;
    const double radius = corners > 8 ? 7.5 + wave * std::sin(3 * angle) : *rc::gen::inRange(500, 1000) * 0.01;
    out.push_back(at(100 + radius * std::cos(angle), 100 + radius * std::sin(angle)));
  }
  return out;
}

RC_GTEST_PROP(WoodParts, ArePartsOfTheWoodAndAllOfIt, ()) {
  const MicroRing outline = any_outline();
  const double kerf_um = *rc::gen::inRange(60, 500);
  const MicroArea piece = micro::unite(MicroArea{{outline}}, {});
  const MicroArea band = micro::subtract(micro::offset(piece, kerf_um, false), piece);
  // From a corner outwards, as a beam of the kerf's width burns it.
  const MicroPoint corner = outline[*rc::gen::inRange<std::size_t>(0, outline.size())];
  const double x = static_cast<double>(corner.x_um) * 1e-3 - 100, y = static_cast<double>(corner.y_um) * 1e-3 - 100;
  const double far = 1 + 1.5 / std::hypot(x, y), wide = kerf_um * 0.5e-3 / std::hypot(x, y);
  const MicroArea strip{{{at(100 + x - y * wide, 100 + y + x * wide), at(100 + x + y * wide, 100 + y - x * wide),
                          at(100 + x * far + y * wide, 100 + y * far - x * wide),
                          at(100 + x * far - y * wide, 100 + y * far + x * wide)}}};
  const MicroArea lead = micro::subtract(micro::subtract(micro::unite(strip, {}), piece), band);
  const MicroArea whole = micro::unite(micro::unite(piece, band), lead);

  const MicroArea told = lead_in_of(whole, outline), kerf = kerf_of(whole, outline, told);
  const auto area = [](const MicroArea& of) { return micro::area_um2(of) * kMm2; };
  const auto both = [&](const MicroArea& a, const MicroArea& b) { return area(micro::intersect(a, b)); };
  RC_ASSERT(both(told, piece) + both(kerf, piece) + both(kerf, told) < kTurned);
  RC_ASSERT(std::abs(area(piece) + area(kerf) + area(told) - area(whole)) < kTurned);
  // Each as it was burnt, but for 3 um, and rounding, where they meet: in a corner, along some kerfs.
  RC_ASSERT(area(micro::subtract(told, micro::offset(lead, 2, false))) < kTurned);
  RC_ASSERT(area(micro::subtract(lead, told)) < 0.006 * 8 * kerf_um * 1e-3 + kTurned);
  RC_ASSERT(area(micro::subtract(band, micro::offset(kerf, 2, false))) < kTurned);
}

TEST(WoodParts, WithoutALeadInThereIsNone) {
  const MicroRing outline = {at(10, 10), at(24, 10), at(24, 24), at(10, 24)};
  const MicroArea whole = micro::offset(MicroArea{{outline}}, 300, false);
  EXPECT_TRUE(lead_in_of(whole, outline).empty());
  EXPECT_DOUBLE_EQ(micro::area_um2(kerf_of(whole, outline, {})) * kMm2, 14.6 * 14.6 - 14 * 14);
  EXPECT_TRUE(kerf_of(whole, {}, {}).empty()) << "no piece, no kerf";
}

class PartedWood : public ::testing::Test {
 protected:
  PartedWood() {
    led = square_piece("A1", panel, 20, 40, 14);
    led.lead_in = point<PanelFrame>(19, 40.2);
    led.allocation = unite(led.allocation, rectangle(18.8, 40, 1.1, 0.4));
  }
  CellDatabase cell;
  PanelId panel = cell.new_panel();
  PlannedPatch led;
};

TEST_F(PartedWood, IsToldByTheLedgerAndInTheDatabase) {
  must(cell.jobs().create(job_of({led, square_piece("A2", panel, 60, 40, 14)}), kNow));
  const auto live = must(cell.ledger().live_allocations(panel));
  ASSERT_EQ(live.size(), 2U);
  EXPECT_EQ(live[0].outline, led.panel_outline);
  EXPECT_NEAR(live[0].lead_in.area().count(), 0.9 * 0.4, 0.003 * 0.4 + 1e-9);
  EXPECT_NEAR(kerf_of(live[0]).area().count(), 14.6 * 14.6 - 14 * 14, 0.003 * 0.4 + 1e-9);
  EXPECT_TRUE(live[1].lead_in.empty());
  SQLite::Statement row(cell.database().connection(),
                        "SELECT outline_um, kerf_um, lead_in_um FROM allocation_parts WHERE allocation = 1");
  ASSERT_TRUE(row.executeStep());
  EXPECT_EQ(text(row.getColumn(0)), write_outline(to_micro(led.panel_outline)));
  EXPECT_EQ(text(row.getColumn(1)), write_area(kerf_of(live[0]).micro_area()));
  EXPECT_EQ(text(row.getColumn(2)), write_area(live[0].lead_in.micro_area()));
}

TEST_F(PartedWood, OfWhatIsNoPieceIsOne) {
  VENEER_ASSERT_OK(cell.ledger().write_off(panel, rectangle(200, 200, 20, 20), "burnt", kNow));
  must(Leases(cell.database()).take(must(Plans(cell.database()).add(job_of({led}), kNow)), "local:1000", kNow, kLater));
  for (const auto& booked : must(cell.ledger().live_allocations(panel)))
    EXPECT_TRUE(booked.outline.empty() && booked.lead_in.empty() && kerf_of(booked).empty());
  EXPECT_EQ(cell.database().connection().execAndGet("SELECT count(*) FROM allocation_parts").getInt(), 0);
}

TEST_F(PartedWood, IsNotWhatSomebodyElseSaysOfIt) {
  must(cell.jobs().create(job_of({led}), kNow));
  VENEER_ASSERT_OK(cell.jobs().cancel({1}, kNow));
  const auto booked_with = [&](const char* outline, const char* lead_in) {
    return execute(cell.database(),
                   fmt::format("INSERT INTO allocations (panel, job, piece, placement, state, area_um, outline_um, "
                               "lead_in_um, reason, changed_at) SELECT panel, job, piece, placement, 'reserved', "
                               "area_um, {}, {}, '', 't' FROM allocations WHERE id = 1",
                               outline, lead_in));
  };
  EXPECT_FALSE(booked_with("'~20000,40000 14000,0 0,13000 -14000,0'", "lead_in_um")) << "another outline";
  EXPECT_FALSE(booked_with("'~'", "'~'"));
  EXPECT_TRUE(booked_with("outline_um", "lead_in_um"));
  EXPECT_FALSE(execute(cell.database(),
                       "INSERT INTO allocations (panel, state, area_um, outline_um, reason, changed_at) VALUES "
                       "('P-0001', 'scrap', '~0,0 9,0 0,9', '~0,0 9,0 0,9', 'burnt', 't')"))
      << "no piece, no outline";
  EXPECT_FALSE(execute(cell.database(), "UPDATE allocations SET lead_in_um = '~' WHERE id = 1"));
}

TEST_F(PartedWood, GoesWithWoodThatIsCarriedOver) {
  const JobId job = must(cell.jobs().create(job_of({led}), kNow));
  const RunId run = must(cell.jobs().start_run(job, panel, {}, 0.05_mm, kNow));
  VENEER_ASSERT_OK(cell.jobs().mark_cutting({1}, kNow));
  VENEER_ASSERT_OK(cell.jobs().book_piece({1}, kNow));
  VENEER_ASSERT_OK(cell.jobs().finish_run(run, false, kNow));
  VENEER_ASSERT_OK(cell.panels().split(panel, "local:1000", "sawn apart", kLater));
  PanelRecord part = sheet(must(cell.panels().next_panel_id()));
  part.parent = panel;
  VENEER_ASSERT_OK(cell.panels().add_part(
      part, {}, {}, {Isometry2<PanelFrame, PanelFrame>(degrees(30), point<PanelFrame>(50, -5)), 3, 0.02_mm}));
  const auto before = must(cell.ledger().live_allocations(panel)), now = must(cell.ledger().live_allocations(part.id));
  ASSERT_EQ(now.size(), 1U);
  EXPECT_NEAR(now[0].lead_in.area().count(), before[0].lead_in.area().count(), 0.005);
  EXPECT_NEAR(kerf_of(now[0]).area().count(), kerf_of(before[0]).area().count(), 0.1);
  EXPECT_LT(subtract(now[0].lead_in, now[0].area).area().count(), 1e-4);
}

}  // namespace
}  // namespace veneer::db
