#include "drivers/sim/scanner.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "drivers/sim/coarse_map.h"
#include "drivers/sim/light.h"
#include "drivers/sim/noise.h"

namespace veneer::sim {
namespace {

constexpr int kStripRows = 96;
constexpr int kBorder = 8;           // pixels around a sheet
constexpr double kLeastBlur = 0.35;  // scan pixels; a sensor's pixel is never a point
const cv::Vec3f kLid(234, 237, 238);

// How much the sheet shades the lid behind it: 0 far away, up to 1 deep inside a narrow slit. One pixel per half mm,
// and smooth between them: a shade in steps has edges that no lamp draws.
struct LidShade {
  static constexpr int kFrame = 8;  // pixels around the sheet

  cv::Mat shade;
  double px_per_mm;

  // Of a place on the sheet, counted in its own pixels, each from the middle of the first.
  float at(cv::Vec2f place, double sheet_px_per_mm) const {
    const auto scale = static_cast<float>(px_per_mm / sheet_px_per_mm);
    const auto along = [&](float p, int size) {
      return std::clamp((p + 0.5F) * scale - 0.5F + kFrame, 0.0F, static_cast<float>(size - 1) - 1e-3F);
    };
    const float x = along(place[0], shade.cols), y = along(place[1], shade.rows);
    const int c = static_cast<int>(x), r = static_cast<int>(y);
    const float u = x - static_cast<float>(c), v = y - static_cast<float>(r);
    const auto* above = shade.ptr<float>(r) + c;
    const auto* below = shade.ptr<float>(r + 1) + c;
    return (1 - v) * ((1 - u) * above[0] + u * above[1]) + v * ((1 - u) * below[0] + u * below[1]);
  }
};

LidShade shade_of(const Sheet& sheet) {
  LidShade out{{}, 2};
  cv::Mat small;
  const double factor = out.px_per_mm / sheet.px_per_mm;
  cv::resize(sheet.material, small, cv::Size(), factor, factor, cv::INTER_AREA);
  small.convertTo(small, CV_32F, 1 / 255.0);
  cv::copyMakeBorder(small, small, LidShade::kFrame, LidShade::kFrame, LidShade::kFrame, LidShade::kFrame,
                     cv::BORDER_CONSTANT, cv::Scalar(0));
  cv::GaussianBlur(small, out.shade, cv::Size(), 0.9 * out.px_per_mm);
  return out;
}

// One face of a sheet as the device's optics blur it: the light of its wood, and how much of a place is wood. What is
// blurred is the light, of wood as far as there is any: blurred each for itself, the brown of a rim would reach into
// the slit and darken what is seen there. Blurring the wood and not the picture keeps the sampling honest: an edge
// comes out at its place whatever its phase to the pixels.
struct SoftFace {
  cv::Mat light, cover;  // framed by kBorder pixels
};

cv::Mat blurred(const cv::Mat& sharp, double sigma) {
  cv::Mat soft;
  cv::GaussianBlur(sharp, soft, cv::Size(), sigma, sigma, cv::BORDER_REPLICATE);
  return soft;
}

SoftFace soften(const Sheet& sheet, SheetFace face, double sigma) {
  cv::Mat light, cover;
  // The sheet ends inside the border, so that its edges are blurred into nothing.
  cv::copyMakeBorder(sheet.face(face), light, kBorder, kBorder, kBorder, kBorder, cv::BORDER_CONSTANT, cv::Scalar());
  cv::copyMakeBorder(sheet.material, cover, kBorder, kBorder, kBorder, kBorder, cv::BORDER_CONSTANT, cv::Scalar(0));
  const cv::Mat& engraved = sheet.engraved(face);
  cv::parallel_for_(cv::Range(0, engraved.rows), [&](const cv::Range& rows) {
    for (int r = rows.start; r < rows.end; ++r) {
      auto* wood = light.ptr<cv::Vec3b>(r + kBorder) + kBorder;
      const auto *cov = cover.ptr<unsigned char>(r + kBorder) + kBorder, *eng = engraved.ptr<unsigned char>(r);
      for (int c = 0; c < engraved.cols; ++c)
        if (cov[c] < 255 || eng[c] > 0) wood[c] = burnt_colour(wood[c], eng[c]) * (static_cast<float>(cov[c]) / 255.0F);
    }
  });
  return {blurred(light, sigma), blurred(cover, sigma)};
}

void image_strip(cv::Mat& strip, const cv::Mat& map, const Sheet& sheet, const SoftFace& soft, const LidShade& lid) {
  cv::Mat light, cover;
  const cv::Mat framed = map + cv::Scalar(kBorder, kBorder);
  cv::remap(soft.light, light, framed, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_CONSTANT, cv::Scalar());
  cv::remap(soft.cover, cover, framed, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_CONSTANT, cv::Scalar(0));
  for (int r = 0; r < map.rows; ++r) {
    const auto* from = map.ptr<cv::Vec2f>(r);
    const auto* wood = light.ptr<cv::Vec3b>(r);
    const auto* cov = cover.ptr<unsigned char>(r);
    auto* out = strip.ptr<cv::Vec3b>(r);
    for (int c = 0; c < map.cols; ++c) {
      out[c] = wood[c];
      if (cov[c] == 255) continue;
      const float seen = 1 - 0.22F * lid.at(from[c], sheet.px_per_mm);
      out[c] += kLid * (seen * (1 - static_cast<float>(cov[c]) / 255.0F));
    }
  }
}

struct SeenDust {
  Dust dust;
  cv::Scalar colour;
};

// Specks and hairs between sheet and glass.
std::vector<SeenDust> draw_dust(cv::Size size, double px_per_mm, double amount, Random& random) {
  const auto specks = static_cast<int>(60 * amount), hairs = static_cast<int>(4 * amount);
  const auto colour = [&] {
    const double grey = random.uniform() < 0.6 ? random.uniform(60, 110) : random.uniform(185, 225);
    return cv::Scalar(grey - 4, grey, grey + 3);
  };
  std::vector<SeenDust> out;
  for (int i = 0; i < specks; ++i) {
    const double y = random.uniform(0, size.height), x = random.uniform(0, size.width);
    const double radius = random.uniform(0.02, 0.09) * px_per_mm;
    out.push_back({{{{x, y}}, radius}, colour()});
  }
  for (int i = 0; i < hairs; ++i) {
    Vec2 at{random.uniform(0, size.width), random.uniform(0, size.height)};
    double way = random.uniform(0, 6.28);
    const double bend = random.spread(0.25), step = 0.35 * px_per_mm;
    SeenDust hair{{{at}, 0.5}, colour()};
    for (int k = 0; k < 8; ++k) {
      at = at + Vec2{std::cos(way), std::sin(way)} * step;
      hair.dust.line.push_back(at);
      way += bend;
    }
    out.push_back(std::move(hair));
  }
  return out;
}

void show_dust(cv::Mat& picture, const std::vector<SeenDust>& dust) {
  constexpr int kShift = 4;
  const auto fixed = [](double v) { return static_cast<int>(v * (1 << kShift)); };
  const auto point = [&](Vec2 p) { return cv::Point(fixed(p.x), fixed(p.y)); };
  for (const auto& [grain, colour] : dust) {
    if (grain.line.size() == 1)
      cv::circle(picture, point(grain.line[0]), fixed(grain.radius_px), colour, cv::FILLED, cv::LINE_AA, kShift);
    for (std::size_t i = 1; i < grain.line.size(); ++i)
      cv::line(picture, point(grain.line[i - 1]), point(grain.line[i]), colour, 1, cv::LINE_AA, kShift);
  }
}

cv::Size size_of_scan(const ScanTruth& truth) {
  return {static_cast<int>(std::lround(truth.scanner.width_mm * truth.px_per_mm)),
          static_cast<int>(std::lround(truth.scanner.height_mm * truth.px_per_mm))};
}

std::vector<float> uneven(int count, double amount, double px_per_mm, bool falls_off, Random& random) {
  LineNoise slow(random, 8), fine(random, static_cast<int>(count / px_per_mm / 3) + 2);
  std::vector<float> out(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    const double t = static_cast<double>(i) / count, side = 2 * t - 1;
    const double fall = falls_off ? amount * side * side * side * side : 0;
    out[static_cast<std::size_t>(i)] =
        static_cast<float>(1 + 0.35 * amount * slow.at(t * 6) + 0.12 * amount * fine.at(i / px_per_mm / 3) - fall);
  }
  return out;
}

}  // namespace

std::vector<Dust> dust_of_scan(const ScanTruth& truth, std::uint64_t seed) {
  Random random(seed, "scan");
  std::vector<Dust> out;
  for (SeenDust& seen : draw_dust(size_of_scan(truth), truth.px_per_mm, truth.scanner.dust, random))
    out.push_back(std::move(seen.dust));
  return out;
}

cv::Mat render_scan(const ScanTruth& truth, const Sheet* sheet, std::uint64_t seed) {
  const ScannerTruth& device = truth.scanner;
  const cv::Size size = size_of_scan(truth);
  cv::Mat picture(size, CV_8UC3, cv::Scalar(kLid[0], kLid[1], kLid[2]));
  if (sheet != nullptr) {
    const LidShade lid = shade_of(*sheet);
    const SoftFace soft =
        soften(*sheet, truth.face, std::max(device.psf_px, kLeastBlur) * sheet->px_per_mm / truth.px_per_mm);
    const CoarseMap map(size, 8, [&](Vec2 p) { return sheet->pixel(truth.sheet_mm(p)); });
    const int strips = (size.height + kStripRows - 1) / kStripRows;
    cv::parallel_for_(
        cv::Range(0, strips),
        [&](const cv::Range& range) {
          for (int i = range.start; i < range.end; ++i) {
            const int first = i * kStripRows, rows = std::min(kStripRows, size.height - first);
            cv::Mat strip = picture.rowRange(first, first + rows);
            image_strip(strip, map.rows(first, rows), *sheet, soft, lid);
          }
        },
        strips);
  }
  Random random(seed, "scan");
  show_dust(picture, draw_dust(size, truth.px_per_mm, device.dust, random));
  if (device.lamp != std::array<double, 3>{1, 1, 1})
    cv::multiply(picture, cv::Scalar(device.lamp[0], device.lamp[1], device.lamp[2]), picture);
  Random lamp(device.light_seed, "lamp");
  const auto columns = uneven(picture.cols, device.uneven_light, truth.px_per_mm, true, lamp);
  const auto rows = uneven(picture.rows, device.uneven_light, truth.px_per_mm, false, lamp);
  light_and_noise(picture, columns, rows, device.noise, random);
  return picture;
}

Vec2 ScanTruth::scan_pixel(Vec2 on_sheet) const {
  const Vec2 nominal = scanner.nominal_from_glass(glass_from_sheet.place(on_sheet));
  return {nominal.x * px_per_mm, (scanner.height_mm - nominal.y) * px_per_mm};
}

Vec2 ScanTruth::sheet_mm(Vec2 pixel) const {
  const Vec2 nominal{pixel.x / px_per_mm, scanner.height_mm - pixel.y / px_per_mm};
  return glass_from_sheet.back_to_sheet(scanner.glass_from_nominal(nominal));
}

}  // namespace veneer::sim
