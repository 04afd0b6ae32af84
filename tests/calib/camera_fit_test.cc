// The camera is calibrated on pictures of a sheet whose places it does not know, and must then tell true millimetres
// anywhere on the bed, at any height, up to the one isometry nothing in those pictures can show.
#include "calib/camera_fit.h"

#include <gtest/gtest.h>

#include <iostream>
#include <random>

#include "calib/point_fit.h"
#include "tests/support/rendered_bed.h"

namespace veneer::calib {
namespace {

struct SheetPlace {
  test::Lay lay;
  double height;
};
const std::vector<SheetPlace> kPlaces = {{{20, 25, 3, false}, 0},   {{215, 130, -4, false}, 0},
                                         {{25, 140, 8, false}, 12}, {{240, 15, -2, false}, 12},
                                         {{390, 60, 92, false}, 0}, {{130, 80, 20, false}, 12}};

test::TrueCamera full_camera() {
  test::TrueCamera camera;
  camera.width = 4000, camera.height = 3000;
  camera.focal = 3120, camera.cx = 2022.6, camera.cy = 1485.6;
  return camera;
}

// Tag corners as a detector would report them, without drawing a picture.
GridView seen_view(const test::TrueCamera& camera, const SheetPlace& place, double noise_px, std::mt19937_64& random) {
  std::normal_distribution<double> noise(0, noise_px);
  GridView view{Millimetres(place.height), {}};
  const AprilGrid grid;
  for (int id = 0; id < grid.tags(); ++id) {
    Tag<CameraFrame> tag;
    tag.id = id;
    bool inside = true;
    const auto nominal = grid.corners(id);
    for (std::size_t i = 0; i < 4; ++i) {
      const auto bed = place.lay.bed_of(nominal[i].x.count(), nominal[i].y.count());
      const auto px = camera.pixel_of(bed[0], bed[1], place.height);
      inside = inside && px[0] > 5 && px[1] > 5 && px[0] < camera.width - 5 && px[1] < camera.height - 5;
      const double right = noise(random), down = noise(random);
      tag.corners[i] = point<CameraFrame>(px[0] + right, px[1] + down);
    }
    if (inside) view.tags.push_back(tag);
  }
  return view;
}

std::vector<GridView> seen_views(const test::TrueCamera& camera, const std::vector<SheetPlace>& places, double noise_px,
                                 std::uint64_t seed = 7) {
  std::mt19937_64 random(seed);
  std::vector<GridView> views;
  for (const auto& place : places) views.push_back(seen_view(camera, place, noise_px, random));
  return views;
}

// Over a 10 mm grid of the bed, after the best isometry found at height 0: true place against the model's.
FitResidual bed_error(const test::TrueCamera& truth, const CameraModel& model, double height) {
  const auto places = [&](double z, std::vector<Point<BedFrame>>& measured, std::vector<Point<MachineFrame>>& real) {
    for (double y = 0; y <= 380; y += 10) {
      for (double x = 0; x <= 520; x += 10) {
        const auto px = truth.pixel_of(x, y, z);
        measured.push_back(model.bed_from_camera(point<CameraFrame>(px[0], px[1]), Millimetres(z)));
        real.push_back(point<MachineFrame>(x, y));
      }
    }
  };
  std::vector<Point<BedFrame>> flat, high;
  std::vector<Point<MachineFrame>> flat_true, high_true;
  places(0, flat, flat_true);
  places(height, high, high_true);
  const auto tie = fit_isometry<BedFrame, MachineFrame>(flat, flat_true);
  return residual_of(tie, std::span<const Point<BedFrame>>(high), std::span<const Point<MachineFrame>>(high_true));
}

TEST(CameraModel, GoesThereAndBackAtAnyHeight) {
  CameraParameters p;
  p.width_px = 4000, p.height_px = 3000;
  p.fx = 3100, p.fy = 3103, p.cx = 2010, p.cy = 1490;
  p.k1 = -0.11, p.k2 = 0.03, p.p1 = 0.0005, p.p2 = -0.0004, p.k3 = -0.002;
  p.camera_from_bed_rotation = {3.1, 0.1, -0.05}, p.camera_from_bed_translation = {-250, 190, 480};
  const CameraModel model(p);
  for (const double height : {0.0, 2.1, 12.0}) {
    for (double x = 0; x <= 520; x += 65) {
      const auto place = point<BedFrame>(x, 380 - x * 0.7);
      const auto back = model.bed_from_camera(model.camera_from_bed(place, Millimetres(height)), Millimetres(height));
      EXPECT_LT(distance(place, back).count(), 1e-7);
    }
  }
}

TEST(CameraModel, KeepsSeeingTheSameAfterItsBedFrameIsMoved) {
  CameraParameters p;
  p.width_px = 4000, p.height_px = 3000;
  p.fx = p.fy = 3100, p.cx = 2000, p.cy = 1500, p.k1 = -0.1;
  p.camera_from_bed_rotation = {3.1, 0.1, -0.05}, p.camera_from_bed_translation = {-250, 190, 480};
  const CameraModel model(p);
  const Isometry2<BedFrame, BedFrame> new_from_old(degrees(17), point<BedFrame>(31, -12));
  const CameraModel moved = model.re_anchored(new_from_old);
  const auto place = point<BedFrame>(123, 45);
  EXPECT_LT(distance(moved.camera_from_bed(new_from_old * place, Millimetres(2.1)),
                     model.camera_from_bed(place, Millimetres(2.1)))
                .count(),
            1e-8);
}

TEST(CameraFit, TellsTrueMillimetresOverTheWholeBedAtEveryHeight) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const auto camera = full_camera();
    const auto fit = fit_camera_model(seen_views(camera, kPlaces, 0.08, seed), camera.width, camera.height);
    ASSERT_TRUE(fit.ok()) << fit.error().message;
    EXPECT_NEAR(fit->rms_px, 0.08 * std::sqrt(2.0), 0.01);
    for (const double height : {0.0, 2.1, 12.0}) {
      const auto error = bed_error(camera, fit->model, height);
      EXPECT_LT(error.rms, height < 3 ? 0.005 : 0.02) << "height " << height;
      EXPECT_LT(error.max, 0.030) << "height " << height;
      std::cout << "corner noise 0.08 px, height " << height << ": rms " << error.rms << " max " << error.max
                << " mm, predicted sigma " << fit->predicted_sigma.count() << ", leave-out "
                << fit->leave_out_rms.count() << "\n";
    }
    EXPECT_LT(fit->leave_out_rms.count(), 0.03);
    EXPECT_LT(fit->predicted_sigma.count(), 0.02);
    EXPECT_GT(fit->predicted_sigma.count(), 0.001);
  }
}

