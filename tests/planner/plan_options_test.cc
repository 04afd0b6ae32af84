// Options by name: each reaches its own field, and reads back as it was written.
#include "planner/plan_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "planner/plan.h"
#include "tests/support/synthetic_wood.h"

namespace veneer::planner {
namespace {

using ::testing::HasSubstr;

const std::map<std::string_view, std::string_view> kOther = {{"layout", "mosaic"},
                                                             {"triangles", "1"},
                                                             {"cell_aspect", "2.5"},
                                                             {"flow_lines_only", "1"},
                                                             {"patch_mm", "7.5"},
                                                             {"adaptive_levels", "2"},
                                                             {"adaptive_factor", "1.5"},
                                                             {"rotations", "3"},
                                                             {"fine_rotation", "1"},
                                                             {"refine", "dp"},
                                                             {"curves", "g1"},
                                                             {"overlap_mm", "2.5"},
                                                             {"min_width_mm", "1.25"},
                                                             {"min_size_mm", "3.5"},
                                                             {"rematch", "4"},
                                                             {"dpi", "120"},
                                                             {"w_intensity", "0.25"},
                                                             {"w_edge", "0.75"},
                                                             {"w_colour", "0.125"},
                                                             {"w_texture", "0.375"},
                                                             {"w_hist", "1"},
                                                             {"w_range", "0.625"},
                                                             {"w_detail", "0.4375"},
                                                             {"w_gamut", "0.875"},
                                                             {"w_grain", "0.0625"},
                                                             {"edge_mm", "0.6"},
                                                             {"priority", "center"},
                                                             {"optimize", "global"},
                                                             {"optimize_seconds", "12.5"},
                                                             {"optimize_iterations", "99"},
                                                             {"alternatives", "12"},
                                                             {"marks", "short"},
                                                             {"exact", "1"},
                                                             {"seed", "18446744073709551615"}};

TEST(PlanOptionsByName, EachChangesItselfAndNothingElse) {
  for (const NamedOption& option : kNamedOptions) {
    ASSERT_TRUE(kOther.count(option.name)) << option.name;
    PlanOptions options;
    ASSERT_NE(option_text(options, option.name), kOther.at(option.name)) << option.name;
    const Status set = set_option(options, option.name, kOther.at(option.name));
    ASSERT_TRUE(set.ok()) << set.error().message;
    for (const NamedOption& other : kNamedOptions)
      EXPECT_EQ(option_text(options, other.name),
                other.name == option.name ? std::string(kOther.at(other.name)) : option_text({}, other.name))
          << option.name << " and " << other.name;
    EXPECT_TRUE(check_options(options).ok()) << option.name;
  }
}

TEST(PlanOptionsByName, EachReachesTheFieldThatItsNameSays) {
  PlanOptions o;
  for (const auto& [name, text] : kOther) ASSERT_TRUE(set_option(o, name, text).ok());
  EXPECT_TRUE(o.triangles);
  EXPECT_EQ(o.cell_aspect, 2.5);
  EXPECT_TRUE(o.flow_lines_only);
  EXPECT_EQ(o.patch.count(), 7.5);
  EXPECT_EQ(o.adaptive_levels, 2);
  EXPECT_EQ(o.adaptive_factor, 1.5);
  EXPECT_EQ(o.rotations, 3);
  EXPECT_TRUE(o.fine_rotation);
  EXPECT_EQ(o.refine, Refine::kDp);
  EXPECT_EQ(o.curves, Curves::kG1);
  EXPECT_EQ(o.overlap.count(), 2.5);
  EXPECT_EQ(o.min_width.count(), 1.25);
  EXPECT_EQ(o.min_size.count(), 3.5);
  EXPECT_EQ(o.rematch, 4);
  EXPECT_EQ(o.dpi, 120);
  EXPECT_EQ(o.w_intensity, 0.25);
  EXPECT_EQ(o.w_edge, 0.75);
  EXPECT_EQ(o.w_colour, 0.125);
  EXPECT_EQ(o.w_texture, 0.375);
  EXPECT_EQ(o.w_hist, 1);
  EXPECT_EQ(o.w_range, 0.625);
  EXPECT_EQ(o.w_detail, 0.4375);
  EXPECT_EQ(o.w_gamut, 0.875);
  EXPECT_EQ(o.w_grain, 0.0625);
  EXPECT_EQ(o.edge.count(), 0.6);
  EXPECT_EQ(o.priority, Priority::kCentre);
  EXPECT_EQ(o.optimize, Optimize::kGlobal);
  EXPECT_EQ(o.optimize_seconds, 12.5);
  EXPECT_EQ(o.optimize_iterations, 99U);
  EXPECT_EQ(o.alternatives, 12U);
  EXPECT_EQ(o.marks, MarkKind::kShort);
  EXPECT_TRUE(o.exact);
  EXPECT_EQ(o.seed, 18446744073709551615U);
}

TEST(PlanOptionsByName, WhatIsNoValueIsRefusedByNameAndChangesNothing) {
  for (const NamedOption& option : kNamedOptions)
    for (const std::string text : {"", "x", "1x", "1e999", " 1"}) {
      PlanOptions options;
      const Status set = set_option(options, option.name, text);
      ASSERT_FALSE(set.ok()) << option.name << "=" << text;
      EXPECT_EQ(set.error().code, ErrorCode::kInvalidArgument);
      EXPECT_THAT(set.error().message, HasSubstr(std::string(option.name) + " must be "));
      EXPECT_EQ(option_text(options, option.name), option_text({}, option.name));
    }
  PlanOptions options;
  EXPECT_THAT(set_option(options, "seed", "-1").error().message, HasSubstr("seed must be a whole number from 0"));
  EXPECT_FALSE(set_option(options, "rotations", "2.5").ok());
  EXPECT_FALSE(set_option(options, "fine_rotation", "2").ok());
}

TEST(PlanOptionsByName, NoNumberOfThemMayBeInfiniteOrNone) {
  for (const NamedOption& option : kNamedOptions) {
    if (option.kind != OptionKind::kNumber) continue;
    for (const std::string text : {"nan", "inf", "-inf"}) {
      PlanOptions options;
      ASSERT_TRUE(set_option(options, option.name, text).ok());
      EXPECT_FALSE(check_options(options).ok()) << option.name << "=" << text;
    }
  }
}

TEST(PlanOptionsByName, WhatCannotBePlannedWithIsRefusedInThePlannersWords) {
  const auto refusal = [](std::string_view name, std::string_view text) {
    PlanOptions options;
    EXPECT_TRUE(set_option(options, name, text).ok());
    const Status checked = check_options(options);
    return checked.ok() ? "" : checked.error().message;
  };
  EXPECT_EQ(refusal("patch_mm", "0"), "the patch size must lie between 0.1 and 10000 mm");
  EXPECT_EQ(refusal("rotations", "-1"), "the number of rotations must lie between 1 and 360");
  EXPECT_EQ(refusal("alternatives", "1001"), "the number of alternatives must lie between 0 and 1000");
  const auto panel = test::wood_panel("P", 60, 60, 75, 1);
  const auto picture = test::blob_artwork("A", 20, 20, 6_mm, 3);
  PlanOptions options;
  ASSERT_TRUE(set_option(options, "w_edge", "2").ok());
  EXPECT_EQ(make_plan({&picture, 1}, {&panel, 1}, options).error().message, check_options(options).error().message);
}

}  // namespace
}  // namespace veneer::planner
