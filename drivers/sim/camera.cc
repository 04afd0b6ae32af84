#include "drivers/sim/camera.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <opencv2/imgproc.hpp>

#include "drivers/sim/bed_light.h"
#include "drivers/sim/coarse_map.h"
#include "drivers/sim/light.h"
#include "drivers/sim/noise.h"

namespace veneer::sim {
namespace {

constexpr int kCameraStripRows = 100;
constexpr int kCameraBorder = 8;  // pixels around a sheet
constexpr double kBlurPx = 0.7;   // of the lens, in camera pixels
constexpr double kSurround = 70;  // mm of floor drawn around the bed
constexpr double kBedPx = 5;      // pixels per mm of the drawn bed

// Distance of a point to the walls of a honeycomb of hexagons `pitch` mm apart, in mm.
double honeycomb_wall(double x, double y, double pitch) {
  const double row = pitch * std::sqrt(3.0) / 2;
  double nearest = 1e9, second = 1e9;
  const int r0 = static_cast<int>(std::floor(y / row));
  for (int r = r0; r <= r0 + 1; ++r) {
    const double shift = (r & 1) != 0 ? pitch / 2 : 0;
    const double c0 = std::floor((x - shift) / pitch);
    for (const double c : {c0, c0 + 1}) {
      const double dx = x - shift - c * pitch, dy = y - r * row, d = dx * dx + dy * dy;
      if (d < nearest)
        second = nearest, nearest = d;
      else if (d < second)
        second = d;
    }
  }
  return (std::sqrt(second) - std::sqrt(nearest)) / 2;
}

// The bed from above: dark honeycomb in an aluminium frame, on a dark floor.
cv::Mat draw_bed(const TwinSettings::Bed& bed, Random& random) {
  const cv::Size size(static_cast<int>((bed.width_mm + 2 * kSurround) * kBedPx),
                      static_cast<int>((bed.height_mm + 2 * kSurround) * kBedPx));
  const cv::Mat grime = noise_field(random, size, 60 * kBedPx, 60 * kBedPx),
                brush = noise_field(random, size, 12 * kBedPx, 0.5 * kBedPx);
  cv::Mat out(size, CV_8UC3);
  cv::parallel_for_(cv::Range(0, size.height), [&](const cv::Range& range) {
    for (int r = range.start; r < range.end; ++r) {
      for (int c = 0; c < size.width; ++c) {
        const double x = (c + 0.5) / kBedPx - kSurround, y = bed.height_mm + kSurround - (r + 0.5) / kBedPx;
        const double outside = std::max({-x, -y, x - bed.width_mm, y - bed.height_mm});
        double grey = 30;
        if (outside < 4) {
          const double wall = honeycomb_wall(x, y, 6.4);
          grey = 24 + 44 * std::clamp(1.1 - wall / 0.32, 0.0, 1.0) + 6 * grime.at<float>(r, c);
        } else if (outside < 24) {
          grey = 118 + 9 * brush.at<float>(r, c) - 34 * std::exp(-(outside - 4) / 1.5);
        }
        out.at<cv::Vec3b>(r, c) = {cv::saturate_cast<unsigned char>(grey * 1.03),
                                   cv::saturate_cast<unsigned char>(grey),
                                   cv::saturate_cast<unsigned char>(grey * 0.97)};
      }
    }
  });
  return out;
}

// The sheet's face at half its resolution, which is still finer than the camera's: the light of its wood, and how much
// of a place is wood, both blurred by the lens and framed by kCameraBorder pixels.
struct HalfFace {
  cv::Mat light, cover;
  double px_per_mm = 0;
};

HalfFace half_face(const Sheet& sheet, SheetFace face, double blur_mm) {
  HalfFace out;
  // Whole pixels only, so that half a pixel of the raster stays exactly half.
  const cv::Rect even(0, 0, sheet.material.cols & ~1, sheet.material.rows & ~1);
  const cv::Size half(even.width / 2, even.height / 2);
  cv::Mat engraved, light, cover;
  cv::resize(sheet.face(face)(even), light, half, 0, 0, cv::INTER_AREA);
  cv::resize(sheet.material(even), cover, half, 0, 0, cv::INTER_AREA);
  cv::resize(sheet.engraved(face)(even), engraved, half, 0, 0, cv::INTER_AREA);
  cv::parallel_for_(cv::Range(0, half.height), [&](const cv::Range& range) {
    for (int r = range.start; r < range.end; ++r) {
      for (int c = 0; c < half.width; ++c) {
        const unsigned char e = engraved.at<unsigned char>(r, c), wood = cover.at<unsigned char>(r, c);
        auto& pixel = light.at<cv::Vec3b>(r, c);
        if (e > 0 || wood < 255) pixel = burnt_colour(pixel, e) * (static_cast<float>(wood) / 255.0F);
      }
    }
  });
  out.px_per_mm = sheet.px_per_mm / 2;
  // The lens blurs before the sensor samples; blurred afterwards, an edge would move with its phase to the pixels.
  const double sigma = blur_mm * out.px_per_mm;
  const auto as_seen = [&](const cv::Mat& sharp) {
    cv::Mat soft;
    cv::copyMakeBorder(sharp, soft, kCameraBorder, kCameraBorder, kCameraBorder, kCameraBorder, cv::BORDER_CONSTANT,
                       cv::Scalar());
    cv::GaussianBlur(soft, soft, cv::Size(), sigma);
    return soft;
  };
  out.light = as_seen(light), out.cover = as_seen(cover);
  return out;
}

void lay_over(cv::Mat& strip, const HalfFace& face, const cv::Mat& map) {
  cv::Mat light, cover;
  const cv::Mat framed = map + cv::Scalar(kCameraBorder, kCameraBorder);
  cv::remap(face.light, light, framed, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_CONSTANT, cv::Scalar());
  cv::remap(face.cover, cover, framed, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_CONSTANT, cv::Scalar(0));
  // What shows through a slit or hole lies in the dark.
  constexpr float kInTheDark = 0.6F;
  for (int r = 0; r < strip.rows; ++r) {
    const auto* wood = light.ptr<cv::Vec3b>(r);
    const auto* cov = cover.ptr<unsigned char>(r);
    auto* out = strip.ptr<cv::Vec3b>(r);
    for (int c = 0; c < strip.cols; ++c) {
      if (cov[c] == 0) continue;
      const float bed = kInTheDark * (1 - static_cast<float>(cov[c]) / 255.0F);
      out[c] = cv::Vec3f(out[c]) * bed + cv::Vec3f(wood[c]);
    }
  }
}

// Lamps at the sides, a lens that darkens its corners.
std::vector<float> falloff(int count, double amount, Random& random) {
  const double centre = 0.5 + random.spread(0.12), lean = random.spread(0.5);
  std::vector<float> out(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    const double t = static_cast<double>(i) / count - centre;
    out[static_cast<std::size_t>(i)] = static_cast<float>(1 - amount * (2.2 * t * t + lean * t));
  }
  return out;
}

}  // namespace

BedCamera::BedCamera(const CameraTruth& camera, const TwinSettings::Bed& bed) : camera_(camera), bed_(bed) {
  Random random(camera.light_seed, "bed");
  ground_ = draw_bed(bed, random);
}

Vec2 BedCamera::on_sheet(const BedView& view, Vec2 pixel) const {
  const Sheet& sheet = *view.sheet;
  double height = view.face_height_mm;
  Vec2 at = view.bed_from_sheet.back_to_sheet(camera_.bed_at(pixel, height));
  // The ray is steep and the sheet nearly flat: each round comes a hundred times nearer.
  for (int i = 0; i < 3 && !sheet.relief.flat(); ++i) {
    height = view.face_height_mm + sheet.relief.lift(at.x / sheet.width_mm, at.y / sheet.height_mm, view.face_up);
    at = view.bed_from_sheet.back_to_sheet(camera_.bed_at(pixel, height));
  }
  return at;
}

cv::Mat BedCamera::picture(const BedView& view, std::uint64_t seed, const Roughness& rough) const {
  const cv::Size size(camera_.width_px, camera_.height_px);
  Random lamps(camera_.light_seed, "lamps"), random(seed, "camera");
  const CoarseMap ground_map(size, 8, [&](Vec2 p) {
    const Vec2 at = camera_.bed_at(p, 0);
    return Vec2{(at.x + kSurround) * kBedPx, (bed_.height_mm + kSurround - at.y) * kBedPx};
  });
  HalfFace face;
  std::unique_ptr<CoarseMap> face_map;
  if (view.sheet != nullptr) {
    face = half_face(*view.sheet, view.face_up, kBlurPx * (camera_.position[2] - view.face_height_mm) / camera_.fx);
    face_map = std::make_unique<CoarseMap>(size, 8, [&](Vec2 p) { return view.sheet->pixel(on_sheet(view, p)) * 0.5; });
  }
  cv::Mat picture(size, CV_8UC3);
  const int strips = (size.height + kCameraStripRows - 1) / kCameraStripRows;
  cv::parallel_for_(
      cv::Range(0, strips),
      [&](const cv::Range& range) {
        for (int i = range.start; i < range.end; ++i) {
          const int first = i * kCameraStripRows, rows = std::min(kCameraStripRows, size.height - first);
          cv::Mat strip = picture.rowRange(first, first + rows);
          cv::remap(ground_, strip, ground_map.rows(first, rows), cv::noArray(), cv::INTER_LINEAR,
                    cv::BORDER_REPLICATE);
          if (face_map) lay_over(strip, face, face_map->rows(first, rows));
        }
      },
      strips);
  const auto columns = falloff(size.width, camera_.uneven_light, lamps),
             rows = falloff(size.height, camera_.uneven_light, lamps);
  Random weather(seed, "weather");
  light_the_bed(picture, rough, weather);
  light_and_noise(picture, columns, rows, camera_.noise, random);
  return picture;
}

}  // namespace veneer::sim
