// Tags that have moved, are new, or measure otherwise than they should.
#include <gmock/gmock.h>

#include "tests/calib/scanned_panel.h"

namespace veneer {
namespace {

using calib::PanelFiducials;
using calib::Registration;
using calib::RegistrationOptions;
using calib::TileView;
using scanned::Cell;
using scanned::plain_cell;
using scanned::plain_fiducials;
using scanned::plain_later;
using scanned::plain_show;

// The scan with one of its tags elsewhere by so much, as if it had come loose.
TileView with_moved_tag(TileView view, std::size_t which, double dx_mm, double dy_mm) {
  for (auto& corner : view.tags[which].corners) {
    corner.x += Pixels(dx_mm * view.nominal.px_per_mm);
    corner.y += Pixels(dy_mm * view.nominal.px_per_mm);
  }
  return view;
}

double most_apart(const Registration& a, const Registration& b) {
  double worst = 0;
  for (const auto& p : {point<ScanFrame>(0, 0), point<ScanFrame>(1000, 0), point<ScanFrame>(0, 800)})
    worst = std::max(worst, distance(a.tiles[0] * p, b.tiles[0] * p).count());
  return worst;
}

TEST(Registration, LeavesOutATagThatHasMovedSinceItWasFrozen) {
  const Cell& cell = plain_cell();
  const PanelFiducials known = plain_fiducials();
  const TileView& view = plain_later();
  const TileView sound[] = {view};
  const auto untouched = register_scan(sound, Face::kShow, known, cell.model);
  ASSERT_TRUE(untouched.ok()) << untouched.error().message;
  EXPECT_TRUE(untouched->moved.empty());
  // Leave-one-out residuals of everything that was seen before.
  EXPECT_EQ(untouched->left_out.size(), 9U);
  for (const auto& fiducial : untouched->left_out) EXPECT_LT(fiducial.off.count(), 0.03) << name_of(fiducial);
  for (const double by : {0.15, -0.4, 2.5}) {
    for (std::size_t which = 0; which < view.tags.size(); ++which) {
      const TileView later[] = {with_moved_tag(view, which, by, 0.3 * by)};
      const auto found = register_scan(later, Face::kShow, known, cell.model);
      ASSERT_TRUE(found.ok()) << found.error().message;
      ASSERT_EQ(found->moved.size(), 1U);
      EXPECT_EQ(found->moved[0].tag, view.tags[which].id);
      EXPECT_EQ(name_of(found->moved[0]), "tag " + std::to_string(view.tags[which].id));
      EXPECT_NEAR(found->moved[0].off.count(), std::abs(by) * 1.044, 0.03);
      EXPECT_LT(most_apart(*untouched, *found), 0.02);
      EXPECT_EQ(found->fiducials.tags[0].corners, known.tags[0].corners);  // nothing is frozen anew unasked
    }
  }
}

// What a panel's map shows at each of its tags and holes.
TEST(Registration, TellsOfEachFiducialHowFarItLies) {
  const Cell& cell = plain_cell();
  const TileView& view = plain_later();
  const TileView later[] = {with_moved_tag(view, 2, 0.3, 0)};
  const auto found = register_scan(later, Face::kShow, plain_fiducials(), cell.model);
  ASSERT_TRUE(found.ok()) << found.error().message;
  ASSERT_EQ(found->agreement.size(), 1U);
  const auto& offsets = found->agreement[0].offsets;
  EXPECT_EQ(offsets.size(), 9U) << "five tags and four holes";
  for (const auto& one : offsets) {
    if (one.tag == view.tags[2].id) {
      EXPECT_NEAR(one.off.count(), 0.3, 0.03);
    } else {
      EXPECT_LT(one.off.count(), 0.03) << name_of(one);
    }
  }
}

TEST(Registration, TakesNewTagsWhenToldToAndTiesThemToThoseThatStayed) {
  const Cell& cell = plain_cell();
  const PanelFiducials known = plain_fiducials();
  TileView view = with_moved_tag(plain_later(), 1, 4, -2);
  view.tags[2].id = 400;  // where another one had been
  const TileView later[] = {view};
  const auto unasked = register_scan(later, Face::kShow, known, cell.model);
  ASSERT_FALSE(unasked.ok());
  EXPECT_THAT(unasked.error().message, ::testing::HasSubstr("--retag"));
  RegistrationOptions options;
  options.retag = true;
  const auto found = register_scan(later, Face::kShow, known, cell.model, options);
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_THAT(found->new_tags, ::testing::ElementsAre(400));
  ASSERT_NE(found->fiducials.tag(400), nullptr);
  EXPECT_EQ(found->fiducials.tag(view.tags[1].id)->corners, known.tag(view.tags[1].id)->corners);
  const auto again = register_scan(later, Face::kShow, found->fiducials, cell.model);
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->moved.size(), 1U);
  EXPECT_EQ(again->left_out.size(), found->left_out.size() + 1);
  EXPECT_LT(most_apart(*found, *again), 0.01);
  // Nobody can tie new tags to fewer than three old fiducials.
  TileView bare = view;
  bare.holes.clear();
  bare.tags = {view.tags[0], view.tags[2], view.tags[3]};
  const TileView two_old[] = {bare};
  const auto refused = register_scan(two_old, Face::kShow, known, cell.model, options);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr("three are needed to tie new tags to"));
}

