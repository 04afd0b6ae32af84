// No more of a wood than it may be: whoever chooses, moves, or is offered some.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "planner/edits/plan_edits.h"
#include "planner/files/plan_files.h"
#include "planner/plan.h"
#include "planner/problem/material_limits.h"
#include "tests/support/synthetic_wood.h"

namespace veneer::planner {
namespace {

using ::testing::HasSubstr;

// A dark and a pale panel, and a picture that is dark on the right and a little less so on the left: without a limit
// every piece is of the dark wood.
class WoodLimits : public ::testing::Test {
 protected:
  WoodLimits() {
    stock_ = {test::wood_panel("dark", 90, 90, 50.8, 1), test::wood_panel("pale", 90, 90, 50.8, 2)};
    stock_[0].picture.pixels.setTo(cv::Scalar::all(60)), stock_[1].picture.pixels.setTo(cv::Scalar::all(190));
    for (StockPanel& panel : stock_) {
      cv::Mat grain(panel.picture.pixels.size(), CV_8UC3);
      cv::RNG(4).fill(grain, cv::RNG::UNIFORM, 0, 20);
      panel.picture.pixels += grain;
      panel.material = panel.id.value;
    }
    artwork_ = test::blob_artwork("A", 60, 60, 24_mm, 3);
    cv::RNG(5).fill(artwork_.picture, cv::RNG::UNIFORM, 50, 70);
    artwork_.picture.colRange(0, 30) += cv::Scalar::all(60);
    options_.priority = Priority::kCentre;
    options_.patch = 4_mm, options_.dpi = 50.8, options_.rotations = 1, options_.threads = 2;
    options_.w_edge = 0, options_.w_hist = 0;
  }
  // The share of the picture's area that is of the panel.
  double share_of(const Plan& plan, const std::string& panel) const {
    double sum = 0;
    for (const Piece& piece : plan.pieces)
      if (piece.placement && piece.placement->panel.value == panel) sum += signed_area(piece.artwork_outline);
    return sum / (artwork_.width * artwork_.height).count();
  }
  Result<Plan> planned() const { return make_plan({&artwork_, 1}, stock_, options_); }

  static WoodZone zone(const char* material, double left, double right) {
    return {material,
            {point<PanelFrame>(left, 0), point<PanelFrame>(right, 0), point<PanelFrame>(right, 45),
             point<PanelFrame>(left, 45)}};
  }
  // One panel of 90 x 45 mm instead, dark on the left and pale on the right.
  void lay_both_on_one_panel() {
    StockPanel panel = test::wood_panel("P", 180, 90, 50.8, 1);
    for (int k = 0; k < 2; ++k)
      stock_[static_cast<std::size_t>(k)].picture.pixels.copyTo(panel.picture.pixels(cv::Rect(90 * k, 0, 90, 90)));
    panel.zones = {zone("dark", 0, 45), zone("pale", 45, 90)};
    stock_ = {panel};
  }
  // The share of the picture's area whose pieces have their middles on the panel from `left` to `right`, mm.
  double share_between(const Plan& plan, double left, double right) const {
    double sum = 0;
    for (const Piece& piece : plan.pieces) {
      if (!piece.placement) continue;
      const Box<PanelFrame> box = bounds(piece.panel_outline());
      const double middle = (box.min.x + box.max.x).count() / 2;
      if (left <= middle && middle < right) sum += signed_area(piece.artwork_outline);
    }
    return sum / (artwork_.width * artwork_.height).count();
  }
  double left_share(const Plan& plan) const { return share_between(plan, 0, 45); }
  // Of the warnings, those of limits and holes; each in a line of its own.
  static std::string said(const Plan& plan) {
    std::string out;
    for (const std::string& it : plan.warnings) out += it + "\n";
    return out;
  }

