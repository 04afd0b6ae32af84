// What people know of woods and panels is kept change by change, and wood that looks different by now is not planned.
#include "db/stock_facts.h"

#include <gmock/gmock.h>

#include "tests/db/cell_database.h"

namespace veneer::db {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

class StockFactsTest : public ::testing::Test {
 protected:
  CellDatabase cell;
  PanelId panel = cell.new_panel();  // its mask was made at kNow, 2026-05-01T07:30
  StockFacts facts{cell.database()};

  static PanelFacts noted_at(const std::string& at) {
    PanelFacts change;
    change.who = "uid 1000", change.at = at;
    return change;
  }
  Status treat(TreatmentKind kind, const std::string& day, const std::string& at) {
    return facts.set_panel(panel, noted_at(at), {{kind, "grit 240", day, "", ""}});
  }
  Result<int> scan(const std::string& map, const std::string& at) {
    return cell.panels().add_mask(panel, {0, map, "mask", "hash", at}, must(cell.panels().find(panel)).mask_version);
  }
};

TEST_F(StockFactsTest, EveryChangeOfAMaterialIsKept) {
  EXPECT_EQ(facts.history_of("walnut").error().code, ErrorCode::kNotFound);
  VENEER_ASSERT_OK(facts.set_material({"walnut", "Juglans regia", "France", "Miller", "not_listed", "uid 1000", kNow}));
  VENEER_ASSERT_OK(facts.set_material({"walnut", {}, "Italy", "", {}, "uid 1001", kLater}));
  VENEER_ASSERT_OK(facts.set_material({"rosewood", {}, {}, {}, "II", "uid 1000", kLater}));
  const auto all = must(facts.materials());
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].material, "rosewood");
  EXPECT_EQ(all[0].cites, "II");
  EXPECT_EQ(all[0].origin, std::nullopt);
  EXPECT_EQ(all[1].botanical_name, "Juglans regia");
  EXPECT_EQ(all[1].origin, "Italy");
  EXPECT_EQ(all[1].supplier, std::nullopt) << "taken back";
  EXPECT_EQ(all[1].who, "uid 1001");
  const auto history = must(facts.history_of("walnut"));
  ASSERT_EQ(history.size(), 2U);
  EXPECT_EQ(history[1].origin, "France");
  EXPECT_EQ(history[1].supplier, "Miller");
  EXPECT_EQ(history[1].at, kNow);
}

TEST_F(StockFactsTest, EveryChangeOfAPanelIsKept) {
  PanelFacts shelf = noted_at(kNow);
  shelf.shelf = "A3", shelf.veneer = 0.6_mm;
  VENEER_ASSERT_OK(facts.set_panel(panel, shelf, {}));
  PanelFacts substrate = noted_at(kLater);
  substrate.substrate = 1.5_mm;
  VENEER_ASSERT_OK(facts.set_panel(panel, substrate, {{TreatmentKind::kFinish, "shellac", "2026-04-30", "", ""}}));
  const auto history = must(facts.history_of(panel));
  ASSERT_EQ(history.size(), 2U);
  EXPECT_EQ(history[0].shelf, "A3");
  EXPECT_EQ(history[0].veneer, 0.6_mm);
  EXPECT_EQ(history[0].substrate, 1.5_mm);
  EXPECT_EQ(history[1].substrate, std::nullopt);
  const auto treatments = must(facts.treatments(panel));
  ASSERT_EQ(treatments.size(), 1U);
  EXPECT_EQ(treatments[0].kind, TreatmentKind::kFinish);
  EXPECT_EQ(treatments[0].product, "shellac");
  EXPECT_EQ(treatments[0].treated_at, "2026-04-30");
  EXPECT_EQ(treatments[0].who, "uid 1000");
  EXPECT_THAT(must(facts.history_of(cell.new_panel())), IsEmpty());
}

