// The laser burns a lattice of rings; where it lies under the camera nobody knows. From one picture the machine's true
// scale and skew must follow, and the bed frame's origin.
#include "calib/machine_axes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <utility>

#include "calib/burnt_pattern.h"
#include "calib/point_fit.h"
#include "tests/support/exact_camera.h"
#include "tests/support/rendered_bed.h"

namespace veneer::calib {
namespace {

// 12 x 8 rings, 40 mm apart, with three large ones at the keys' places.
constexpr int kColumns = 12, kRows = 8;
constexpr double kPitch = 40, kFirstX = 36, kFirstY = 44;

bool is_key(int column, int row) {
  return (row == 0 && (column == 0 || column == kColumns - 1)) || (row == kRows - 1 && column == 1);
}

std::vector<PatternRing> pattern() {
  std::vector<PatternRing> out;
  for (int r = 0; r < kRows; ++r)
    for (int c = 0; c < kColumns; ++c)
      out.push_back(
          {point<MachineFrame>(kFirstX + c * kPitch, kFirstY + r * kPitch), Millimetres(is_key(c, r) ? 8 : 4)});
  return out;
}

// What the axes truly do, in the renderer's millimetres: scale, skew, and where the machine stands in that world.
struct TrueAxes {
  double scale_x = 1.0017, scale_y = 0.9986, skew = 0.0009;
  test::Lay stands{11.4, -7.3, 0.45, false};

  std::array<double, 2> burnt(double x, double y) const {
    return stands.bed_of(scale_x * x + scale_y * y * std::sin(skew), scale_y * y * std::cos(skew));
  }
  std::array<double, 2> commanded(double wx, double wy) const {
    const auto t = stands.sheet_of(wx, wy);
    const double y = t[1] / (scale_y * std::cos(skew));
    return {(t[0] - scale_y * y * std::sin(skew)) / scale_x, y};
  }
};

// A pale board with grain and the rings on it, in the renderer's bed millimetres; it begins at `from`.
float board_shade(const TrueAxes& axes, double x, double y, double from) {
  const test::Lay board{18, 14, 0.8, false};
  const auto own = board.sheet_of(x, y);
  if (own[0] < from || own[1] < 0 || own[0] > 500 || own[1] > 350) return test::kNothingHere;
  const auto machine = axes.commanded(x, y);
  const int column = static_cast<int>(std::lround((machine[0] - kFirstX) / kPitch));
  const int row = static_cast<int>(std::lround((machine[1] - kFirstY) / kPitch));
  if (column >= 0 && row >= 0 && column < kColumns && row < kRows) {
    const double off = std::hypot(machine[0] - kFirstX - column * kPitch, machine[1] - kFirstY - row * kPitch) -
                       (is_key(column, row) ? 4.0 : 2.0);
    if (std::abs(off) < 0.1) return 70.0F;
  }
  return static_cast<float>(190 + 7 * std::sin(own[1] * 2.1 + std::sin(own[0] * 0.03) * 3) +
                            5 * std::sin(own[1] * 0.4 + own[0] * 0.01));
}

cv::Mat board_picture(const test::TrueCamera& camera, const TrueAxes& axes, double from = 0) {
  return test::photograph(camera, {{{}, 3.0, [&](double x, double y) { return board_shade(axes, x, y, from); }}},
                          {.noise = 3, .samples = 3, .thin_lines = true, .seed = 21});
}

test::TrueCamera camera_over_all() {
  test::TrueCamera camera;
  camera.eye_z = 560, camera.tilt_deg = 6, camera.eye_y = 150;
  return camera;
}

// What machine_from_bed and the re-anchored camera say together of every place on the bed, against the truth.
FitResidual machine_error(const test::TrueCamera& camera, const TrueAxes& truth, const MachineAxes& axes,
                          double height) {
  FitResidual out;
  int n = 0;
  for (double y = 0; y <= 380; y += 20) {
    for (double x = 0; x <= 520; x += 20, ++n) {
      const auto world = truth.burnt(x, y);
      const auto px = camera.pixel_of(world[0], world[1], height);
      const auto said =
          axes.machine_from_bed * axes.model.bed_from_camera(point<CameraFrame>(px[0], px[1]), Millimetres(height));
      const double d = distance(said, point<MachineFrame>(x, y)).count();
      out.rms += d * d, out.max = std::max(out.max, d);
    }
  }
  out.rms = std::sqrt(out.rms / n);
  return out;
}

// The provisional bed frame has nothing to do with the machine's.
CameraModel provisional_model(const test::TrueCamera& camera) {
  return exact_model(camera).re_anchored({degrees(-3.1), point<BedFrame>(24, 33)});
}

std::vector<FoundRing> measured_rings(const TrueAxes& truth, double noise_mm, unsigned seed = 3) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, noise_mm);
  std::vector<FoundRing> rings;
  const auto known = pattern();
  for (std::size_t i = 0; i < known.size(); ++i) {
    const auto world = truth.burnt(known[i].centre.x.count(), known[i].centre.y.count());
    const double x = world[0] + noise(random), y = world[1] + noise(random);
    rings.push_back({i, known[i].centre, point<BedFrame>(x, y), known[i].diameter, {}});
  }
  return rings;
}

