#include "drivers/sim/camera.h"

#include <gmock/gmock.h>

#include "base/units.h"
#include "tests/drivers/sim_sheets.h"

namespace veneer::sim {
namespace {

CellTruth cell(std::uint64_t seed, int width = 4000, int height = 3000) {
  TwinSettings settings;
  settings.seed = seed;
  settings.camera.width_px = width, settings.camera.height_px = height;
  settings.camera.noise = 0, settings.camera.uneven_light = 0;
  return draw_cell_truth(settings);
}

TEST(Camera, SeesTheWholeBedWithAMarginAtEverySeed) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const CellTruth truth = cell(seed);
    for (const Vec2 corner : {Vec2{0, 0}, Vec2{520, 0}, Vec2{0, 380}, Vec2{520, 380}}) {
      const Vec2 p = truth.camera.pixel(corner, 2.1);
      EXPECT_TRUE(p.x > 20 && p.y > 20 && p.x < 3980 && p.y < 2980) << seed << ": " << p.x << " " << p.y;
    }
    // Bed +x runs to the right of the picture, +y upwards.
    EXPECT_GT(truth.camera.pixel({400, 190}, 0).x, truth.camera.pixel({100, 190}, 0).x);
    EXPECT_LT(truth.camera.pixel({260, 300}, 0).y, truth.camera.pixel({260, 80}, 0).y);
  }
}

TEST(Camera, InvertsItsOwnLens) {
  const CameraTruth camera = cell(4).camera;
  for (double x = 0; x <= 520; x += 65) {
    for (double y = 0; y <= 380; y += 38) {
      const Vec2 back = camera.bed_at(camera.pixel({x, y}, 12), 12);
      EXPECT_NEAR(back.x, x, 1e-7);
      EXPECT_NEAR(back.y, y, 1e-7);
    }
  }
}

TEST(Camera, ShowsMarksOfTheUpperFaceAtTheirHeight) {
  const std::vector<Vec2> dots = {{10, 12}, {80, 15}, {75, 50}, {20, 45}};
  const CellTruth truth = cell(9, 2000, 1500);
  const BedCamera camera(truth.camera, truth.settings.bed);
  for (const SheetFace up : {SheetFace::kBack, SheetFace::kShow}) {
    const auto sheet = dotted_sheet(90, 65, up == SheetFace::kShow ? dots : std::vector<Vec2>{},
                                    up == SheetFace::kBack ? dots : std::vector<Vec2>{}, 14);
    for (const double height : {2.1, 14.1}) {
      BedView view{sheet.get(), up, {degrees(3).count(), up == SheetFace::kBack, {300, 150}}, height};
      const cv::Mat picture = camera.picture(view, 1);
      for (const Vec2& dot : dots) {
        const Vec2 expected = truth.camera.pixel(view.bed_from_sheet.place(dot), height);
        // A perspective picture of a round dot has its centre of mass a little off; 0.06 px is 18 um on the bed.
        const Vec2 found = dark_centre(picture, expected, 9, 190);
        EXPECT_NEAR(found.x, expected.x, 0.06);
        EXPECT_NEAR(found.y, expected.y, 0.06);
      }
    }
  }
}

TEST(Camera, TakesTheSamePictureFromTheSameSeed) {
  const CellTruth truth = cell(9, 800, 600);
  CameraTruth noisy = truth.camera;
  noisy.noise = 2;
  const BedCamera camera(noisy, truth.settings.bed);
  const cv::Mat one = camera.picture({}, 1), same = camera.picture({}, 1);
  EXPECT_EQ(cv::norm(one, same, cv::NORM_INF), 0);
  EXPECT_GT(cv::norm(one, camera.picture({}, 2), cv::NORM_INF), 3);
}

}  // namespace
}  // namespace veneer::sim