TEST_F(StockFactsTest, WhatCannotBeIsRefused) {
  EXPECT_THAT(facts.set_material({"walnit", {}, {}, {}, {}, "uid 1000", kNow}).error().message,
              HasSubstr("nothing is said of this material"));
  EXPECT_EQ(facts.set_panel({"P-0009"}, noted_at(kNow), {}).error().code, ErrorCode::kNotFound);
  PanelFacts thick = noted_at(kNow);
  thick.veneer = 101_mm;
  EXPECT_THAT(facts.set_panel(panel, thick, {}).error().message, HasSubstr("thickness of the veneer"));
  EXPECT_THAT(treat(TreatmentKind::kSanding, "yesterday", kNow).error().message, HasSubstr("write it as 2026-05-01"));
  for (const char* never : {"2026-02-31", "2025-02-29", "2026-00-10", "2026-04-00"})
    EXPECT_THAT(treat(TreatmentKind::kSanding, never, kNow).error().message, HasSubstr("is no day")) << never;
  EXPECT_THAT(treat(TreatmentKind::kSanding, "2026-05-02", kNow).error().message, HasSubstr("still to come"));
  EXPECT_FALSE(facts.set_panel(panel, noted_at(kNow), {{TreatmentKind::kSanding, "", "", "", ""}}));
  EXPECT_THAT(facts.set_material({"walnut", {}, {}, {}, "IV", "uid 1000", kNow}).error().message, HasSubstr("CITES"));
  EXPECT_FALSE(facts.set_material({"", {}, {}, {}, {}, "uid 1000", kNow}));
  EXPECT_FALSE(facts.set_material({"walnut", std::string(201, 'x'), {}, {}, {}, "uid 1000", kNow}));
  EXPECT_THAT(must(facts.treatments(panel)), IsEmpty());
  EXPECT_THAT(must(facts.materials()), IsEmpty());
  // Characters count, not bytes.
  std::string umlauts;
  for (int i = 0; i < 60; ++i) umlauts += "\xC3\xBC";
  VENEER_EXPECT_OK(facts.set_material({umlauts, "Acer", {}, {}, {}, "uid 1000", kNow}));
  EXPECT_FALSE(facts.set_material({umlauts + "u", "Acer", {}, {}, {}, "uid 1000", kNow}).ok());
}

TEST_F(StockFactsTest, ASurfaceTreatedAfterTheScanThatCountsIsToBeScannedAgain) {
  VENEER_EXPECT_OK(facts.check_surface(panel));
  VENEER_ASSERT_OK(treat(TreatmentKind::kFinish, "2026-04-30", kLater));
  VENEER_EXPECT_OK(facts.check_surface(panel));  // before the scan
  const PlanId plan = must(Plans(cell.database()).add(job_of({square_piece("A1", panel, 10, 10, 14)}), kLater));
  VENEER_ASSERT_OK(treat(TreatmentKind::kSanding, "2026-05-03", "2026-05-04T10:00:00.000Z"));
  const std::string refusal =
      "panel P-0001 was sanded on 2026-05-03, after the scan of 2026-05-01 that counts: scan it again";
  EXPECT_EQ(facts.check_surface(panel).error().message, refusal);
  EXPECT_EQ(facts.check_surface(panel).error().code, ErrorCode::kRefused);
  EXPECT_EQ(cell.jobs().create(plan, kLater).error().message, refusal) << "of a plan from before";
  must(scan("map-2", "2026-05-03T09:00:00.000Z"));
  VENEER_EXPECT_OK(facts.check_surface(panel));  // on the day itself
  // A scan that is taken back shows the surface as it was.
  must(cell.panels().revert_mask(panel, 1, "2026-05-05T09:00:00.000Z"));
  EXPECT_EQ(facts.check_surface(panel).error().message, refusal);
  must(scan("map-3", "2026-05-06T09:00:00.000Z"));
  VENEER_EXPECT_OK(facts.check_surface(panel));
}

TEST_F(StockFactsTest, ATreatmentOfTodayIsNotedToTheMinute) {
  VENEER_ASSERT_OK(treat(TreatmentKind::kSanding, "", kLater));
  EXPECT_FALSE(facts.check_surface(panel).ok()) << "an hour after the scan of that day";
  must(scan("map-2", "2026-05-01T09:00:00.000Z"));
  VENEER_EXPECT_OK(facts.check_surface(panel));
  VENEER_ASSERT_OK(treat(TreatmentKind::kSanding, "2026-05-01", "2026-05-01T10:00:00.000Z"));
  EXPECT_FALSE(facts.check_surface(panel).ok());
}

}  // namespace
}  // namespace veneer::db