TEST(BurntPattern, TiesTheBedToTheMachineFromOneRenderedPicture) {
  const test::TrueCamera camera = camera_over_all();
  const TrueAxes truth;
  const cv::Mat picture = board_picture(camera, truth);
  if (const char* out = std::getenv("VENEER_TEST_PICTURES"))  // NOLINT(concurrency-mt-unsafe)
    cv::imwrite(std::string(out) + "/burnt_pattern.png", picture);
  const CameraModel model = provisional_model(camera);
  const auto rings = find_burnt_pattern(picture, model, 3_mm, pattern());
  ASSERT_TRUE(rings.ok()) << rings.error().message;
  EXPECT_GE(rings->size(), 94U);
  const auto axes = fit_machine_axes(*rings, model, 3_mm);
  ASSERT_TRUE(axes.ok()) << axes.error().message;
  EXPECT_NEAR(axes->scale_x, truth.scale_x, 5e-5);
  EXPECT_NEAR(axes->scale_y, truth.scale_y, 5e-5);
  EXPECT_NEAR(axes->skew.count(), truth.skew, 5e-5);
  const auto error = machine_error(camera, truth, *axes, 2.1);
  EXPECT_LT(error.max, 0.02);
  std::cout << rings->size() << " of " << pattern().size() << " rings, " << axes->dropped << " dropped, rms "
            << axes->rms.count() << " max " << axes->max.count() << " leave-out " << axes->leave_out_rms.count()
            << " mm; machine_from_bed error rms " << error.rms << " max " << error.max << " mm\n";

  // The same picture turned by half a turn is another scene, in which the keys still tell the way.
  cv::Mat turned;
  cv::rotate(picture, turned, cv::ROTATE_180);
  CameraParameters upside = model.parameters();
  upside.fx = -upside.fx, upside.fy = -upside.fy;
  upside.cx = camera.width - upside.cx, upside.cy = camera.height - upside.cy;
  const auto again = find_burnt_pattern(
      turned, CameraModel(upside).re_anchored({degrees(180), point<BedFrame>(520, 380)}), 3_mm, pattern());
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_GE(again->size(), 94U);

  // And a mirrored one is none.
  cv::Mat mirrored;
  cv::flip(picture, mirrored, 1);
  const auto none = find_burnt_pattern(mirrored, model, 3_mm, pattern());
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().code, ErrorCode::kNotFound);
}

TEST(BurntPattern, SaysWhenNothingWasBurnt) {
  test::TrueCamera camera = camera_over_all();
  const cv::Mat picture = test::photograph(camera, {}, {.samples = 2});
  const auto rings = find_burnt_pattern(picture, provisional_model(camera), 3_mm, pattern());
  ASSERT_FALSE(rings.ok());
  EXPECT_EQ(rings.error().code, ErrorCode::kNotFound);
  EXPECT_NE(rings.error().message.find("rings"), std::string::npos);
}