// Each tile is fitted alone: what it shows of the panel has to prove where it lies, whatever other tiles show.
TEST(Registration, SaysWhereNobodyCanTellWhetherATagMoved) {
  const Cell& cell = plain_cell();
  const PanelFiducials known = plain_fiducials();
  const TileView& whole = plain_later();
  TileView part = whole;
  part.name = "tile 2";
  part.holes.clear();
  part.tags = {whole.tags[0], whole.tags[3]};
  const TileView tiles[] = {whole, part};
  const auto found = register_scan(tiles, Face::kShow, known, cell.model);
  ASSERT_TRUE(found.ok()) << found.error().message;
  ASSERT_EQ(found->agreement.size(), 2U);
  EXPECT_EQ(found->agreement[0].fiducials, 9U);
  EXPECT_TRUE(found->agreement[0].within(Millimetres(0.05)));
  EXPECT_EQ(found->agreement[1].fiducials, 2U);
  EXPECT_FALSE(found->agreement[1].worst) << "two tags agree with anything";
  EXPECT_EQ(found->left_out.size(), 9U);
  // A new tag beside them would be frozen wherever they put it.
  TileView beside = part;
  beside.tags.push_back(whole.tags[2]);
  beside.tags.back().id = 400;
  TileView without = whole;
  std::erase_if(without.tags, [&](const auto& tag) { return tag.id == whole.tags[2].id; });
  RegistrationOptions options;
  options.retag = true;
  const TileView glued[] = {without, beside};
  const auto refused = register_scan(glued, Face::kShow, known, cell.model, options);
  ASSERT_FALSE(refused.ok()) << "the other tile's nine prove nothing here";
  EXPECT_THAT(refused.error().message, ::testing::AllOf(::testing::HasSubstr("tile 2"),
                                                        ::testing::HasSubstr("three are needed to tie new tags")));
}

// A scanner that warmed up runs a little longer than it was calibrated: no tag has moved, and none may be blamed.
TEST(Registration, BlamesNoTagForAScannerThatRunsOtherwise) {
  const Cell& cell = plain_cell();
  const PanelFiducials known = plain_fiducials();
  const TileView& view = plain_later();
  for (const double drift : {0.0005, 0.001, 0.002}) {
    TileView longer = view;
    for (auto& tag : longer.tags)
      for (auto& corner : tag.corners) corner.y = corner.y * (1 + drift);
    for (auto& hole : longer.holes) hole.centre.y = hole.centre.y * (1 + drift);
    const auto found = register_scan(std::span(&longer, 1), Face::kShow, known, cell.model);
    if (found.ok()) {
      EXPECT_TRUE(found->moved.empty()) << drift;
      continue;
    }
    EXPECT_THAT(found.error().message, ::testing::HasSubstr("calibrate the scanner")) << drift;
  }
}