TEST(CameraFit, PutsTheMiddleOfThePictureInTheMiddleOfTheProvisionalBed) {
  const auto camera = full_camera();
  const auto fit = fit_camera_model(seen_views(camera, kPlaces, 0.05), camera.width, camera.height);
  ASSERT_TRUE(fit.ok()) << fit.error().message;
  const auto middle = fit->model.bed_from_camera(point<CameraFrame>(2000, 1500), Millimetres(0));
  EXPECT_NEAR(middle.x.count(), 260, 1e-6);
  EXPECT_NEAR(middle.y.count(), 190, 1e-6);
  const auto right = fit->model.bed_from_camera(point<CameraFrame>(3000, 1500), Millimetres(0));
  EXPECT_GT(right.x.count(), 300);
}

TEST(CameraFit, WorksForALongLensAndALevelCamera) {
  auto camera = full_camera();
  camera.focal = 5600, camera.eye_z = 850, camera.eye_x = 262, camera.eye_y = 188;
  camera.tilt_deg = 0.4, camera.lean_deg = -0.3, camera.lens = {-0.04, 0.01, 0, 0, 0};
  const auto fit = fit_camera_model(seen_views(camera, kPlaces, 0.08), camera.width, camera.height);
  ASSERT_TRUE(fit.ok()) << fit.error().message;
  EXPECT_LT(bed_error(camera, fit->model, 0).rms, 0.02);
  EXPECT_LT(bed_error(camera, fit->model, 2.1).rms, 0.02);
}

