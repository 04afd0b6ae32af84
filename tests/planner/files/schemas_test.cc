// plan.json and report.json are what docs/schemas say, whatever they have to tell.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "planner/files/plan_files.h"
#include "planner/files/plan_report.h"
#include "tests/support/json_schema.h"
#include "tests/support/small_plans.h"
#include "tests/support/synthetic_wood.h"

namespace veneer::planner {
namespace {

using nlohmann::json;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using veneer::testing::schema_errors;

PlanOptions coarse_options() {
  PlanOptions options = test::small_options();
  options.patch = 10_mm;
  return options;
}

Plan planned(const PlanOptions& options, Millimetres side = 50_mm) {
  const std::vector<Artwork> artworks{test::blob_artwork("A", 40, 40, side, 1)};
  const std::vector<StockPanel> stock{test::wood_panel("P-1", 60, 60, 50.8, 2), test::wood_panel("Q", 50, 40, 50.8, 3)};
  return make_plan(artworks, stock, options).value();
}

json report_of(const Plan& plan) { return json::parse(report_to_json(plan, {0.5, 2.5}, 1234, 3)); }

void expect_published(const Plan& plan) {
  EXPECT_THAT(schema_errors(json::parse(plan_to_json(plan)), "plan.schema.json"), IsEmpty());
  EXPECT_THAT(schema_errors(report_of(plan), "plan-report.schema.json"), IsEmpty());
}

TEST(Schemas, SayWhatAPlanOfScarceWoodSays) {
  const Plan plan = planned(coarse_options());
  ASSERT_GT(unfilled(plan), 0U);
  ASSERT_LT(unfilled(plan), plan.pieces.size());
  ASSERT_TRUE(plan.shortage.has_value());
  expect_published(plan);
}

TEST(Schemas, SayWhatIsAskedForBesides) {
  PlanOptions options = coarse_options();
  options.patch = 4_mm, options.alternatives = 3, options.fine_rotation = true, options.adaptive_levels = 1;
  options.optimize = Optimize::kGlobal, options.optimize_iterations = 500;
  options.min_width = 6_mm;
  const Plan plan = planned(options, 20_mm);
  ASSERT_FALSE(plan.unfit.empty());
  ASSERT_TRUE(plan.global && plan.fine);
  ASSERT_TRUE(std::any_of(plan.pieces.begin(), plan.pieces.end(),
                          [](const Piece& piece) { return !piece.alternatives.empty(); }));
  expect_published(plan);
}

TEST(Schemas, SayWhatBecameOfLimits) {
  const std::vector<Artwork> artworks{test::blob_artwork("A", 40, 40, 20_mm, 1)};
  std::vector<StockPanel> stock{test::wood_panel("P-1", 60, 60, 50.8, 2), test::wood_panel("Q", 60, 60, 50.8, 3)};
  stock[0].material = "oak", stock[1].material = "ash";
  PlanOptions options = coarse_options();
  options.patch = 5_mm, options.material_limits = {{"oak", 0.2}, {"ash", 0.3}};
  const Plan plan = make_plan(artworks, stock, options).value();
  const json limits = report_of(plan)["material_limits"];
  ASSERT_EQ(limits.size(), 2U);
  EXPECT_EQ(limits[0]["material"], "oak");
  EXPECT_EQ(limits[0]["limit"], 0.2);
  EXPECT_TRUE(limits[1]["binds"]);
  expect_published(plan);
}

TEST(Schemas, SayWhatAPlanWithRefinedBordersSays) {
  PlanOptions options = coarse_options();
  options.patch = 6_mm, options.refine = Refine::kDp, options.rematch = 2;
  const Plan plan = planned(options, 24_mm);
  ASSERT_TRUE(plan.refined.has_value());
  ASSERT_FALSE(plan.layouts.empty());
  expect_published(plan);
}

TEST(Schemas, SayWhatAPlanWithAMorphedGridSays) {
  PlanOptions options = coarse_options();
  options.patch = 6_mm, options.layout = LayoutKind::kMorph;
  const Plan plan = planned(options, 24_mm);
  ASSERT_TRUE(plan.morph.has_value());
  ASSERT_FALSE(plan.layouts.empty());
  expect_published(plan);
}

TEST(Schemas, RefuseWhatIsNotAPlan) {
  const json good = json::parse(plan_to_json(planned(coarse_options(), 20_mm)));
  ASSERT_THAT(schema_errors(good, "plan.schema.json"), IsEmpty());
  const auto expect_refused = [](const json& bad) {
    EXPECT_THAT(schema_errors(bad, "plan.schema.json"), Not(IsEmpty())) << bad.dump().substr(0, 400);
  };
  json bad = good;
  bad["schema_version"] = 2;
  expect_refused(bad);
  bad = good, bad["pieces"][0].erase("cost");
  expect_refused(bad);
  bad = good, bad["pieces"][0]["row"] = "first";
  expect_refused(bad);
  bad = good, bad["pieces"][0]["artwork_outline_mm"][0] = {1, 2, 3};
  expect_refused(bad);
  bad = good, bad["pieces"][0]["panel_from_artwork"] = 7;
  expect_refused(bad);
  bad = good, bad["pieces"][0]["not_published"] = 1;
  expect_refused(bad);
}

TEST(Schemas, RefuseWhatIsNotAReport) {
  const json good = report_of(planned(coarse_options(), 20_mm));
  ASSERT_THAT(schema_errors(good, "plan-report.schema.json"), IsEmpty());
  for (const auto& [key, value] : good.items()) {
    json bad = good;
    bad.erase(key);
    EXPECT_THAT(schema_errors(bad, "plan-report.schema.json"), Not(IsEmpty())) << key << " is missing";
    bad = good, bad[key] = json::array({json::object()});
    EXPECT_THAT(schema_errors(bad, "plan-report.schema.json"), Not(IsEmpty())) << key << " is something else";
  }
  json bad = good;
  bad["seconds"]["load"] = -1;
  EXPECT_THAT(schema_errors(bad, "plan-report.schema.json"), Contains(HasSubstr("load")));
}

}  // namespace
}  // namespace veneer::planner