  std::vector<StockPanel> stock_;
  Artwork artwork_;
  PlanOptions options_;
};

TEST_F(WoodLimits, IsKeptByPatchesThatChooseInTurn) {
  const auto free = planned();
  ASSERT_TRUE(free.ok()) << free.error().message;
  ASSERT_EQ(unfilled(*free), 0U);
  EXPECT_GT(share_of(*free, "dark"), 0.9);
  EXPECT_TRUE(free->material_shares.empty());
  options_.material_limits = {{"dark", 0.3}};
  const auto limited = planned();
  ASSERT_TRUE(limited.ok()) << limited.error().message;
  EXPECT_EQ(unfilled(*limited), 0U);
  EXPECT_LE(share_of(*limited, "dark"), 0.3 + 1e-9);
  EXPECT_GT(share_of(*limited, "dark"), 0.27) << "nothing is given away";
  ASSERT_EQ(limited->material_shares.size(), 1U);
  EXPECT_TRUE(limited->material_shares[0].binds);
  EXPECT_NEAR(limited->material_shares[0].share, share_of(*limited, "dark"), 1e-9);
  EXPECT_THAT(limited->warnings, ::testing::Contains(HasSubstr("as much as it may be (30 %)")));
  // What comes first in the queue has it: the middle of the picture.
  double furthest_dark = 0, nearest_pale = 1e9;
  for (std::size_t i = 0; i < free->pieces.size(); ++i) {
    if (free->pieces[i].placement->panel.value != "dark") continue;  // it is pale all the same
    const Point<ArtworkFrame> middle = middle_of(limited->pieces[i].artwork_outline);
    const double far = std::hypot(middle.x.count() - 12, middle.y.count() - 12);
    if (limited->pieces[i].placement->panel.value == "dark")
      furthest_dark = std::max(furthest_dark, far);
    else
      nearest_pale = std::min(nearest_pale, far);
  }
  EXPECT_GT(furthest_dark, 0);
  EXPECT_LE(furthest_dark, nearest_pale + 1e-9);
  options_.threads = 1;
  EXPECT_EQ(plan_to_json(*planned()), plan_to_json(*limited));
}

TEST_F(WoodLimits, IsKeptByPatchesThatChooseTogether) {
  options_.material_limits = {{"dark", 0.3}};
  const auto greedy = planned();
  options_.optimize = Optimize::kGlobal, options_.optimize_iterations = 60000;
  const auto global = planned();
  ASSERT_TRUE(global.ok()) << global.error().message;
  EXPECT_EQ(unfilled(*global), 0U);
  EXPECT_LE(share_of(*global, "dark"), 0.3 + 1e-9);
  EXPECT_LT(cost_total(*global), 0.99 * cost_total(*greedy)) << "the darkest patches have the dark wood now";
}

TEST_F(WoodLimits, CountsZonesAndPiecesThatAreKept) {
  lay_both_on_one_panel();
  options_.material_limits = {{"dark", 0.4}, {"pale", 1}};
  const auto limited = planned();
  ASSERT_TRUE(limited.ok()) << limited.error().message;
  ASSERT_EQ(unfilled(*limited), 0U);
  EXPECT_LE(left_share(*limited), 0.4 + 1e-9);
  EXPECT_GT(left_share(*limited), 0.36);
  EXPECT_FALSE(limited->material_shares[1].binds);
  // All dark pieces stay, so no other may be dark.
  for (const Piece& piece : limited->pieces) {
    const bool stays = bounds(piece.panel_outline()).max.x.count() < 45;
    options_.kept.push_back({piece.mark, piece.cells, stays ? piece.placement : std::nullopt});
  }
  options_.material_limits = {{"dark", 0.2}};
  const auto kept = planned();
  ASSERT_TRUE(kept.ok()) << kept.error().message;
  EXPECT_LE(left_share(*kept), left_share(*limited) + 1e-9);
  EXPECT_GT(left_share(*kept), 0.3) << "what stays is no less for it";
  EXPECT_TRUE(kept->material_shares[0].binds);
  EXPECT_THAT(said(*kept), HasSubstr("more than it may be (20 %)"));
  EXPECT_THAT(said(*kept), Not(HasSubstr("as much as it may be")));
}

// The wood gets paler from left to right, so that pieces beside the dark zone would rather lie a little further left.
TEST_F(WoodLimits, IsKeptByPiecesThatAreTurnedFinely) {
  lay_both_on_one_panel();
  cv::Mat& pixels = stock_[0].picture.pixels;
  for (int c = 0; c < pixels.cols; ++c) pixels.col(c) = cv::Scalar::all(60 + 130.0 * c / pixels.cols);
  options_.material_limits = {{"dark", 0.3}};
  const auto before = planned();
  ASSERT_TRUE(before.ok()) << before.error().message;
  options_.fine_rotation = true;
  const auto fine = planned();
  ASSERT_TRUE(fine.ok()) << fine.error().message;
  ASSERT_EQ(unfilled(*fine), 0U);
  EXPECT_GT(fine->fine->moved, 0U);
  EXPECT_LE(left_share(*fine), 0.3 + 1e-9);
  EXPECT_NEAR(left_share(*fine), left_share(*before), 1e-9);
}

TEST_F(WoodLimits, OfZonesAreKeptByPatchesThatChooseTogether) {
  lay_both_on_one_panel();
  options_.material_limits = {{"dark", 0.3}, {"pale", 0.9}};
  options_.optimize = Optimize::kGlobal, options_.optimize_iterations = 20000;
  const auto plan = planned();
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  EXPECT_EQ(unfilled(*plan), 0U);
  EXPECT_LE(left_share(*plan), 0.3 + 1e-9);
  EXPECT_GT(left_share(*plan), 0.27);
  EXPECT_TRUE(plan->material_shares[0].binds);
  EXPECT_FALSE(plan->material_shares[1].binds);
}

// From 20 to 45 mm nobody knows whether it is dark or red: pieces there count for both.
TEST_F(WoodLimits, OfZonesThatReachIntoEachOtherAreBothKept) {
  lay_both_on_one_panel();
  stock_[0].zones = {zone("dark", 0, 45), zone("red", 20, 45), zone("pale", 45, 90)};
  for (const Optimize how : {Optimize::kGreedy, Optimize::kGlobal}) {
    options_.optimize = how, options_.optimize_iterations = 20000;
    for (const bool red_is_first : {true, false}) {
      options_.material_limits = {{"dark", 0.6}, {"red", 0.1}};
      if (red_is_first) std::swap(options_.material_limits[0], options_.material_limits[1]);
      const auto plan = planned();
      ASSERT_TRUE(plan.ok()) << plan.error().message;
      EXPECT_EQ(unfilled(*plan), 0U);
      EXPECT_LE(share_between(*plan, 0, 45), 0.6 + 1e-9);
      EXPECT_LE(share_between(*plan, 20, 45), 0.1 + 1e-9);
      EXPECT_NEAR(plan->material_shares[red_is_first ? 0 : 1].share, share_between(*plan, 20, 45), 1e-9);
      EXPECT_NEAR(plan->material_shares[red_is_first ? 1 : 0].share, share_between(*plan, 0, 45), 1e-9);
    }
  }
}

TEST_F(WoodLimits, OfNothingKeepsAWoodOutOfThePicture) {
  options_.material_limits = {{"dark", 0}};
  for (const Optimize how : {Optimize::kGreedy, Optimize::kGlobal}) {
    options_.optimize = how, options_.optimize_iterations = 2000;
    const auto plan = planned();
    ASSERT_TRUE(plan.ok()) << plan.error().message;
    EXPECT_EQ(unfilled(*plan), 0U);
    EXPECT_EQ(share_of(*plan, "dark"), 0);
    EXPECT_TRUE(plan->material_shares[0].binds);
  }
}

// Who was refused nothing is not told of a limit, however near the share came to it.
TEST_F(WoodLimits, ThatRefusedNobodyDoNotBind) {
  for (const Optimize how : {Optimize::kGreedy, Optimize::kGlobal}) {
    options_.optimize = how, options_.optimize_iterations = 2000;
    options_.material_limits = {};
    const double dark = share_of(*planned(), "dark");
    for (const double share : {1.0, dark}) {
      options_.material_limits = {{"dark", share}};
      const auto plan = planned();
      ASSERT_TRUE(plan.ok()) << plan.error().message;
      EXPECT_FALSE(plan->material_shares[0].binds) << share;
      EXPECT_THAT(said(*plan), Not(HasSubstr("may be"))) << share;
    }
  }
}

// Far too little wood, and a limit that changes nothing about it.
TEST_F(WoodLimits, AreNotBlamedForWoodThatIsMissing) {
  for (StockPanel& panel : stock_)
    panel = test::wood_panel(panel.id.value, 24, 24, 50.8, 1), panel.material = panel.id.value;
  options_.material_limits = {{"dark", 1}};
  const auto plan = planned();
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  ASSERT_GT(unfilled(*plan), 0U);
  EXPECT_FALSE(plan->material_shares[0].binds);
  EXPECT_THAT(said(*plan), HasSubstr("add a panel"));
  EXPECT_THAT(said(*plan), Not(HasSubstr("limit")));
}

// Wood that is short: pieces are packed as they are without a limit.
TEST_F(WoodLimits, ThatNeverBindLeaveThePackingAsItIs) {
  stock_ = {stock_[0]};
  stock_[0] = test::wood_panel("dark", 64, 64, 50.8, 1), stock_[0].material = "dark";
  options_.rotations = 3, options_.w_hist = 0.5;
  const auto greedy = planned();
  ASSERT_GT(unfilled(*greedy), 0U);
  options_.optimize = Optimize::kGlobal, options_.optimize_iterations = 1;
  const auto free = planned();
  ASSERT_LT(unfilled(*free), unfilled(*greedy));
  options_.material_limits = {{"dark", 1}};
  EXPECT_EQ(plan_to_json(*planned()), plan_to_json(*free));
}

TEST_F(WoodLimits, ThatLeavesHolesIsNamed) {
  options_.material_limits = {{"dark", 0.3}, {"pale", 0.3}};
  const auto plan = planned();
  ASSERT_TRUE(plan.ok());
  EXPECT_GT(unfilled(*plan), 0U);
  EXPECT_THAT(plan->warnings, ::testing::Contains(HasSubstr("raise its limit (--material-limit)")));
  // The wood that is closed is no help, unless the limit is raised.
  EXPECT_THAT(said(*plan), HasSubstr("within the limits"));
  EXPECT_THAT(said(*plan), Not(HasSubstr("enough for them")));
  EXPECT_LT(plan->shortage->left->count(), 1);
}

// Other places are offered to be taken: none of them may break a limit, each piece's own wood being free then.
TEST_F(WoodLimits, AreHeededByOtherPlacesThatAreListed) {
  options_.material_limits = {{"dark", 0.3}}, options_.alternatives = 3;
  for (const bool on_one_panel : {false, true}) {
    if (on_one_panel) lay_both_on_one_panel();
    const auto is_dark = [&](const Piece& piece, const Placement& there) {
      const double middle = (there.panel_from_artwork * middle_of(piece.artwork_outline)).x.count();
      return on_one_panel ? middle < 45 : there.panel.value == "dark";
    };
    for (const Optimize how : {Optimize::kGreedy, Optimize::kGlobal}) {
      options_.optimize = how, options_.optimize_iterations = 2000, options_.threads = 2;
      const auto plan = planned();
      ASSERT_TRUE(plan.ok()) << plan.error().message;
      ASSERT_EQ(unfilled(*plan), 0U);
      ASSERT_TRUE(plan->material_shares[0].binds);
      std::size_t dark = 0, listed_dark = 0;
      for (const Piece& piece : plan->pieces) {
        EXPECT_EQ(piece.alternatives.size(), 3U) << piece.mark;
        const bool has_dark = is_dark(piece, *piece.placement);
        dark += has_dark ? 1 : 0;
        for (const Alternative& it : piece.alternatives) {
          EXPECT_TRUE(has_dark || !is_dark(piece, it.placement)) << piece.mark;
          listed_dark += is_dark(piece, it.placement) ? 1 : 0;
        }
      }
      EXPECT_GT(dark, 0U);
      EXPECT_GT(listed_dark, 0U) << "what is dark may lie elsewhere on dark wood";
      options_.threads = 1;
      EXPECT_EQ(plan_to_json(*planned()), plan_to_json(*plan));
    }
  }
}

TEST_F(WoodLimits, ThatLeaveRoomKeepNoPlaceFromBeingListed) {
  options_.alternatives = 3;
  const auto free = planned();
  options_.material_limits = {{"dark", 1}, {"pale", 1}};
  EXPECT_EQ(plan_to_json(*planned()), plan_to_json(*free));
}

// What a person moves goes there, whatever a limit says, but the plan says what came of it.
TEST_F(WoodLimits, AreNoBarToWhatAPersonMovesButAreTold) {
  options_.material_limits = {{"dark", 0.3}};
  const auto limited = planned();
  ASSERT_TRUE(limited.ok()) << limited.error().message;
  // The same, with places of all woods.
  options_.material_limits = {}, options_.alternatives = 3;
  ASSERT_TRUE(keep_edited(*limited, {}, options_).ok());
  auto listed = planned();
  ASSERT_TRUE(listed.ok()) << listed.error().message;
  std::vector<std::pair<std::string, std::size_t>> to_dark;
  std::string is_dark;  // a piece that is, as large as the others
  for (const Piece& piece : listed->pieces) {
    if (piece.placement->panel.value == "dark") is_dark = piece.mark;
    for (std::size_t i = 0; i < piece.alternatives.size() && piece.placement->panel.value == "pale"; ++i)
      if (piece.alternatives[i].placement.panel.value == "dark") {
        to_dark.emplace_back(piece.mark, i + 1);
        break;
      }
  }
  ASSERT_GE(to_dark.size(), 2U);
  options_.alternatives = 0;
  const auto edited = [&](const PlanEdits& edits, double share) {
    options_.material_limits = {{"dark", share}};
    const Status kept = keep_edited(*listed, edits, options_);
    EXPECT_TRUE(kept.ok()) << kept.error().message;
    return planned();
  };
  PlanEdits take, swap;
  take.takes = {to_dark[0]}, swap.swaps = {{is_dark, to_dark[0].first}};
  const auto one = edited(take, 0.3);
  ASSERT_TRUE(one.ok()) << one.error().message;
  EXPECT_GT(share_of(*one, "dark"), 0.3) << "it went there";
  const std::string because = "of the pictures, more than it may be (30 %), because ";
  EXPECT_THAT(said(*one), HasSubstr(because + to_dark[0].first + " was moved to such wood: give " + to_dark[0].first +
                                    " other wood, or raise the limit of dark (--material-limit)"));
  const auto by_swap = edited(swap, 0.3);
  ASSERT_TRUE(by_swap.ok()) << by_swap.error().message;
  EXPECT_EQ(said(*by_swap), "") << "one came for another";
  PlanEdits two;
  two.takes = {to_dark[0]}, two.swaps = {{is_dark, to_dark[1].first}};
  const auto both = edited(two, 0.3);
  ASSERT_TRUE(both.ok()) << both.error().message;
  EXPECT_THAT(said(*both), HasSubstr("were moved to such wood: give some of them other wood"));
  EXPECT_THAT(said(*both), HasSubstr(to_dark[0].first));
  EXPECT_THAT(said(*both), HasSubstr(to_dark[1].first));
  // Of a limit that was broken before, whoever was moved there is not the only one to go.
  const auto already = edited(take, 0.1);
  ASSERT_TRUE(already.ok()) << already.error().message;
  EXPECT_THAT(said(*already),
              HasSubstr("more than it may be (10 %), because pieces of dark stay, and " + to_dark[0].first +
                        " was moved to it as well: plan some of these anew, or "
                        "raise the limit of dark (--material-limit)"));
  const auto kept = edited({}, 0.1);
  ASSERT_TRUE(kept.ok()) << kept.error().message;
  EXPECT_THAT(said(*kept), HasSubstr("because pieces of dark stay: plan some of them anew, or raise the limit of "
                                     "dark (--material-limit)"));
  // One that had no wood came as well.
  std::ranges::find(listed->pieces, to_dark[0].first, &Piece::mark)->placement.reset();
  const auto first = edited(take, 0.3);
  ASSERT_TRUE(first.ok()) << first.error().message;
  EXPECT_THAT(said(*first), HasSubstr(because + to_dark[0].first + " was moved to such wood"));
}

// Not as text, in which the tenth of a row comes before the second.
TEST_F(WoodLimits, NamePiecesThatWereMovedInTheirOrder) {
  options_.patch = 2.4_mm, options_.material_limits = {{"dark", 0.3}};
  const auto limited = planned();
  ASSERT_TRUE(limited.ok()) << limited.error().message;
  std::vector<std::string> dark, pale;
  for (const Piece& piece : limited->pieces)
    (piece.placement->panel.value == "dark" ? dark : pale).push_back(piece.mark);
  ASSERT_GE(dark.size(), 2U);
  const auto later = std::ranges::adjacent_find(pale, std::ranges::greater());
  ASSERT_NE(later, pale.end());
  PlanEdits swap;
  swap.swaps = {{dark[0], *(later + 1)}, {dark[1], *later}};
  options_.material_limits = {{"dark", 0.1}};
  ASSERT_TRUE(keep_edited(*limited, swap, options_).ok());
  const auto swapped = planned();
  ASSERT_TRUE(swapped.ok()) << swapped.error().message;
  EXPECT_THAT(said(*swapped),
              HasSubstr("because pieces of dark stay, and " + *later + ", " + *(later + 1) + " were moved to it"));
}

// Two limits that bind, and wood under none: pieces of either have the other's wood closed to them, and of the third
// both. What is closed to some is open again to those that come after.
class WoodLimitsOfTwo : public WoodLimits {
 protected:
  WoodLimitsOfTwo() {
    StockPanel ash = test::wood_panel("ash", 90, 90, 50.8, 3);
    ash.picture.pixels.setTo(cv::Scalar::all(245)), ash.material = "ash";
    stock_.push_back(ash);
    options_.material_limits = {{"dark", 0.3}, {"pale", 0.3}}, options_.alternatives = 3;
  }

