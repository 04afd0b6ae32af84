#include "calib/part_relation.h"

#include <gmock/gmock.h>

#include <random>
#include <utility>
#include <vector>

namespace veneer::calib {
namespace {

using ::testing::HasSubstr;
using Map = Isometry2<PanelFrame, PanelFrame>;

PanelTag tag(int id, double x, double y, double side = 14) {
  PanelTag out;
  out.id = id;
  out.corners = {point<PanelFrame>(x, y), point<PanelFrame>(x + side, y), point<PanelFrame>(x + side, y + side),
                 point<PanelFrame>(x, y + side)};
  return out;
}

// A sheet of 400 x 280 mm whose tags and holes lie without symmetry.
PanelFiducials whole() {
  PanelFiducials out;
  out.tags = {tag(1, 5, 5), tag(2, 380, 6), tag(3, 200, 130), tag(4, 8, 260), tag(5, 370, 255), tag(6, 30, 140)};
  for (const auto& [x, y] : {std::pair{20.0, 60.0}, {40.0, 220.0}, {150.0, 25.0}, {180.0, 250.0}, {300.0, 90.0}})
    out.holes.push_back({point<PanelFrame>(x, y)});
  return out;
}

const Map kPartFromParent(Radians(0.7), point<PanelFrame>(120, -35));
const Box<PanelFrame> kSheet{point<PanelFrame>(0, 0), point<PanelFrame>(200, 280)};

// What is left on a part, each place seen wrong by up to `noise`.
PanelFiducials on_part(const std::vector<int>& tags, const std::vector<int>& holes, double noise = 0) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> off(-noise, noise);
  const auto seen = [&](const Point<PanelFrame>& p) {
    const auto place = kPartFromParent * p;
    const double x = place.x.count() + off(random), y = place.y.count() + off(random);
    return point<PanelFrame>(x, y);
  };
  const PanelFiducials all = whole();
  PanelFiducials out;
  for (const int id : tags) {
    PanelTag kept = *all.tag(id);
    for (auto& corner : kept.corners) corner = seen(corner);
    out.tags.push_back(kept);
  }
  for (const int index : holes) out.holes.push_back({seen(all.holes.at(static_cast<std::size_t>(index)).centre)});
  return out;
}

void expect_same(const Map& found) {
  for (const auto& p : {point<PanelFrame>(0, 0), point<PanelFrame>(200, 280)})
    EXPECT_LT(distance(found * p, kPartFromParent * p).count(), 0.05);
}

TEST(PartRelation, IsMeasuredOnTagsAndHolesThatWereKept) {
  PanelFiducials part = on_part({1, 4, 6}, {0, 1}, 0.02);
  part.tags.push_back(tag(40, 90, 90));  // new ones say nothing of the parent
  part.holes.push_back({point<PanelFrame>(77, 11)});
  const auto related = relate_part(part, whole(), kSheet);
  ASSERT_TRUE(related.ok()) << related.error().message;
  EXPECT_EQ(related->fiducials, 5);
  EXPECT_LT(related->rms.count(), 0.03);
  EXPECT_EQ(related->part_from_parent.handedness(), Handedness::kProper);
  expect_same(related->part_from_parent);
}

TEST(PartRelation, ThreeHolesAreEnoughWhereAllTagsAreNew) {
  PanelFiducials part = on_part({}, {0, 1, 2, 3}, 0.02);
  part.tags = {tag(40, 10, 10), tag(41, 150, 20), tag(42, 60, 200)};
  const auto related = relate_part(part, whole(), kSheet);
  ASSERT_TRUE(related.ok()) << related.error().message;
  EXPECT_EQ(related->fiducials, 4);
  expect_same(related->part_from_parent);
}

TEST(PartRelation, WhatIsTooLittleIsRefusedWithWhatToDo) {
  const auto refusal = [](const PanelFiducials& part) {
    const auto related = relate_part(part, whole(), kSheet);
    EXPECT_FALSE(related.ok());
    return related.ok() ? "" : related.error().message;
  };
  PanelFiducials strange;
  strange.tags = {tag(40, 10, 10), tag(41, 150, 20), tag(42, 60, 200)};
  EXPECT_THAT(refusal(strange), HasSubstr("shares no tag with the panel"));
  strange.holes = on_part({}, {0, 1}).holes;
  EXPECT_THAT(refusal(strange), HasSubstr("nor three holes"));
  EXPECT_THAT(refusal(on_part({4}, {})), HasSubstr("carries tag 4 only"));
  EXPECT_THAT(refusal(on_part({4}, {1}, 0.01)), HasSubstr("lie so close together"));
  PanelFiducials moved = on_part({1, 4, 6}, {});
  for (auto& corner : moved.tags[1].corners) corner.x += Millimetres(0.5);
  EXPECT_THAT(refusal(moved), HasSubstr("mm from where it lay"));
}

// Of the same number, on the other face: it says nothing.
TEST(PartRelation, BackTagsDoNotCount) {
  PanelFiducials part = on_part({1, 4}, {});
  PanelFiducials parent = whole();
  for (auto& known : parent.tags) known.face = Face::kBack;
  EXPECT_FALSE(relate_part(part, parent, kSheet).ok());
}

}  // namespace
}  // namespace veneer::calib
