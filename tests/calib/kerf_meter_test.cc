// Kerf from a scan: the slit is hardly three pixels wide, browned at its rims, and the lid behind it looks grey.
#include "calib/kerf_meter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "calib/scan_light.h"
#include "tests/support/rendered_bed.h"

namespace veneer::calib {
namespace {

// Four lines each way, unevenly spaced, in two neighbouring cells of the pattern.
std::vector<KerfLine> kerf_lines() {
  std::vector<KerfLine> out;
  for (const double offset : {-10.5, -4.5, 2.5, 10.5}) {
    out.push_back({point<MachineFrame>(210, 60 + offset), point<MachineFrame>(230, 60 + offset)});
  }
  for (const double offset : {-10.5, -4.5, 2.5, 10.5}) {
    out.push_back({point<MachineFrame>(260 + offset, 50), point<MachineFrame>(260 + offset, 70)});
  }
  return out;
}

struct ScanScene {
  double kerf = 0.27;
  double dpi = 300, psf_px = 0.6, noise = 1.5;
  int finer = 1;  // times finer are the optics drawn than the sensor's pixels are, which take the mean of what they see
  double rim = 0.10, rim_dark = 0.6, lid_in_slit = 0.82;
  // Of a cut that is wider where the beam entered, a ledge shows, all brown; soot lies farther out than the rim.
  double ledge = 0, soot = 0, soot_dark = 0;
  test::Lay glass_from_machine{-180, -20, 0, false};  // mm, y up, picture's lower left
  double width_mm = 110, height_mm = 90;
  bool cut = true;
  cv::Vec3f wood{150, 185, 206};  // BGR
  bool shadow = false;            // the board's on the lid, in three steps of half a millimetre
};

// Square of the distance in mm, as all below: a root for every one of millions of points takes longer than all the
// rest.
double square_to_line(const KerfLine& line, double x, double y) {
  const double ax = line.from.x.count(), ay = line.from.y.count();
  const double dx = line.to.x.count() - ax, dy = line.to.y.count() - ay;
  const double t = std::clamp(((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy), 0.0, 1.0);
  const double off_x = x - ax - t * dx, off_y = y - ay - t * dy;
  return off_x * off_x + off_y * off_y;
}

// The ring of the pattern that is nearest to a place stands on this middle.
double square_to_ring_middle(double x, double y) {
  const double rx = x < 220 ? 200 : x < 260 ? 240 : 280, ry = y < 60 ? 40 : 80;
  return (x - rx) * (x - rx) + (y - ry) * (y - ry);
}

// The board's corner is in the picture.
bool is_lid(double x, double y) { return x < 188 || y < 24; }

cv::Vec3f plain_wood(const ScanScene& scene, double x, double y) {
  const auto grain = static_cast<float>(6 * std::sin(y * 2.3 + 2 * std::sin(x * 0.05)) + 4 * std::sin(y * 0.5));
  return scene.wood + cv::Vec3f(grain, grain, grain);
}

constexpr double kShadowMm = 1.5;
const cv::Vec3f kLid(234, 237, 238);

// So far beside the board.
float lid_light(const ScanScene& scene, double mm) {
  if (!scene.shadow || mm > kShadowMm) return 1;
  return mm < 0.5 ? 0.86F : mm < 1 ? 0.91F : 0.95F;
}

cv::Vec3f scene_colour(const ScanScene& scene, const std::vector<KerfLine>& lines, double x, double y) {
  if (is_lid(x, y)) return kLid * lid_light(scene, std::max(188 - x, 24 - y));
  cv::Vec3f wood = plain_wood(scene, x, y);
  // Rings of the same pattern, engraved.
  const double from_middle = square_to_ring_middle(x, y);
  if (from_middle > 1.9 * 1.9 && from_middle < 2.1 * 2.1) wood *= 0.4F;
  if (!scene.cut) return wood;
  double nearest = 1e9;
  for (const auto& line : lines) nearest = std::min(nearest, square_to_line(line, x, y));
  // A burnt wall is rough: 0.02 mm, quickly along the line.
  nearest = std::sqrt(nearest) + 0.02 * (std::sin(31 * x + 17 * y) + std::sin(23 * x - 41 * y));
  if (nearest < scene.kerf / 2) return kLid * static_cast<float>(scene.lid_in_slit);
  const double beside = nearest - scene.kerf / 2 - scene.ledge;
  const double browned = std::clamp(1 - beside / scene.rim, 0.0, 1.0);
  const double sooty = scene.soot > 0 ? std::clamp(1 - beside / scene.soot, 0.0, 1.0) : 0;
  return wood * static_cast<float>(1 - std::max(scene.rim_dark * browned, scene.soot_dark * sooty));
}

// Where the picture is more than even wood or lid: within 0.6 mm of the lines, on the rings, at the board's sides.
cv::Mat busy_part(const ScanScene& scene, const std::vector<KerfLine>& lines, cv::Size size, double px_per_mm) {
  cv::Mat busy(size, CV_8U, cv::Scalar(0));
  const auto at = [&](double machine_x, double machine_y) {
    const auto p = scene.glass_from_machine.bed_of(machine_x, machine_y);
    return cv::Point(static_cast<int>(p[0] * px_per_mm), static_cast<int>(size.height - p[1] * px_per_mm));
  };
  const auto wide = [&](double mm) { return static_cast<int>(std::ceil(mm * px_per_mm)) + 2; };
  for (const auto& line : lines)
    cv::line(busy, at(line.from.x.count(), line.from.y.count()), at(line.to.x.count(), line.to.y.count()), 255,
             wide(2 * (0.6 + scene.soot)));
  for (const double x : {200, 240, 280})
    for (const double y : {40, 80}) cv::circle(busy, at(x, y), wide(2.5), 255, cv::FILLED);
  cv::line(busy, at(188, -200), at(188, 300), 255, wide(scene.shadow ? 2 * kShadowMm : 2 * 0.3));
  cv::line(busy, at(0, 24), at(500, 24), 255, wide(scene.shadow ? 2 * kShadowMm : 2 * 0.3));
  return busy;
}

cv::Mat scan_of(const ScanScene& scene) {
  const double px_per_mm = scene.finer * scene.dpi / 25.4;
  const auto lines = kerf_lines();
  cv::Mat picture(static_cast<int>(scene.height_mm * px_per_mm), static_cast<int>(scene.width_mm * px_per_mm),
                  CV_32FC3);
  const cv::Mat busy = busy_part(scene, lines, picture.size(), px_per_mm);
  cv::parallel_for_(cv::Range(0, picture.rows), [&](const cv::Range& rows) {
    for (int r = rows.start; r < rows.end; ++r) {
      for (int c = 0; c < picture.cols; ++c) {
        if (busy.at<std::uint8_t>(r, c) == 0) {
          const auto middle =
              scene.glass_from_machine.sheet_of((c + 0.5) / px_per_mm, (picture.rows - r - 0.5) / px_per_mm);
          picture.at<cv::Vec3f>(r, c) = is_lid(middle[0], middle[1]) ? kLid : plain_wood(scene, middle[0], middle[1]);
          continue;
        }
        constexpr int kSamples = 4;
        cv::Vec3f sum(0, 0, 0);
        for (int i = 0; i < kSamples * kSamples; ++i) {
          const int across = i % kSamples, down = i / kSamples;
          const double x = (c + (across + 0.5) / kSamples) / px_per_mm;
          const double y = (picture.rows - r - (down + 0.5) / kSamples) / px_per_mm;
          const auto machine = scene.glass_from_machine.sheet_of(x, y);
          sum += scene_colour(scene, lines, machine[0], machine[1]);
        }
        picture.at<cv::Vec3f>(r, c) = sum / (kSamples * kSamples);
      }
    }
  });
  cv::GaussianBlur(picture, picture, {}, scene.finer * scene.psf_px);
  if (scene.finer > 1) cv::resize(picture, picture, picture.size() / scene.finer, 0, 0, cv::INTER_AREA);
  cv::Mat noise(picture.size(), CV_32FC3), out;
  cv::RNG random(9);
  random.fill(noise, cv::RNG::NORMAL, 0, scene.noise);
  picture += noise;
  // Dust on one line, and a hair beside another.
  const auto lay = [&](double x, double y) {
    const auto p = scene.glass_from_machine.bed_of(x, y);
    const double scale = px_per_mm / scene.finer;
    return cv::Point(static_cast<int>(p[0] * scale), static_cast<int>(picture.rows - p[1] * scale));
  };
  cv::circle(picture, lay(217, 62.5), 3, cv::Scalar(70, 72, 75), cv::FILLED);
  cv::line(picture, lay(252, 55), lay(255, 57), cv::Scalar(70, 72, 75), 1);
  picture.convertTo(out, CV_8UC3);
  return out;
}

// The picture's lower left corner to the place where the pattern's middle (235, 60) lies in its middle.
test::Lay turned(double turn_deg, bool mirrored) {
  test::Lay lay{0, 0, turn_deg, mirrored};
  const auto middle = lay.bed_of(235, 60);
  lay.x = 55 - middle[0], lay.y = 45 - middle[1];
  return lay;
}

TEST(LineSpread, SumsWhatFallsBelow) {
  constexpr double kStep = 1e-4;
  for (const LineSpread& spread : {LineSpread{0.05, 0}, LineSpread{0.03, 0.3}, LineSpread{0.04, -0.1}})
    for (const double roughness : {0.0, 0.02})
      for (double x = -0.5; x < 0.5; x += 0.03) {
        const double slope =
            (spread.sum_below(x + kStep, roughness) - spread.sum_below(x - kStep, roughness)) / (2 * kStep);
        EXPECT_NEAR(slope, spread.below(x, roughness), 1e-5) << x;
        EXPECT_NEAR(spread.sum_below(x, roughness) - spread.sum_below(-x, roughness), x, 1e-12) << x;
      }
  EXPECT_NEAR(LineSpread{}.sum_below(-2), 0, 1e-12);
}

TEST(KerfMeter, MeasuresTheKerfToAFewMicrometresHoweverTheBoardLies) {
  struct Case {
    double kerf, turn;
    bool mirrored;
  };
  for (const Case& c : {Case{0.24, 0.7, false}, Case{0.26, 1.7, true}, Case{0.28, 93, false}, Case{0.30, 181, true}}) {
    ScanScene scene;
    scene.kerf = c.kerf, scene.glass_from_machine = turned(c.turn, c.mirrored);
    const auto kerf = measure_kerf(scan_of(scene), ScanResolution::from_dpi(300), kerf_lines());
    ASSERT_TRUE(kerf.ok()) << kerf.error().message;
    EXPECT_GE(kerf->readings.size(), 7U);  // a hair lies against one of the lines
    EXPECT_NEAR(kerf->mean.count(), c.kerf, 0.005) << "turned by " << c.turn;
    EXPECT_NEAR(kerf->mean_x_lines.count(), c.kerf, 0.007);
    EXPECT_NEAR(kerf->mean_y_lines.count(), c.kerf, 0.007);
    EXPECT_LT(kerf->spread.count(), 0.015);
    std::cout << "kerf " << c.kerf << " turned " << c.turn << ": " << kerf->mean.count() << " +- "
              << kerf->spread.count() << " (x lines " << kerf->mean_x_lines.count() << ", y lines "
              << kerf->mean_y_lines.count() << ")\n";
  }
}

// Drawn at the sensor's own pixels, optics have a narrower core and longer tails than real ones. The scanner's spread
// is measured, so neither kind may fool the meter.
TEST(KerfMeter, MeasuresThroughOpticsThatAreDrawnFinerThanThePixels) {
  ScanScene scene;
  scene.kerf = 0.30, scene.finer = 2, scene.glass_from_machine = turned(0.7, false);
  const auto kerf = measure_kerf(scan_of(scene), ScanResolution::from_dpi(300), kerf_lines());
  ASSERT_TRUE(kerf.ok()) << kerf.error().message;
  EXPECT_NEAR(kerf->mean.count(), 0.30, 0.008);
  std::cout << "finer optics: " << kerf->mean.count() << " +- " << kerf->spread.count() << "\n";
}

// At the edges the blur is seen, be it half of what is usual or twice as much.
TEST(KerfMeter, MeasuresOnSharperAndSofterScannersThanUsual) {
  ScanScene fine;
  fine.dpi = 600, fine.glass_from_machine = turned(1.7, false), fine.kerf = 0.28;
  const auto sharp = measure_kerf(scan_of(fine), ScanResolution::from_dpi(600), kerf_lines());
  ASSERT_TRUE(sharp.ok()) << sharp.error().message;
  EXPECT_NEAR(sharp->mean.count(), 0.28, 0.004);
  ScanScene dull;
  dull.psf_px = 1.1, dull.glass_from_machine = turned(1.7, false), dull.kerf = 0.28;
  const auto soft = measure_kerf(scan_of(dull), ScanResolution::from_dpi(300), kerf_lines());
  ASSERT_TRUE(soft.ok()) << soft.error().message;
  EXPECT_NEAR(soft->mean.count(), 0.28, 0.015);
  std::cout << "600 dpi: " << sharp->mean.count() << ", soft: " << soft->mean.count() << "\n";
}

// An edge beside a shadow's looks soft: taken for the scanner's blur, it made of a kerf of 0.255 mm one of 0.207, and
// all joints of a picture as much too wide.
TEST(KerfMeter, DoesNotTakeAShadowsEdgeForBlur) {
  ScanScene scene;
  scene.glass_from_machine = turned(0.7, false), scene.kerf = 0.25;
  scene.wood = {168, 202, 222}, scene.shadow = true;  // maple
  const auto kerf = measure_kerf(scan_of(scene), ScanResolution::from_dpi(300), kerf_lines());
  ASSERT_TRUE(kerf.ok()) << kerf.error().message;
  EXPECT_NEAR(kerf->mean.count(), 0.25, 0.01);
  std::cout << "beside a shadow: " << kerf->mean.count() << " +- " << kerf->spread.count() << "\n";
}

TEST(KerfMeter, DoesNotMistakeADimLidOrABrownRimForWidth) {
  for (const bool harsh : {false, true}) {
    ScanScene scene;
    scene.glass_from_machine = turned(31, true);
    scene.lid_in_slit = harsh ? 0.72 : 0.98, scene.rim_dark = harsh ? 0.75 : 0.1, scene.rim = harsh ? 0.16 : 0.05;
    const auto kerf = measure_kerf(scan_of(scene), ScanResolution::from_dpi(300), kerf_lines());
    ASSERT_TRUE(kerf.ok()) << kerf.error().message;
    EXPECT_NEAR(kerf->mean.count(), 0.27, 0.02) << (harsh ? "harsh" : "clean");
    std::cout << (harsh ? "harsh: " : "clean: ") << kerf->mean.count() << " +- " << kerf->spread.count() << "\n";
  }
}

// A kerf read beside soot of 0.3 mm was 0.03 mm too narrow: the joints of a whole picture were that much too wide.
TEST(KerfMeter, DoesNotTakeSootForTheRim) {
  for (const double soot : {0.3, 0.6}) {
    ScanScene scene;
    scene.glass_from_machine = turned(soot > 0.5 ? 93 : 0.7, false);
    scene.kerf = 0.27, scene.ledge = 0.015, scene.soot = soot, scene.soot_dark = 0.25;
    const auto kerf = measure_kerf(scan_of(scene), ScanResolution::from_dpi(300), kerf_lines());
    ASSERT_TRUE(kerf.ok()) << kerf.error().message;
    EXPECT_NEAR(kerf->mean.count(), 0.27, 0.01) << soot;
    std::cout << "soot " << soot << ": " << kerf->mean.count() << " +- " << kerf->spread.count() << "\n";
  }
}

// Of narrow slits in pale wood beside soot a rim of half the width fits as well, and the slit comes out wider: by 0.02
// to 0.03 mm on boards that the twin's workshop burnt.
TEST(KerfMeter, TakesAUsualRimWhereSootHidesIt) {
  ScanScene scene;
  scene.glass_from_machine = turned(0.7, false), scene.wood = {168, 202, 222}, scene.shadow = true;
  scene.kerf = 0.21, scene.soot = 0.3, scene.soot_dark = 0.25;
  const auto kerf = measure_kerf(scan_of(scene), ScanResolution::from_dpi(300), kerf_lines());
  ASSERT_TRUE(kerf.ok()) << kerf.error().message;
  EXPECT_NEAR(kerf->mean.count(), 0.21, 0.01);
  std::cout << "narrow, beside soot: " << kerf->mean.count() << " +- " << kerf->spread.count() << "\n";
}

TEST(KerfMeter, SaysWhenThereAreNoLines) {
  ScanScene scene;
  scene.cut = false, scene.glass_from_machine = turned(10, false);
  const auto none = measure_kerf(scan_of(scene), ScanResolution::from_dpi(300), kerf_lines());
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().code, ErrorCode::kNotFound);
  EXPECT_NE(none.error().message.find("cut lines"), std::string::npos);
}

TEST(KerfMeter, RefusesLinesThatDisagree) {
  ScanScene narrow, wide;
  narrow.glass_from_machine = wide.glass_from_machine = turned(4, false);
  narrow.kerf = 0.2, wide.kerf = 0.42;
  cv::Mat scan = scan_of(narrow), other = scan_of(wide);
  other(cv::Rect(0, 0, scan.cols / 2, scan.rows)).copyTo(scan(cv::Rect(0, 0, scan.cols / 2, scan.rows)));
  const auto kerf = measure_kerf(scan, ScanResolution::from_dpi(300), kerf_lines());
  ASSERT_FALSE(kerf.ok());
  EXPECT_EQ(kerf.error().code, ErrorCode::kRefused);
}

TEST(KerfMeter, WantsAColourScanOfEnoughResolution) {
  const cv::Mat grey(100, 100, CV_8UC1, cv::Scalar(200)), coarse(100, 100, CV_8UC3, cv::Scalar::all(200));
  EXPECT_FALSE(measure_kerf(grey, ScanResolution::from_dpi(300), kerf_lines()).ok());
  EXPECT_FALSE(measure_kerf(coarse, ScanResolution::from_dpi(150), kerf_lines()).ok());
}

}  // namespace
}  // namespace veneer::calib
