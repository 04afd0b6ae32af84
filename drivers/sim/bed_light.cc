#include "drivers/sim/bed_light.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "base/units.h"

namespace veneer::sim {
namespace {

constexpr double kExposedFor = 95;  // mean grey level that the camera likes best

struct Light {
  cv::Vec3f gain{1, 1, 1};
  double slope_x = 0, slope_y = 0;  // from one side of the picture to the other
  double glare = 0, glare_x = 0, glare_y = 0, glare_size = 0.1;
  double shadow = 0, shadow_way = 0, shadow_at = 0;

  // In parts of the picture's width and height, 0 to 1.
  double at(double u, double v) const {
    double light = 1 + slope_x * (u - 0.5) + slope_y * (v - 0.5);
    if (shadow > 0) {
      const double side = (u - 0.5) * std::cos(shadow_way) + (v - 0.5) * std::sin(shadow_way) - shadow_at;
      light *= 1 - shadow / (1 + std::exp(-side * 60));
    }
    return std::max(light, 0.02);
  }
  double shine(double u, double v) const {
    const double dx = (u - glare_x) / glare_size, dy = (v - glare_y) / (0.6 * glare_size);
    return 120 * glare * std::exp(-(dx * dx + dy * dy));
  }
};

Light draw(const Roughness& rough, Random& random) {
  Light light;
  const double brightness = 1 + random.spread(rough.light_drift);
  for (int k = 0; k < 3; ++k) light.gain[k] = static_cast<float>(brightness * (1 + random.spread(rough.colour_drift)));
  light.slope_x = random.spread(rough.light_slope), light.slope_y = random.spread(rough.light_slope);
  light.glare = random.uniform(0.3, 1) * rough.glare;
  light.glare_x = random.uniform(0.1, 0.9), light.glare_y = random.uniform(0.1, 0.9);
  light.glare_size = random.uniform(0.03, 0.12);
  light.shadow = random.uniform(0.3, 1) * rough.shadow;
  light.shadow_way = random.uniform(0, 2 * kPi), light.shadow_at = random.spread(0.4);
  return light;
}

bool steady(const Roughness& r) {
  return r.light_drift == 0 && r.colour_drift == 0 && r.light_slope == 0 && r.glare == 0 && r.shadow == 0 &&
         r.auto_exposure == 0;
}

}  // namespace

void light_the_bed(cv::Mat& picture, const Roughness& rough, Random& random) {
  if (steady(rough)) return;
  Light light = draw(rough, random);
  const cv::Scalar mean = cv::mean(picture);
  const double grey = std::max(1.0, (mean[0] * light.gain[0] + mean[1] * light.gain[1] + mean[2] * light.gain[2]) / 3);
  light.gain *= static_cast<float>(std::pow(kExposedFor / grey, rough.auto_exposure * 0.5));
  cv::parallel_for_(cv::Range(0, picture.rows), [&](const cv::Range& range) {
    for (int r = range.start; r < range.end; ++r) {
      const double v = static_cast<double>(r) / picture.rows;
      auto* row = picture.ptr<cv::Vec3b>(r);
      for (int c = 0; c < picture.cols; ++c) {
        const double u = static_cast<double>(c) / picture.cols;
        const auto factor = static_cast<float>(light.at(u, v));
        const auto shine = static_cast<float>(light.glare > 0 ? light.shine(u, v) : 0);
        for (int k = 0; k < 3; ++k)
          row[c][k] = cv::saturate_cast<unsigned char>(static_cast<float>(row[c][k]) * factor * light.gain[k] + shine);
      }
    }
  });
}

}  // namespace veneer::sim