TEST(BurntPattern, SaysWhenTheBoardLayBesideIt) {
  const test::TrueCamera camera = camera_over_all();
  const cv::Mat picture = board_picture(camera, TrueAxes(), 60);  // the first column met no board
  const auto rings = find_burnt_pattern(picture, provisional_model(camera), 3_mm, pattern());
  ASSERT_FALSE(rings.ok());
  EXPECT_EQ(rings.error().code, ErrorCode::kRefused);
  EXPECT_EQ(
      rings.error().message,
      "88 of the 96 burnt rings are seen, which does not tell where the others would be: lay a fresh board in the "
      "middle of the bed, so that all of them meet it");
}

TEST(MachineAxes, SharesOriginAndXAxisWithTheMachine) {
  const test::TrueCamera camera = camera_over_all();
  const TrueAxes truth;
  const auto axes = fit_machine_axes(measured_rings(truth, 0.004), exact_model(camera), 2.1_mm);
  ASSERT_TRUE(axes.ok()) << axes.error().message;
  const auto origin = axes->machine_from_bed * point<BedFrame>(0, 0);
  EXPECT_EQ(origin, point<MachineFrame>(0, 0));
  const auto along = axes->machine_from_bed * point<BedFrame>(100, 0);
  EXPECT_EQ(along.y.count(), 0);
  EXPECT_LT(machine_error(camera, truth, *axes, 2.1).max, 0.01);
}

// Burnt into a board that is bowed by this much, and seen as if it were flat.
std::vector<FoundRing> rings_of_bowed(const test::TrueCamera& camera, const TrueAxes& truth, double bow_x,
                                      double bow_y) {
  const CameraModel model = exact_model(camera);
  const auto lift = [&](double cx, double cy) {
    const auto one = [](double bow, double out) { return bow > 0 ? bow * (1 - out * out) : -bow * out * out; };
    const double middle_x = kFirstX + kPitch * (kColumns - 1) / 2, middle_y = kFirstY + kPitch * (kRows - 1) / 2;
    return one(bow_x, (cx - middle_x) / 262) + one(bow_y, (cy - middle_y) / 183);
  };
  auto rings = measured_rings(truth, 0.006);
  for (auto& ring : rings) {
    const double height = 2.1 + lift(ring.commanded.x.count(), ring.commanded.y.count());
    const auto px = camera.pixel_of(ring.centre.x.count(), ring.centre.y.count(), height);
    ring.centre = model.bed_from_camera(point<CameraFrame>(px[0], px[1]), 2.1_mm);
  }
  return rings;
}

// Seen by a camera 560 mm up, its rings lie up to 0.08 mm elsewhere than those of a flat one.
TEST(MachineAxes, LaysABowedBoardAsItLiesOnTheBed) {
  const test::TrueCamera camera = camera_over_all();
  const CameraModel model = exact_model(camera);
  const TrueAxes truth;
  for (const auto& [bow_x, bow_y] : {std::pair{0.2, 0.1}, {-0.2, 0.05}, {0.15, -0.1}, {-0.1, -0.1}}) {
    const auto axes = fit_machine_axes(rings_of_bowed(camera, truth, bow_x, bow_y), model, 2.1_mm);
    ASSERT_TRUE(axes.ok()) << axes.error().message;
    EXPECT_NEAR(axes->bow_x.count(), bow_x, 0.04);
    EXPECT_NEAR(axes->bow_y.count(), bow_y, 0.04);
    EXPECT_LT(machine_error(camera, truth, *axes, 2.1).max, 0.035);
  }
}

