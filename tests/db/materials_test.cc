#include "db/materials.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>

#include "db/job_store.h"
#include "db/ledger.h"
#include "tests/db/everything.h"
#include "tests/db/planned_job.h"
#include "tests/db/stray_sql.h"

namespace veneer::db {
namespace {

using ::testing::HasSubstr;

RecipeRecord cut(const std::string& material) {
  return {material, Operation::kCut, 12_mm_s, PowerFraction(0.7), 2, true, KerfRecord{0.31_mm, 0.22_mm}, kNow};
}
RecipeRecord engrave(const std::string& material) {
  return {material, Operation::kEngrave, 90_mm_s, PowerFraction(0.15), 1, false, std::nullopt, kNow};
}

class MaterialsTest : public ::testing::Test {
 protected:
  CellDatabase cell;
  Materials materials{cell.database()};
};

TEST_F(MaterialsTest, RemembersARecipeForEachMaterialAndOperation) {
  for (const auto& recipe : {engrave("walnut"), cut("walnut"), cut("maple")})
    VENEER_ASSERT_OK(materials.set_recipe(recipe));
  cell.reopen();
  const auto all = must(materials.recipes());
  ASSERT_EQ(all.size(), 3U);
  EXPECT_EQ(all[0].material, "maple");
  EXPECT_EQ(all[1].operation, Operation::kCut);
  EXPECT_DOUBLE_EQ(all[1].speed.count(), 12);
  EXPECT_DOUBLE_EQ(all[1].power.count(), 0.7);
  EXPECT_EQ(all[1].passes, 2);
  EXPECT_TRUE(all[1].air);
  EXPECT_EQ(all[1].kerf, (KerfRecord{0.31_mm, 0.22_mm}));
  EXPECT_EQ(all[2].operation, Operation::kEngrave);
  EXPECT_FALSE(all[2].air);
  EXPECT_FALSE(all[2].kerf);
}

TEST_F(MaterialsTest, ANewRecipeTakesThePlaceOfTheOld) {
  VENEER_ASSERT_OK(materials.set_recipe(cut("walnut")));
  auto slower = cut("walnut");
  slower.speed = 8_mm_s;
  slower.kerf.reset();
  VENEER_ASSERT_OK(materials.set_recipe(slower));
  const auto all = must(materials.recipes());
  ASSERT_EQ(all.size(), 1U);
  EXPECT_DOUBLE_EQ(all[0].speed.count(), 8);
  EXPECT_FALSE(all[0].kerf);
  VENEER_EXPECT_OK(materials.remove_recipe("walnut", Operation::kCut));
  EXPECT_EQ(materials.remove_recipe("walnut", Operation::kCut).error().code, ErrorCode::kNotFound);
}

TEST_F(MaterialsTest, RefusesValuesThatCannotBeAndNamesThem) {
  const auto message = [&](auto change) {
    auto recipe = cut("walnut");
    change(recipe);
    const Status refused = materials.set_recipe(recipe);
    return refused.ok() ? std::string("taken") : refused.error().message;
  };
  EXPECT_THAT(message([](auto& r) { r.speed = 0_mm_s; }), HasSubstr("speed"));
  EXPECT_THAT(message([](auto& r) { r.power = PowerFraction(1.2); }), HasSubstr("power"));
  EXPECT_THAT(message([](auto& r) { r.power = PowerFraction(std::nan("")); }), HasSubstr("power"));
  EXPECT_THAT(message([](auto& r) { r.passes = 0; }), HasSubstr("passes"));
  EXPECT_THAT(message([](auto& r) { r.kerf->show = 7_mm; }), HasSubstr("kerf"));
  EXPECT_THAT(message([](auto& r) { r.operation = Operation::kEngrave; }), HasSubstr("only cuts"));
  EXPECT_THAT(message([](auto& r) { r.material.clear(); }), HasSubstr("name"));
  EXPECT_TRUE(must(materials.recipes()).empty());
}

TEST_F(MaterialsTest, ZonesComeWithTheFirstScanAndAreNamedByAPerson) {
  const PanelId id = cell.new_panel();
  VENEER_ASSERT_OK(materials.add_zones(
      id, {{1, Region<PanelFrame>(square(10, 10, 100)), ""}, {2, Region<PanelFrame>(square(120, 10.5, 100)), ""}}));
  VENEER_ASSERT_OK(materials.set_material(id, 2, "walnut"));
  auto zones = must(materials.zones(id));
  ASSERT_EQ(zones.size(), 2U);
  EXPECT_EQ(zones[0].material, "");
  EXPECT_EQ(zones[1].material, "walnut");
  EXPECT_EQ(zones[1].shape.rings(), Region<PanelFrame>(square(120, 10.5, 100)).rings());
  // A later scan changes nothing.
  VENEER_ASSERT_OK(materials.add_zones(id, {{1, Region<PanelFrame>(square(0, 0, 5)), ""}}));
  EXPECT_EQ(must(materials.zones(id)).size(), 2U);
  VENEER_ASSERT_OK(materials.set_material(id, std::nullopt, "maple"));
  zones = must(materials.zones(id));
  EXPECT_EQ(zones[0].material, "maple");
  EXPECT_EQ(zones[1].material, "maple");
  EXPECT_THAT(materials.set_material(id, 7, "oak").error().message, HasSubstr("no zone 7"));
  EXPECT_EQ(materials.set_material({"P-0099"}, 1, "oak").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(materials.add_zones({"P-0099"}, {}).error().code, ErrorCode::kNotFound);
}

TEST_F(MaterialsTest, AZoneKeepsItsHolesAndHowSureTheScanWasOfIt) {
  const PanelId id = cell.new_panel();
  const auto ring = subtract(Region<PanelFrame>(square(10, 10, 100)), Region<PanelFrame>(square(40, 40, 20)));
  VENEER_ASSERT_OK(
      materials.add_zones(id, {{1, ring, "", 0.75}, {2, Region<PanelFrame>(square(45, 45, 5)), "", std::nullopt}}));
  const auto zones = must(materials.zones(id));
  ASSERT_EQ(zones.size(), 2U);
  EXPECT_EQ(zones[0].shape.rings(), ring.rings());
  EXPECT_EQ(zones[0].confidence, 0.75);
  EXPECT_EQ(zones[1].confidence, std::nullopt);
  EXPECT_FALSE(execute(cell.database(), "UPDATE zone_confidences SET confidence = 1").ok());
}

TEST_F(MaterialsTest, APersonDrawsAZoneAndNoOtherHasThatWoodAnyMore) {
  const PanelId id = cell.new_panel();
  VENEER_ASSERT_OK(materials.add_zones(
      id, {{1, Region<PanelFrame>(square(0, 0, 100)), ""}, {2, Region<PanelFrame>(square(100, 0, 100)), ""}}));
  VENEER_ASSERT_OK(materials.set_material(id, 2, "walnut"));
  EXPECT_EQ(must(materials.draw_zone(id, 1, Region<PanelFrame>(square(20, 0, 100)), "uid 7", kNow)), 1);
  auto zones = must(materials.zones(id));
  EXPECT_EQ(zones[0].shape.rings(), Region<PanelFrame>(square(20, 0, 100)).rings());
  EXPECT_EQ(zones[0].version, 2);
  EXPECT_NEAR(zones[1].shape.area().count(), 80 * 100, 1e-6);
  EXPECT_EQ(zones[1].material, "walnut");
  EXPECT_EQ(must(materials.draw_zone(id, std::nullopt, Region<PanelFrame>(square(50, 50, 10)), "uid 7", kNow)), 3);
  zones = must(materials.zones(id));
  ASSERT_EQ(zones.size(), 3U);
  EXPECT_EQ(zones[2].material, "");
  EXPECT_NEAR(zones[0].shape.area().count(), 100 * 100 - 100, 1e-6);
  EXPECT_EQ(zones[1].version, 2) << "nothing of it was drawn";
  EXPECT_EQ(must(materials.zones_without_outlines())[id][0].version, 3);
  EXPECT_EQ(materials.draw_zone(id, 7, Region<PanelFrame>(square(0, 0, 9)), "uid 7", kNow).error().code,
            ErrorCode::kNotFound);
  EXPECT_FALSE(execute(cell.database(), "UPDATE zone_versions SET outline_um = '~'").ok());
}

TEST_F(MaterialsTest, AZoneOfWhichNothingIsLeftOffersNoWood) {
  const PanelId id = cell.new_panel();
  VENEER_ASSERT_OK(materials.add_zones(id, {{1, Region<PanelFrame>(square(0, 0, 50)), ""}}));
  VENEER_ASSERT_OK(materials.set_material(id, 1, "walnut"));
  ASSERT_EQ(must(materials.woods()).at(id), std::vector<std::string>{"walnut"});
  EXPECT_EQ(must(materials.draw_zone(id, std::nullopt, Region<PanelFrame>(square(0, 0, 60)), "uid 7", kNow)), 2);
  EXPECT_FALSE(must(materials.woods()).contains(id));
  EXPECT_EQ(must(materials.zones_without_outlines()).at(id).size(), 1U);
  EXPECT_EQ(must(materials.zones(id)).size(), 2U) << "it can be drawn again";
}

TEST_F(MaterialsTest, WhoDrewAFurtherZoneIsKept) {
  const PanelId id = cell.new_panel();
  VENEER_ASSERT_OK(materials.add_zones(id, {{1, Region<PanelFrame>(square(0, 0, 100)), ""}}));
  EXPECT_EQ(must(materials.draw_zone(id, std::nullopt, Region<PanelFrame>(square(150, 0, 50)), "uid 7", kNow)), 2);
  EXPECT_THAT(texts(cell.database().connection(),
                    "SELECT number || ' ' || version || ' ' || who || ' ' || at FROM zone_versions"),
              ::testing::ElementsAre(std::string("2 2 uid 7 ") + kNow))
      << "nothing was drawn of the first";
  const auto zones = must(materials.zones(id));
  EXPECT_EQ(zones[1].shape.rings(), Region<PanelFrame>(square(150, 0, 50)).rings());
  EXPECT_EQ(zones[1].version, 2);
  EXPECT_EQ(zones[0].version, 1);
}

TEST_F(MaterialsTest, NoScanIsSureOfAnOutlineThatAPersonDrew) {
  const PanelId id = cell.new_panel();
  VENEER_ASSERT_OK(materials.add_zones(id, {{1, Region<PanelFrame>(square(0, 0, 100)), "", 0.75},
                                            {2, Region<PanelFrame>(square(200, 0, 50)), "", 0.625}}));
  must(materials.draw_zone(id, 1, Region<PanelFrame>(square(0, 0, 90)), "uid 7", kNow));
  const auto zones = must(materials.zones(id));
  EXPECT_EQ(zones[0].confidence, std::nullopt);
  EXPECT_EQ(zones[1].confidence, 0.625) << "nothing of it was drawn";
}

// Whatever is drawn, a piece is cut with the recipe of the wood that it was planned in.
TEST_F(MaterialsTest, WoodThatIsReservedStaysInItsZoneWhateverIsDrawn) {
  const PanelId id = cell.new_panel();
  VENEER_ASSERT_OK(materials.add_zones(
      id, {{1, Region<PanelFrame>(square(0, 0, 100)), ""}, {2, Region<PanelFrame>(square(100, 0, 100)), ""}}));
  must(JobStore(cell.database()).create(job_of({square_piece("A1", id, 120, 10, 14)}), kNow));
  const auto booked = must(Ledger(cell.database()).live_allocations(id)).front().area;
  must(materials.draw_zone(id, 1, Region<PanelFrame>(square(0, 0, 160)), "uid 7", kNow));
  auto zones = must(materials.zones(id));
  EXPECT_DOUBLE_EQ(intersect(zones[0].shape, booked).area().count(), 0);
  EXPECT_NEAR(intersect(zones[1].shape, booked).area().count(), booked.area().count(), 1e-6);
  must(materials.draw_zone(id, 2, Region<PanelFrame>(square(170, 0, 30)), "uid 7", kNow));
  zones = must(materials.zones(id));
  EXPECT_NEAR(intersect(zones[1].shape, booked).area().count(), booked.area().count(), 1e-6) << "not drawn any more";
  EXPECT_EQ(materials.draw_zone(id, 1, Region<PanelFrame>(square(122, 12, 5)), "uid 7", kNow).error().code,
            ErrorCode::kConflict);
}

TEST_F(MaterialsTest, TheOutlineOfAZoneNeverChanges) {
  const PanelId id = cell.new_panel();
  VENEER_ASSERT_OK(materials.add_zones(id, {{1, Region<PanelFrame>(square(10, 10, 100)), ""}}));
  EXPECT_FALSE(execute(cell.database(), "UPDATE zones SET outline_um = '[]'").ok());
}

}  // namespace
}  // namespace veneer::db
