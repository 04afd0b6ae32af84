#include "daemon/unit/setups.h"

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <set>

#include "base/polygon_ops.h"

namespace veneer::daemon {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

Ring<PanelFrame> square(double x, double y, double side) {
  return {point<PanelFrame>(x, y), point<PanelFrame>(x + side, y), point<PanelFrame>(x + side, y + side),
          point<PanelFrame>(x, y + side)};
}

Box<BedFrame> bed(double x0, double y0, double x1, double y1) {
  Box<BedFrame> b;
  b.add(point<BedFrame>(x0, y0));
  b.add(point<BedFrame>(x1, y1));
  return b;
}

SetupInput panel(double width, double height, int pieces_along, int pieces_up) {
  SetupInput in;
  in.panel = PanelId{"P-0007"};
  in.width = Millimetres(width), in.height = Millimetres(height);
  in.reach = bed(0, 0, 520, 380);
  in.view = bed(-40, -40, 560, 420);
  std::int64_t id = 0;
  for (int c = 0; c < pieces_along; ++c)
    for (int r = 0; r < pieces_up; ++r)
      in.pieces.push_back({PieceId{++id}, square(20 + c * (width - 54) / std::max(1, pieces_along - 1),
                                                 20 + r * (height - 54) / std::max(1, pieces_up - 1), 14)});
  return in;
}

// Tags all along both long edges.
void tag_edges(SetupInput& in, double pitch) {
  for (double x = 2; x + 12 < in.width.count(); x += pitch)
    for (const double y : {2.0, in.height.count() - 14}) in.fiducials.push_back(square(x, y, 12));
}

// What the header promises.
void expect_good(const SetupInput& in, const std::vector<PanelSetup>& setups) {
  std::set<PieceId> seen;
  std::set<std::size_t> gone;
  for (const auto& setup : setups) {
    EXPECT_EQ(setup.bed_from_panel.handedness(), Handedness::kImproper);
    EXPECT_FALSE(setup.pieces.empty());
    int usable = 0;
    for (std::size_t f = 0; f < in.fiducials.size(); ++f) {
      bool in_view = !gone.contains(f);
      for (const auto& p : setup.bed_from_panel* in.fiducials[f]) in_view = in_view && in.view.contains(p);
      usable += in_view ? 1 : 0;
    }
    EXPECT_GE(usable, 3);
    for (const PieceId id : setup.pieces) {
      EXPECT_TRUE(seen.insert(id).second) << "piece " << id.value << " twice";
      const auto& piece = in.pieces[static_cast<std::size_t>(id.value - 1)];
      for (const auto& p : setup.bed_from_panel* piece.outline) EXPECT_TRUE(in.reach.contains(p));
      for (std::size_t f = 0; f < in.fiducials.size(); ++f)
        if (overlaps(Region<PanelFrame>(in.fiducials[f]), Region<PanelFrame>(piece.outline))) gone.insert(f);
    }
  }
  EXPECT_EQ(seen.size(), in.pieces.size());
}

TEST(Setups, APanelThatFitsIsLaidOnceAndAnyWay) {
  const SetupInput in = panel(400, 300, 5, 4);
  const auto setups = plan_setups(in);
  ASSERT_TRUE(setups.ok());
  ASSERT_THAT(*setups, SizeIs(1));
  EXPECT_EQ(setups->front().how, "");
  EXPECT_THAT(setups->front().pieces, SizeIs(20));
}

TEST(Setups, APanelThatFitsOnlyAcrossIsLaidOnce) {
  const auto setups = plan_setups(panel(370, 500, 5, 4));
  ASSERT_TRUE(setups.ok());
  ASSERT_THAT(*setups, SizeIs(1));
  const auto corner = setups->front().bed_from_panel * point<PanelFrame>(370, 500);
  EXPECT_TRUE(bed(0, 0, 520, 380).contains(corner));
}

TEST(Setups, ALongPanelIsCutInTwoAndSaysWhichEndSticksOut) {
  SetupInput in = panel(800, 300, 12, 5);
  tag_edges(in, 90);
  const auto setups = plan_setups(in);
  ASSERT_TRUE(setups.ok()) << setups.error().message;
  ASSERT_THAT(*setups, SizeIs(2));
  expect_good(in, *setups);
  for (const auto& setup : *setups) EXPECT_THAT(setup.how, HasSubstr("sticking out"));
}

TEST(Setups, ATagThatAPieceTakesAlongNoLongerCounts) {
  SetupInput in = panel(800, 300, 12, 5);
  // Three tags in the middle can be seen from both ends, but the pieces over them are within reach of both.
  for (const double y : {20.0, 85.0, 150.0}) in.fiducials.push_back(square(393, y, 12));
  in.pieces.push_back({PieceId{61}, square(390, 15, 20)});
  const auto refused = plan_setups(in);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kRefused);
  EXPECT_THAT(refused.error().message, HasSubstr("P-0007"));
  in.pieces.pop_back();
  const auto setups = plan_setups(in);
  if (setups.ok()) expect_good(in, *setups);
}

TEST(Setups, WithoutThreeTagsNoLargePanelIsCut) {
  SetupInput in = panel(800, 300, 12, 5);
  in.fiducials = {square(2, 2, 12), square(786, 2, 12)};
  EXPECT_FALSE(plan_setups(in).ok());
}

TEST(Setups, APanelLargerBothWaysTakesAtLeastFour) {
  SetupInput in = panel(900, 620, 12, 9);
  for (double x = 2; x < 880; x += 85)
    for (double y = 2; y < 610; y += 85) in.fiducials.push_back(square(x, y, 10));
  const auto setups = plan_setups(in);
  ASSERT_TRUE(setups.ok()) << setups.error().message;
  EXPECT_GE(setups->size(), 4U);
  expect_good(in, *setups);
}

RC_GTEST_PROP(Setups, KeepTheirPromiseForAnyPanel, ()) {
  const int width = *rc::gen::inRange(200, 1000), height = *rc::gen::inRange(150, 700);
  const int columns = *rc::gen::inRange(1, 9), rows = *rc::gen::inRange(1, 7);
  SetupInput in = panel(width, height, columns, rows);
  tag_edges(in, *rc::gen::inRange(60, 200));
  const auto setups = plan_setups(in);
  if (!setups.ok()) return;
  if (setups->size() > 1 || !setups->front().how.empty())
    expect_good(in, *setups);
  else
    RC_ASSERT(setups->front().pieces.size() == in.pieces.size());
  RC_ASSERT(!::testing::Test::HasFailure());
}

}  // namespace
}  // namespace veneer::daemon