// A lens that is told a little wrong shifts the rings of a flat board much as a bow does.
TEST(MachineAxes, TakesNoErrorOfTheLensForABow) {
  const test::TrueCamera camera = camera_over_all();
  const CameraModel model = exact_model(camera);
  constexpr double kAtTheCorner = 0.015;  // mm
  constexpr double kToCorner = 262;       // mm, from the middle of the pattern
  constexpr double kMiddleX = kFirstX + kPitch * (kColumns - 1) / 2, kMiddleY = kFirstY + kPitch * (kRows - 1) / 2;
  int believed = 0, still = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const TrueAxes truth;
    auto rings = measured_rings(truth, 0.004, seed);
    const auto middle = truth.burnt(kMiddleX, kMiddleY);
    double squares = 0;
    for (auto& ring : rings) {
      const double x = (ring.centre.x.count() - middle[0]) / kToCorner,
                   y = (ring.centre.y.count() - middle[1]) / kToCorner;
      const double off = kAtTheCorner * (x * x + y * y);
      ring.centre.x += Millimetres(off * x), ring.centre.y += Millimetres(off * y);
      squares += off * off * (x * x + y * y);
    }
    // What a certificate says of such a camera: the error itself, and the noise of the corners.
    const Millimetres left_out(std::hypot(std::sqrt(squares / static_cast<double>(rings.size())), 0.006));
    const auto axes = fit_machine_axes(rings, model, 2.1_mm, left_out);
    const auto flat = fit_machine_axes(rings, model, 2.1_mm, 1_mm);
    const auto believing = fit_machine_axes(rings, model, 2.1_mm);
    ASSERT_TRUE(axes.ok() && flat.ok() && believing.ok());
    // Half of such a bow may still be believed, but then it makes nothing worse.
    EXPECT_NEAR(axes->bow_x.count(), 0, 0.05) << "seed " << seed;
    EXPECT_NEAR(axes->bow_y.count(), 0, 0.05) << "seed " << seed;
    EXPECT_LE(machine_error(camera, truth, *axes, 2.1).rms, machine_error(camera, truth, *flat, 2.1).rms);
    believed += believing->bow_x.count() != 0 || believing->bow_y.count() != 0 ? 1 : 0;
    still += axes->bow_x.count() != 0 || axes->bow_y.count() != 0 ? 1 : 0;
  }
  EXPECT_GT(believed, 5);  // or the lens is not wrong enough to show anything
  EXPECT_LT(still, believed);
}

// A bow of 1.5 mm is more than the fit's parabolas are good for, however well they fit.
TEST(MachineAxes, RefusesABoardThatIsBowedByMoreThanAMillimetre) {
  const test::TrueCamera camera = camera_over_all();
  const CameraModel model = exact_model(camera);
  for (const auto& [bow, allowed] : {std::pair{0.8, true}, {1.5, false}}) {
    const auto axes = fit_machine_axes(rings_of_bowed(camera, {}, bow, 0), model, 2.1_mm);
    ASSERT_EQ(axes.ok(), allowed) << bow;
    if (allowed) continue;
    EXPECT_EQ(axes.error().code, ErrorCode::kRefused);
    EXPECT_NE(axes.error().message.find("the board lying flat"), std::string::npos) << axes.error().message;
    EXPECT_NE(axes.error().message.find("bowed"), std::string::npos) << axes.error().message;
  }
}

TEST(MachineAxes, DropsARingSpoiltByAKnotAndSaysSo) {
  const test::TrueCamera camera = camera_over_all();
  auto rings = measured_rings({}, 0.004);
  rings[30].centre.x += 0.3_mm;
  const auto axes = fit_machine_axes(rings, exact_model(camera), 2.1_mm);
  ASSERT_TRUE(axes.ok()) << axes.error().message;
  EXPECT_EQ(axes->dropped, 1);
  EXPECT_LT(axes->max.count(), 0.03);
}

TEST(MachineAxes, RefusesWhatAnAffineMapCannotExplain) {
  const test::TrueCamera camera = camera_over_all();
  auto rings = measured_rings({}, 0.004);
  for (auto& ring : rings) ring.centre.x += Millimetres(0.1 * std::sin(ring.centre.y.count() / 30));  // a loose belt
  const auto axes = fit_machine_axes(rings, exact_model(camera), 2.1_mm);
  ASSERT_FALSE(axes.ok());
  EXPECT_EQ(axes.error().code, ErrorCode::kRefused);
}

TEST(MachineAxes, RefusesAWrongStepSettingAndTooFewRings) {
  const test::TrueCamera camera = camera_over_all();
  const auto wrong = fit_machine_axes(measured_rings({1.05, 1, 0, {}}, 0.004), exact_model(camera), 2.1_mm);
  ASSERT_FALSE(wrong.ok());
  EXPECT_NE(wrong.error().message.find("$100"), std::string::npos) << wrong.error().message;
  const auto rings = measured_rings({}, 0.004);
  const auto few = fit_machine_axes(std::span(rings).first(8), exact_model(camera), 2.1_mm);
  ASSERT_FALSE(few.ok());
  EXPECT_EQ(few.error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace veneer::calib