  // What pieces have, what of it they are offered more, and what else.
  static std::map<std::string, std::set<std::string>> offered(const Plan& plan) {
    std::map<std::string, std::set<std::string>> out;
    for (const Piece& piece : plan.pieces) {
      EXPECT_EQ(piece.alternatives.size(), 3U) << piece.mark;
      for (const Alternative& it : piece.alternatives)
        out[piece.placement->panel.value].insert(it.placement.panel.value);
    }
    return out;
  }
  // No place that is offered is another piece's; all lie upright, since nothing is turned.
  static void expect_free(const Plan& plan) {
    constexpr Millimetres kTouching(1e-6);
    for (const Piece& piece : plan.pieces)
      for (const Alternative& it : piece.alternatives) {
        const Box<PanelFrame> there = bounds(it.placement.panel_from_artwork * piece.artwork_outline);
        for (const Piece& other : plan.pieces) {
          if (other.mark == piece.mark || other.placement->panel != it.placement.panel) continue;
          const Box<PanelFrame> taken = bounds(other.panel_outline());
          EXPECT_TRUE(there.max.x <= taken.min.x + kTouching || taken.max.x <= there.min.x + kTouching ||
                      there.max.y <= taken.min.y + kTouching || taken.max.y <= there.min.y + kTouching)
              << piece.mark << " is offered wood of " << other.mark;
        }
      }
  }
};

TEST_F(WoodLimitsOfTwo, CloseToEachPieceTheWoodOfTheOther) {
  for (const Optimize how : {Optimize::kGreedy, Optimize::kGlobal}) {
    options_.optimize = how, options_.optimize_iterations = 2000, options_.threads = 2;
    const auto plan = planned();
    ASSERT_TRUE(plan.ok()) << plan.error().message;
    ASSERT_EQ(unfilled(*plan), 0U);
    ASSERT_TRUE(plan->material_shares[0].binds && plan->material_shares[1].binds);
    const auto offers = offered(*plan);
    ASSERT_EQ(offers.size(), 3U);
    EXPECT_TRUE(offers.at("dark").contains("dark") && !offers.at("dark").contains("pale"));
    EXPECT_TRUE(offers.at("pale").contains("pale") && !offers.at("pale").contains("dark"));
    EXPECT_EQ(offers.at("ash"), std::set<std::string>{"ash"});
    expect_free(*plan);
    options_.threads = 1;
    EXPECT_EQ(plan_to_json(*planned()), plan_to_json(*plan));
  }
}

// The wood of pieces that stay was gone before any of it was closed, and is not opened with it.
TEST_F(WoodLimitsOfTwo, CloseItToPiecesThatStayAndToThoseThatArePlannedAnew) {
  const auto before = planned();
  ASSERT_TRUE(before.ok()) << before.error().message;
  PlanEdits edits;
  for (std::size_t i = 0; i < before->pieces.size(); i += 3) edits.replanned.push_back(before->pieces[i].mark);
  ASSERT_TRUE(keep_edited(*before, edits, options_).ok());
  const auto plan = planned();
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  ASSERT_EQ(unfilled(*plan), 0U);
  const auto offers = offered(*plan);
  EXPECT_TRUE(offers.at("dark").contains("dark") && !offers.at("dark").contains("pale"));
  EXPECT_TRUE(offers.at("pale").contains("pale") && !offers.at("pale").contains("dark"));
  EXPECT_EQ(offers.at("ash"), std::set<std::string>{"ash"});
  expect_free(*plan);
}

TEST_F(WoodLimits, WhatIsNoneIsRefused) {
  options_.material_limits = {{"dark", 1.5}};
  EXPECT_THAT(planned().error().message, HasSubstr("the limit of dark must lie between 0 and 1"));
  options_.material_limits = {{"dark", 0.5}, {"dark", 0.2}};
  EXPECT_THAT(planned().error().message, HasSubstr("dark has two limits"));
  options_.material_limits.clear();
  for (int i = 0; i < 65; ++i) options_.material_limits.push_back({"wood " + std::to_string(i), 0.5});
  EXPECT_THAT(planned().error().message, HasSubstr("at most 64 materials can have limits"));
  options_.material_limits = {{"dark", 0.5}}, options_.adaptive_levels = 1;
  EXPECT_THAT(planned().error().message, HasSubstr("do not go with adaptive levels"));
  options_.adaptive_levels = 0, options_.refine = Refine::kDp;
  EXPECT_THAT(planned().error().message, HasSubstr("do not go with refined borders"));
  EXPECT_EQ(is_in_stock(stock_, "elm").error().message, "no panel is elm: choose from dark, pale");
  EXPECT_TRUE(is_in_stock(stock_, "pale").ok());
}

}  // namespace
}  // namespace veneer::planner
