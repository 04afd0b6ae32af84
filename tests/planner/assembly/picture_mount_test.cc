#include "planner/assembly/picture_mount.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace veneer::planner {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

PictureMount usual() {
  PictureMount mount;
  mount.width = Millimetres(189), mount.height = Millimetres(222);
  return mount;
}

struct Box {
  double left = 1e9, bottom = 1e9, right = -1e9, top = -1e9;
  double width() const { return right - left; }
  double height() const { return top - bottom; }
};
Box box_of(const DrawnPath& path) {
  Box box;
  for (const Point<BedFrame>& p : path.path) {
    box.left = std::min(box.left, p.x.count()), box.right = std::max(box.right, p.x.count());
    box.bottom = std::min(box.bottom, p.y.count()), box.top = std::max(box.top, p.y.count());
  }
  return box;
}
// What stays when the kerf is burnt away on both sides of the beam's path.
double wood_after(double path, const PictureMount& mount, double side) { return path + side * mount.kerf.count(); }

TEST(PictureMount, ThePictureLiesInTheTrayWithItsClearance) {
  const PictureMount mount = usual();
  const CutDrawing tray = draw_mount_part(mount, MountPart::kTray);
  ASSERT_EQ(tray.layers.size(), 1U);
  ASSERT_EQ(tray.layers[0].strokes.size(), 2U) << "the opening, then the outer edge";
  const Box opening = box_of(tray.layers[0].strokes[0]), outer = box_of(tray.layers[0].strokes[1]);
  EXPECT_NEAR(wood_after(opening.width(), mount, 1), 189 + 2 * 0.5, 1e-9);
  EXPECT_NEAR(wood_after(opening.height(), mount, 1), 222 + 2 * 0.5, 1e-9);
  EXPECT_NEAR(wood_after(outer.width(), mount, -1), 189 + 2 * 15.5, 1e-9);
  EXPECT_NEAR(opening.left - outer.left, outer.right - opening.right, 1e-9) << "it lies in the middle";
  EXPECT_GT(outer.left, mount.kerf.count() / 2) << "the kerf lies on the page";
  EXPECT_LT(outer.right, tray.width.count() - mount.kerf.count() / 2);
}

TEST(PictureMount, TheFrameCoversThePicturesEdgeAndAllPartsHaveOneOuterShape) {
  const PictureMount mount = usual();
  const Box back = box_of(draw_mount_part(mount, MountPart::kBack).layers[0].strokes.front());
  ASSERT_EQ(draw_mount_part(mount, MountPart::kBack).layers[0].strokes.size(), 1U) << "the back plate is whole";
  for (const MountPart part : {MountPart::kTray, MountPart::kFrame}) {
    const Box outer = box_of(draw_mount_part(mount, part).layers[0].strokes.back());
    EXPECT_NEAR(outer.width(), back.width(), 1e-9) << name_of(part);
    EXPECT_NEAR(outer.height(), back.height(), 1e-9) << name_of(part);
  }
  const Box opening = box_of(draw_mount_part(mount, MountPart::kFrame).layers[0].strokes.front());
  EXPECT_NEAR(wood_after(opening.width(), mount, 1), 189 - 2 * 2, 1e-9);
}

TEST(PictureMount, RoundCornersAreArcsOfTheirRadius) {
  PictureMount mount = usual();
  mount.corner = Millimetres(12), mount.kerf = Millimetres(0);
  const DrawnPath outer = draw_mount_part(mount, MountPart::kBack).layers[0].strokes.front();
  EXPECT_TRUE(outer.curved);
  const Box box = box_of(outer);
  for (const Point<BedFrame>& p : outer.path) {
    const double x = std::min(p.x.count() - box.left, box.right - p.x.count()),
                 y = std::min(p.y.count() - box.bottom, box.top - p.y.count());
    if (x < 12 && y < 12) {
      EXPECT_NEAR(std::hypot(12 - x, 12 - y), 12, 1e-9);
    }
  }
  EXPECT_TRUE(has_curves(outer.segments()));
  mount.corner = Millimetres(0);
  EXPECT_EQ(draw_mount_part(mount, MountPart::kBack).layers[0].strokes.front().path.size(), 4U);
}

TEST(PictureMount, WhatCouldNotHoldThePictureIsRefusedInWords) {
  const auto refused = [](auto change) {
    PictureMount mount = usual();
    change(mount);
    const Status status = check_mount(mount);
    return status.ok() ? std::string("accepted") : status.error().message;
  };
  EXPECT_TRUE(check_mount(usual()).ok());
  EXPECT_THAT(refused([](auto& m) { m.rail = Millimetres(1); }), HasSubstr("rail of 1 mm would not hold"));
  EXPECT_THAT(refused([](auto& m) { m.lip = Millimetres(95); }), HasSubstr("give 0 to 92.0 mm"));
  EXPECT_THAT(refused([](auto& m) { m.lip = m.clearance; }),
              AllOf(HasSubstr("lip of 0.5 mm"), HasSubstr("clearance of 0.5 mm")));
  EXPECT_THAT(refused([](auto& m) { m.corner = Millimetres(16); }), HasSubstr("cut into the tray's rail"));
  EXPECT_THAT(refused([](auto& m) { m.clearance = Millimetres(-0.1); }), HasSubstr("give 0 to 5 mm"));
  EXPECT_THAT(refused([](auto& m) { m.kerf = Millimetres(std::numeric_limits<double>::quiet_NaN()); }),
              HasSubstr("kerf"));
  EXPECT_THAT(refused([](auto& m) { m.width = Millimetres(0); }), HasSubstr("has no size"));
}

}  // namespace
}  // namespace veneer::planner
