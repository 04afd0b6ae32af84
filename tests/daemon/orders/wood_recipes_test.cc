// Which recipe a piece gets, what a plan must keep between pieces for it, and the files made of strokes.
#include "daemon/orders/wood_recipes.h"

#include <gmock/gmock.h>

#include "daemon/orders/wood_options.h"
#include "daemon/plans/cut_file.h"
#include "planner/cutting/lead_choice.h"

namespace veneer::daemon {
namespace {

using ::testing::HasSubstr;

Ring<PanelFrame> box(double x, double y, double width, double height) {
  return {point<PanelFrame>(x, y), point<PanelFrame>(x + width, y), point<PanelFrame>(x + width, y + height),
          point<PanelFrame>(x, y + height)};
}

RecipeConfig configured() {
  RecipeConfig config;
  config.cut_speed = 15_mm_s;
  config.engrave_speed = 80_mm_s;
  return config;
}

// Walnut on the left, a strip nobody has named, maple on the right.
WoodRecipes three_strips() {
  return {configured(),
          Millimetres(0.27),
          {{"maple", db::Operation::kEngrave, 120_mm_s, PowerFraction(0.1), 2, false, std::nullopt, ""},
           {"walnut", db::Operation::kCut, 9_mm_s, PowerFraction(0.9), 3, false,
            db::KerfRecord{Millimetres(0.4), Millimetres(0.3)}, ""}},
          {{1, Region<PanelFrame>(box(0, 0, 100, 300)), "walnut"},
           {2, Region<PanelFrame>(box(101, 0, 100, 300)), ""},
           {3, Region<PanelFrame>(box(202, 0, 100, 300)), "maple"}}};
}

TEST(WoodRecipes, APieceTakesTheRecipeOfTheZoneItLiesIn) {
  const auto recipes = three_strips();
  const auto at = [&](double x) { return recipes.recipe_of(recipes.material_at(box(x, 50, 14, 14))); };
  const auto walnut = at(40);
  EXPECT_DOUBLE_EQ(walnut.cut_speed.count(), 9);
  EXPECT_EQ(walnut.cut_passes, 3);
  EXPECT_FALSE(walnut.air);
  EXPECT_TRUE(walnut.engrave_air);
  EXPECT_DOUBLE_EQ(walnut.kerf_back.count(), 0.4);
  EXPECT_DOUBLE_EQ(walnut.kerf_show.count(), 0.3);
  // What is not written about a wood is the configuration's and the certificate's.
  EXPECT_DOUBLE_EQ(walnut.engrave_speed.count(), 80);
  const auto maple = at(250);
  EXPECT_DOUBLE_EQ(maple.engrave_speed.count(), 120);
  EXPECT_EQ(maple.engrave_passes, 2);
  EXPECT_FALSE(maple.engrave_air);
  EXPECT_TRUE(maple.air);
  EXPECT_DOUBLE_EQ(maple.cut_speed.count(), 15);
  EXPECT_DOUBLE_EQ(maple.kerf_back.count(), 0.27);
  EXPECT_DOUBLE_EQ(at(140).cut_speed.count(), 15);
  EXPECT_DOUBLE_EQ(at(1000).cut_speed.count(), 15) << "in no zone";
}

TEST(WoodRecipes, APieceAcrossTwoZonesTakesTheOneMostOfItLiesIn) {
  const auto recipes = three_strips();
  EXPECT_EQ(recipes.material_at(box(90, 0, 14, 14)), "walnut");
  EXPECT_EQ(recipes.material_at(box(97, 0, 14, 14)), "");
}

TEST(WoodRecipes, APlanKeepsRoomForTheWidestKerfOfThePanel) {
  EXPECT_DOUBLE_EQ(three_strips().widest_kerf().count(), 0.4);
  EXPECT_DOUBLE_EQ(WoodRecipes(configured(), Millimetres(0.27), {}, {}).widest_kerf().count(), 0.27);
}

db::PieceRecord piece(const std::string& mark, double x, double y) {
  db::PieceRecord record;
  record.id = PieceId{7};
  record.mark = mark;
  record.panel = PanelId{"P-0001"};
  record.panel_outline = box(x, y, 16, 16);
  record.panel_from_artwork = Isometry2<PanelFrame, ArtworkFrame>(Radians(0), point<PanelFrame>(x, y));
  return record;
}

TEST(WoodRecipes, ACutWiderThanWhatWasBookedIsRefused) {
  const auto walnut = three_strips().recipe_of("walnut");
  const auto check = [&](const db::PieceRecord& p, double kerf) {
    return check_booked(p, "walnut", walnut, 0.05_mm, offset(Region<PanelFrame>(p.panel_outline), Millimetres(kerf)));
  };
  db::PieceRecord square = piece("A1", 40, 50);
  EXPECT_TRUE(check(square, 0.4).ok());
  const Status refused = check(square, 0.27);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kRefused);
  EXPECT_THAT(refused.error().message, HasSubstr("walnut piece A1"));
  EXPECT_THAT(refused.error().message, HasSubstr("0.40 mm"));
  // A square on its corner: what is booked reaches farther out at its corners than the kerf.
  square.panel_outline = {point<PanelFrame>(50, 40), point<PanelFrame>(60, 50), point<PanelFrame>(50, 60),
                          point<PanelFrame>(40, 50)};
  EXPECT_FALSE(check(square, 0.35).ok());
  EXPECT_TRUE(check(square, 0.4).ok());
}

TEST(WoodRecipes, ALeadInThatIsNotBookedIsRefused) {
  const auto walnut = three_strips().recipe_of("walnut");
  db::PieceRecord led = piece("A1", 40, 50);
  led.lead_in = point<PanelFrame>(56.8, 66.8);
  const auto kerf_alone = offset(Region<PanelFrame>(led.panel_outline), 0.4_mm);
  EXPECT_FALSE(check_booked(led, "walnut", walnut, 0.05_mm, kerf_alone).ok());
  const auto lead = planner::lead_of(led.panel_outline, *led.lead_in, walnut, 0.05_mm);
  ASSERT_TRUE(lead.ok());
  const auto burnt = planner::lead_burn(*lead, walnut.widest_kerf());
  EXPECT_TRUE(check_booked(led, "walnut", walnut, 0.05_mm, unite(kerf_alone, burnt)).ok());
  led.lead_in = point<PanelFrame>(39.2, 66.8);  // at another corner than the booked one
  EXPECT_FALSE(check_booked(led, "walnut", walnut, 0.05_mm, unite(kerf_alone, burnt)).ok());
}

TEST(WoodRecipes, TheConfigurationSaysHowMarksBridgesClearanceAndOrderAre) {
  RecipeConfig config = configured();
  config.mark_min_height = 1.5_mm;
  config.fit_clearance = 0.1_mm;
  config.lead_in = 0.5_mm;
  config.bridges = false;
  config.cut_order = "assembly";
  const auto options = toolpath_options(config);
  EXPECT_EQ(options.marks.min_height, 1.5_mm);
  EXPECT_EQ(options.fit_clearance, 0.1_mm);
  EXPECT_EQ(options.leads.length, 0.5_mm);
  EXPECT_FALSE(options.bridges.on);
  EXPECT_TRUE(options.assembly_order);
  EXPECT_TRUE(toolpath_options(configured()).bridges.on);
  EXPECT_FALSE(toolpath_options(configured()).assembly_order);
}

TEST(WoodRecipes, TheEstimateKnowsTheMachineThatTellsHowItMoves) {
  const auto told = kinematics_of(
      LaserMotion{MmPerSecond(150), MmPerSecond(100), MmPerSecond2(300), MmPerSecond2(500), 0.002_mm, 100});
  EXPECT_EQ(told.rapid_x.count(), 150);
  EXPECT_EQ(told.rapid_y.count(), 100);
  EXPECT_EQ(told.acceleration_x.count(), 300);
  EXPECT_EQ(told.acceleration_y.count(), 500);
  EXPECT_EQ(told.junction_deviation, 0.002_mm);
  EXPECT_EQ(told.planner_moves, 100);
  EXPECT_EQ(kinematics_of(std::nullopt).rapid_x, planner::Kinematics{}.rapid_x);
}

Result<CutFile> file_of(const db::PanelRecord& panel, const db::PieceRecord& one) {
  const Travel travel{300_mm, 200_mm};
  const auto order = path_from_home(panel, {one}, three_strips(), configured(), travel);
  if (!order) return order.error();
  const auto path = planner::make_toolpath(order->pieces, order->options);
  if (!path) return path.error();
  return egv_of(*path, travel);
}

TEST(CutFile, AJobsPanelBecomesOneProgramForALihuiyuBoard) {
  db::PanelRecord panel;
  panel.id = PanelId{"P-0001"};
  panel.width = 280_mm, panel.height = 150_mm;
  const auto file = file_of(panel, piece("A1", 20, 120));
  ASSERT_TRUE(file.ok()) << file.error().message;
  EXPECT_TRUE(file->warnings.empty());
  EXPECT_THAT(file->text, HasSubstr("LHYMICRO-GL"));
  EXPECT_THAT(file->text, HasSubstr("S1E"));
  EXPECT_THAT(file->text, HasSubstr("FNSE"));
  // A lead-in that is booked is burnt: the program is another one.
  db::PieceRecord led = piece("A1", 20, 120);
  led.lead_in = point<PanelFrame>(36.8, 136.8);
  const auto with_lead = file_of(panel, led);
  ASSERT_TRUE(with_lead.ok()) << with_lead.error().message;
  EXPECT_NE(with_lead->text, file->text);
  panel.width = 420_mm;
  const auto wide = file_of(panel, piece("A1", 20, 120));
  ASSERT_FALSE(wide.ok());
  EXPECT_EQ(wide.error().code, ErrorCode::kInvalidArgument);
}

TEST(CutFile, ATestCardRunsDryWithoutABeam) {
  const auto card = planner::make_test_card({});
  ASSERT_TRUE(card.ok());
  const LaserJob burnt = job_of(*card), dark = job_of(*card, true);
  ASSERT_EQ(burnt.strokes.size(), card->labels.size() + card->fields.size());
  EXPECT_EQ(burnt.strokes.front().path, card->labels.front().path);
  for (std::size_t i = 0; i < burnt.strokes.size(); ++i) {
    EXPECT_GT(burnt.strokes[i].power.count(), 0);
    EXPECT_EQ(dark.strokes[i].power.count(), 0);
    EXPECT_EQ(dark.strokes[i].path, burnt.strokes[i].path);
  }
  const auto egv = egv_of(*card, {});
  ASSERT_TRUE(egv.ok()) << egv.error().message;
  EXPECT_THAT(egv->text, HasSubstr("FNSE"));
}

TEST(WoodOptions, HaveTheLimitsOfAJobsWood) {
  JobWood wood;
  wood.wood_limits = {{"oak", 0.25}, {"black walnut", 1}};
  const auto options = wood_options({{"optimize", "global"}}, wood, {}, Millimetres(0.27), {});
  ASSERT_TRUE(options.ok()) << options.error().message;
  EXPECT_EQ(options->material_limits, (std::vector<planner::MaterialLimit>{{"oak", 0.25}, {"black walnut", 1}}));
  EXPECT_EQ(options->optimize, planner::Optimize::kGlobal);
  EXPECT_EQ(options->kerf.count(), 0.27);
}

}  // namespace
}  // namespace veneer::daemon