TEST(Registration, RefusesAndDoesNotRetagWhereThreeDisagree) {
  const Cell& cell = plain_cell();
  const PanelFiducials known = plain_fiducials();
  TileView three = plain_later();
  three.holes.clear();
  const auto fourth = three.tags[3];
  three.tags.resize(3);
  const auto moved_by = [&](double mm) {
    TileView view = with_moved_tag(three, 1, mm, 0);
    view.tags.push_back(fourth);
    view.tags.back().id = 400;
    return view;
  };
  RegistrationOptions retag;
  retag.retag = true;
  TileView a_little = moved_by(0.09);
  const TileView little[] = {a_little};
  const auto not_tied = register_scan(little, Face::kShow, known, cell.model, retag);
  ASSERT_FALSE(not_tied.ok());
  EXPECT_THAT(not_tied.error().message, ::testing::HasSubstr("new tags are tied to such as agree"));
  a_little.tags.pop_back();
  const TileView shown[] = {a_little};
  const auto told = register_scan(shown, Face::kShow, known, cell.model);
  ASSERT_TRUE(told.ok()) << told.error().message;
  ASSERT_TRUE(told->agreement[0].worst);
  EXPECT_GT(told->agreement[0].worst->count(), 0.05);
  TileView much = with_moved_tag(three, 1, 0.25, 0);
  const TileView far[] = {much};
  const auto refused = register_scan(far, Face::kShow, known, cell.model);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr("too few are seen to tell which one has moved"));
}

TileView with_spoiled_tag(TileView view, std::size_t which) {
  auto& corners = view.tags.at(which).corners;
  const Point<ScanFrame> centre = view.tags[which].centre;
  for (auto& corner : corners)
    corner = {centre.x + (corner.x - centre.x) * 1.012, centre.y + (corner.y - centre.y) * 1.012};
  return view;
}

// A stain on its rim: the others are as good as before.
TEST(Registration, ATagThatMeasuresOtherwiseThanItsNeighboursIsLeftOutAndNamed) {
  const Cell& cell = plain_cell();
  const TileView spoiled = with_spoiled_tag(plain_show(), 1);
  const int id = spoiled.tags[1].id;
  const auto has = [&](const PanelFiducials& fiducials) {
    return std::ranges::any_of(fiducials.tags, [&](const auto& tag) { return tag.id == id; });
  };
  const auto first = register_first_scan(std::span(&spoiled, 1), cell.model);
  ASSERT_TRUE(first.ok()) << first.error().message;
  ASSERT_EQ(first->spoiled.size(), 1U);
  EXPECT_EQ(first->spoiled[0].tag.id, id);
  EXPECT_NEAR(first->spoiled[0].side.count(), 14 * 1.012, 0.01);
  EXPECT_FALSE(has(first->fiducials));
  const auto whole = register_first_scan(std::span(&plain_show(), 1), cell.model);
  ASSERT_TRUE(whole.ok());
  const auto* there = whole->fiducials.tag(id);
  ASSERT_NE(there, nullptr);
  EXPECT_LT(distance(first->spoiled[0].tag.corners[0], there->corners[0]).count(), 0.2) << "no wood";

  ASSERT_TRUE(has(plain_fiducials()));
  const auto later = register_scan(std::span(&spoiled, 1), Face::kShow, plain_fiducials(), cell.model);
  ASSERT_TRUE(later.ok()) << later.error().message;
  ASSERT_EQ(later->spoiled.size(), 1U);
  EXPECT_TRUE(has(later->fiducials)) << "it stays the panel's";
  EXPECT_LT(later->max->count(), 0.02);

  TileView three = plain_show();
  three.tags.resize(3);
  const TileView too_few = with_spoiled_tag(three, 2);
  const auto refused = register_first_scan(std::span(&too_few, 1), cell.model);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr("without it 2 of at least 3 tags are left"));
}

}  // namespace
}  // namespace veneer