TEST(CameraFit, DropsACornerThatWasReadWrong) {
  const auto camera = full_camera();
  auto views = seen_views(camera, kPlaces, 0.08);
  views[1].tags[10].corners[2].x += Pixels(6);
  const auto fit = fit_camera_model(views, camera.width, camera.height);
  ASSERT_TRUE(fit.ok()) << fit.error().message;
  EXPECT_EQ(fit->dropped, 1);
  EXPECT_LT(bed_error(camera, fit->model, 0).rms, 0.010);
}

TEST(CameraFit, RefusesASheetAtAnotherHeightThanEntered) {
  const auto camera = full_camera();
  auto views = seen_views(camera, kPlaces, 0.08);
  views[3].height = Millimetres(0);
  const auto fit = fit_camera_model(views, camera.width, camera.height);
  ASSERT_FALSE(fit.ok());
  EXPECT_EQ(fit.error().code, ErrorCode::kRefused);
  EXPECT_NE(fit.error().message.find("height"), std::string::npos) << fit.error().message;
}

TEST(CameraFit, AsksForMoreWhenThereAreTooFewPicturesOrTagsOrHeights) {
  const auto camera = full_camera();
  const auto views = seen_views(camera, kPlaces, 0.08);
  const auto few = fit_camera_model(std::span(views).first(3), camera.width, camera.height);
  ASSERT_FALSE(few.ok());
  EXPECT_EQ(few.error().code, ErrorCode::kInvalidArgument);

  auto bare = views;
  bare[2].tags.resize(5);
  const auto hidden = fit_camera_model(bare, camera.width, camera.height);
  ASSERT_FALSE(hidden.ok());
  EXPECT_NE(hidden.error().message.find("picture 3"), std::string::npos) << hidden.error().message;

  auto level = views;
  for (auto& view : level) view.height = Millimetres(0);
  const auto flat = fit_camera_model(level, camera.width, camera.height);
  ASSERT_FALSE(flat.ok());
  EXPECT_NE(flat.error().message.find("height"), std::string::npos) << flat.error().message;
}

// Rendered pictures, through the detector: lens, tilt, blur, noise and all.
TEST(CameraFit, HoldsItsAccuracyOnRenderedPictures) {
  const test::TrueCamera camera;  // 2000 x 1500: twice as coarse as the cell's
  std::vector<GridView> views;
  for (std::size_t i = 0; i < 5; ++i) {
    const cv::Mat picture =
        test::photograph(camera, {{kPlaces[i].lay, kPlaces[i].height, test::april_grid_shade}}, {.seed = 11 + i});
    views.push_back(grid_view(picture, Millimetres(kPlaces[i].height)));
    EXPECT_GE(views.back().tags.size(), 90U);
  }
  const auto fit = fit_camera_model(views, camera.width, camera.height);
  ASSERT_TRUE(fit.ok()) << fit.error().message;
  std::cout << "rendered 3 MP: " << fit->rms_px << " px rms, " << fit->rms.count() << " mm rms, leave-out "
            << fit->leave_out_rms.count() << " mm, predicted sigma " << fit->predicted_sigma.count() << "\n";
  for (const double height : {0.0, 2.1, 12.0}) {
    const auto error = bed_error(camera, fit->model, height);
    EXPECT_LT(error.rms, 0.05) << "height " << height;
    std::cout << "rendered 3 MP, height " << height << ": rms " << error.rms << " max " << error.max << " mm\n";
  }
}

}  // namespace
}  // namespace veneer::calib
