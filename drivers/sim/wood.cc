#include "drivers/sim/wood.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "base/units.h"
#include "drivers/sim/noise.h"
#include "drivers/sim/random.h"

namespace veneer::sim {
namespace {

constexpr double kRadiusStep = 0.02;  // mm per entry of the tables over the ring radius

double smoothstep(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

// One strip in the making. All fields have the strip's size in straight-grain coordinates; the grain is bent at the
// end.
struct Strip {
  const WoodSpecies& wood;
  cv::Size size;
  double px;  // per mm
  Random random;
  bool flat = true;
  double tone = 0;
  cv::Mat radius;  // CV_32FC1, mm from the pith
  cv::Mat pores;   // CV_8UC1 darkening
  std::vector<float> ring_tone, porosity;

  cv::Mat field(double across_mm, double along_mm) { return noise_field(random, size, across_mm * px, along_mm * px); }
};

// Distance from the pith of each point of the cut. Smooth, so it is computed on a coarser grid.
void cut_log(Strip& s) {
  const int coarse = 4;
  const double step = coarse / s.px;
  const cv::Size small((s.size.width + coarse - 1) / coarse + 1, (s.size.height + coarse - 1) / coarse + 1);
  const double width = s.size.width / s.px, height = s.size.height / s.px;
  s.flat = s.random.uniform() < s.wood.flat_sawn;
  const double rings = s.wood.ring_width;
  const double pith_u = s.flat ? width * s.random.uniform(0.25, 0.75) : -s.random.uniform(60, 130);
  const double depth = s.flat ? s.random.uniform(8, 26) * std::sqrt(rings / 3) : s.random.uniform(2, 35);
  // A flat cut runs out of the log: the taper makes the arches.
  const double taper = s.flat ? s.random.uniform(0.035, 0.075) * rings / 3 : s.random.uniform(0.0, 0.02);
  const double tilt = s.random.uniform() < 0.5 ? -taper : taper;
  LineNoise pith_wander(s.random, static_cast<int>(height / 90) + 2),
      depth_wander(s.random, static_cast<int>(height / 70) + 2);
  const double wander_u = s.flat ? 5.0 : 2.0, wander_d = s.flat ? 2.6 : 1.0;
  cv::Mat large = noise_field(s.random, small, 26 / step, 120 / step),
          fine = noise_field(s.random, small, 5 / step, 34 / step);
  cv::Mat hair = noise_field(s.random, small, 1.2 / step, 9 / step);
  cv::Mat radius(small, CV_32FC1);
  for (int r = 0; r < small.height; ++r) {
    const double v = r * step;
    const double u0 = pith_u + wander_u * pith_wander.at(v / 90);
    double d = depth + std::abs(tilt) * height / 2 + tilt * (v - height / 2) + wander_d * depth_wander.at(v / 70);
    auto* row = radius.ptr<float>(r);
    for (int c = 0; c < small.width; ++c) {
      const double u = c * step - u0;
      row[c] = static_cast<float>(std::sqrt(u * u + d * d) + 0.9 * large.at<float>(r, c) + 0.22 * fine.at<float>(r, c) +
                                  0.05 * hair.at<float>(r, c) + 4.0);
    }
  }
  cv::Mat grown;
  cv::resize(radius, grown, cv::Size(small.width * coarse, small.height * coarse), 0, 0, cv::INTER_LINEAR);
  s.radius = grown(cv::Rect(cv::Point(0, 0), s.size));
}

// Tables over the radius: how dark each ring is at each of its places, and how likely a pore stands there.
void grow_rings(Strip& s) {
  double most = 0;
  cv::minMaxLoc(s.radius, nullptr, &most);
  const auto entries = static_cast<std::size_t>(most / kRadiusStep) + 64;
  s.ring_tone.resize(entries), s.porosity.resize(entries);
  const WoodSpecies& w = s.wood;
  const double mean = w.ring_width * s.random.uniform(0.8, 1.25);
  const int count = static_cast<int>(most / (mean * 0.3)) + 8;
  LineNoise years(s.random, count), weight(s.random, count * 2), band(s.random, count * 4),
      fine_band(s.random, count * 8);
  double inner = 0, ring = mean, strength = 1;
  int year = 0;
  for (std::size_t i = 0; i < entries; ++i) {
    const double r = static_cast<double>(i) * kRadiusStep;
    while (r >= inner + ring) {
      inner += ring, ++year;
      ring = mean * std::clamp(1 + w.ring_variation * (years.at(year * 0.45) + 0.5 * s.random.spread(1)), 0.35, 2.2);
      strength = std::clamp(0.85 + 0.5 * weight.at(year) + 0.25 * s.random.spread(1), 0.25, 1.6);
    }
    const double t = (r - inner) / ring;  // 0 = spring, 1 = autumn
    double tone = 0, pores = 1;
    if (w.pores == PoreKind::kRingPorous) {
      const double spring = 1 - smoothstep(w.ring_edge * 0.7, w.ring_edge * 1.5, t);
      tone = spring * 0.75 + 0.25 * t;
      pores = spring * 1.0 + 0.05;
    } else {
      const double line = smoothstep(1 - w.ring_edge * 2.2, 1 - w.ring_edge * 0.4, t) * (1 - smoothstep(0.985, 1.0, t));
      tone = 0.35 * t * t + 0.65 * line;
      pores = 0.6 + 0.4 * (1 - t);
    }
    double bands = band.at(r / w.band_width) + 0.45 * fine_band.at(r / w.band_width * 2.7);
    bands = w.band_sharpness > 1 ? std::tanh(bands * w.band_sharpness) : bands;
    s.ring_tone[i] = static_cast<float>(w.ring_contrast * strength * (tone - 0.3) + w.band_contrast * bands * 0.6);
    s.porosity[i] = static_cast<float>(pores);
  }
}

// One vessel or ray: a spindle along the grain, `length` by `width` pixels.
void draw_spindle(cv::Mat& layer, double x, double y, double length, double width, double darkness) {
  const int top = std::max(0, static_cast<int>(y)), bottom = std::min(layer.rows - 1, static_cast<int>(y + length));
  for (int r = top; r <= bottom; ++r) {
    const double along = (r + 0.5 - y) / length;
    const double half = 0.5 * width * std::sqrt(std::max(0.0, 4 * along * (1 - along)));
    const int left = std::max(0, static_cast<int>(std::floor(x - half - 0.5)));
    const int right = std::min(layer.cols - 1, static_cast<int>(std::ceil(x + half + 0.5)));
    auto* row = layer.ptr<unsigned char>(r);
    for (int c = left; c <= right; ++c) {
      const double cover = std::clamp(half + 0.5 - std::abs(c + 0.5 - x), 0.0, 1.0) * std::min(1.0, 2 * half + 0.25);
      const double value = 255 * darkness * cover;
      if (value > row[c]) row[c] = static_cast<unsigned char>(value);
    }
  }
}

void scatter(Strip& s, double density, double length_mm, double width_mm, double darkness, bool follow_rings) {
  const double area = s.size.area() / (s.px * s.px);
  const auto count = static_cast<int>(area * density);
  for (int i = 0; i < count; ++i) {
    const double x = s.random.uniform(0, s.size.width), y = s.random.uniform(-length_mm * s.px, s.size.height);
    const double chance = s.random.uniform(), stretch = s.random.uniform(0.35, 1.7), thick = s.random.uniform(0.6, 1.3);
    const double dark = darkness * s.random.uniform(0.45, 1.0);
    if (follow_rings) {
      const int r = std::clamp(static_cast<int>(y + length_mm * s.px / 2), 0, s.size.height - 1);
      const auto entry = static_cast<std::size_t>(s.radius.at<float>(r, static_cast<int>(x)) / kRadiusStep);
      if (chance > s.porosity[std::min(entry, s.porosity.size() - 1)]) continue;
    }
    draw_spindle(s.pores, x, y, length_mm * stretch * s.px, width_mm * thick * s.px, dark);
  }
}

std::vector<cv::Vec3f> spread_palette(const std::vector<cv::Vec3b>& stops) {
  std::vector<cv::Vec3f> table(1024);
  const auto last = static_cast<double>(stops.size() - 1);
  for (std::size_t i = 0; i < table.size(); ++i) {
    const double p = static_cast<double>(i) / 1023 * last;
    const auto k = std::min(static_cast<std::size_t>(p), stops.size() - 2);
    const auto t = static_cast<float>(p - static_cast<double>(k));
    table[i] = cv::Vec3f(stops[k]) * (1 - t) + cv::Vec3f(stops[k + 1]) * t;
  }
  return table;
}

// Flame figure: bands of light and shade across the grain, strong here and faint there.
cv::Mat curl_figure(Strip& s) {
  const int coarse = 4;
  const cv::Size small(s.size.width / coarse + 2, s.size.height / coarse + 2);
  const double px = s.px / coarse;
  const cv::Mat bend = noise_field(s.random, small, 9 * px, 26 * px),
                sway = noise_field(s.random, small, 22 * px, 50 * px);
  const cv::Mat strength = noise_field(s.random, small, 16 * px, 45 * px);
  cv::Mat out(small, CV_32FC1);
  for (int r = 0; r < small.height; ++r) {
    for (int c = 0; c < small.width; ++c) {
      const double phase = r / px / s.wood.curl_length + 0.55 * bend.at<float>(r, c) + 1.4 * sway.at<float>(r, c);
      const double wave = std::sin(2 * kPi * phase) + 0.3 * std::sin(2 * kPi * 2.1 * phase + 1);
      out.at<float>(r, c) = static_cast<float>(s.wood.curl * wave * smoothstep(-0.5, 0.6, strength.at<float>(r, c)));
    }
  }
  cv::Mat grown;
  cv::resize(out, grown, cv::Size(small.width * coarse, small.height * coarse), 0, 0, cv::INTER_LINEAR);
  return grown(cv::Rect(cv::Point(0, 0), s.size));
}

// Medullary rays cut along their length: light ribbons lying across the grain.
cv::Mat silver_figure(Strip& s) {
  const cv::Mat ribbons = s.field(4.5, 1.1), patches = s.field(10, 22);
  cv::Mat out(s.size, CV_32FC1);
  for (int r = 0; r < s.size.height; ++r) {
    for (int c = 0; c < s.size.width; ++c) {
      const double value = ribbons.at<float>(r, c) + 0.35 * patches.at<float>(r, c);
      out.at<float>(r, c) = static_cast<float>(0.28 * s.wood.silver * smoothstep(0.42, 0.60, value));
    }
  }
  return out;
}

cv::Mat paint(Strip& s) {
  const WoodSpecies& w = s.wood;
  const std::vector<cv::Vec3f> palette = spread_palette(w.palette);
  const cv::Mat fibre = s.field(0.13, 7), thread = s.field(0.4, 30), streak = s.field(2.2, 130), wide = s.field(9, 260);
  const cv::Mat mottle = s.field(3.5, 6), hue = s.field(14, 80);
  const cv::Mat curl = w.curl > 0 ? curl_figure(s) : cv::Mat();
  const cv::Mat silver = w.silver > 0 && !s.flat ? silver_figure(s) : cv::Mat();
  cv::Mat out(s.size, CV_8UC3);
  for (int r = 0; r < s.size.height; ++r) {
    const auto *radius = s.radius.ptr<float>(r), *f = fibre.ptr<float>(r), *th = thread.ptr<float>(r),
               *st = streak.ptr<float>(r);
    const auto *wi = wide.ptr<float>(r), *mo = mottle.ptr<float>(r), *hu = hue.ptr<float>(r);
    const auto* po = s.pores.ptr<unsigned char>(r);
    const auto *cu = curl.empty() ? nullptr : curl.ptr<float>(r), *si = silver.empty() ? nullptr : silver.ptr<float>(r);
    auto* row = out.ptr<cv::Vec3b>(r);
    for (int c = 0; c < s.size.width; ++c) {
      const auto entry = std::min(static_cast<std::size_t>(radius[c] / kRadiusStep), s.ring_tone.size() - 1);
      double tone = s.tone + s.ring_tone[entry];
      tone += w.fibre_contrast * (0.7 * f[c] + 0.6 * th[c]) + w.streak_contrast * (0.6 * st[c] + 0.6 * wi[c]);
      tone += w.mottle_contrast * mo[c];
      double light = 1;
      if (cu != nullptr) light += cu[c];
      if (si != nullptr) tone -= si[c];
      const double pore = po[c] / 255.0;
      const cv::Vec3f& colour =
          palette[static_cast<std::size_t>(std::clamp(tone, 0.0, 1.0) * 1023)];  // a pore is brown, not grey
      const double warm = w.hue_spread * hu[c];
      row[c] = {cv::saturate_cast<unsigned char>(colour[0] * light * (1 - 1.3 * warm) * (1 - pore * 1.12)),
                cv::saturate_cast<unsigned char>(colour[1] * light * (1 + 0.3 * warm) * (1 - pore * 1.02)),
                cv::saturate_cast<unsigned char>(colour[2] * light * (1 + warm) * (1 - pore * 0.86))};
    }
  }
  return out;
}

// Grain is never quite straight.
cv::Mat bend_grain(Strip& s, const cv::Mat& straight) {
  const int coarse = 8;
  const cv::Size small(s.size.width / coarse + 2, s.size.height / coarse + 2);
  const double px = s.px / coarse;
  const cv::Mat slow = noise_field(s.random, small, 45 * px, 110 * px),
                quick = noise_field(s.random, small, 14 * px, 38 * px);
  cv::Mat shift = (1.6 * slow + 0.35 * quick) * s.px, grown;
  cv::resize(shift, grown, cv::Size(small.width * coarse, small.height * coarse), 0, 0, cv::INTER_LINEAR);
  cv::Mat map_x(s.size, CV_32FC1), map_y(s.size, CV_32FC1), out;
  for (int r = 0; r < s.size.height; ++r) {
    for (int c = 0; c < s.size.width; ++c) {
      map_x.at<float>(r, c) = static_cast<float>(c) + grown.at<float>(r, c);
      map_y.at<float>(r, c) = static_cast<float>(r);
    }
  }
  cv::remap(straight, out, map_x, map_y, cv::INTER_LINEAR, cv::BORDER_REFLECT_101);
  return out;
}

}  // namespace

cv::Mat grow_wood(const WoodSpecies& species, cv::Size size, double px_per_mm, std::uint64_t seed) {
  Strip s{species, size, px_per_mm, Random(seed, species.name), true, 0, {}, {}, {}, {}};
  s.tone = species.tone + s.random.spread(species.tone_spread);
  cut_log(s);
  grow_rings(s);
  s.pores = cv::Mat::zeros(size, CV_8UC1);
  scatter(s, species.pore_density, species.pore_length, species.pore_width, species.pore_darkness,
          species.pores == PoreKind::kRingPorous);
  if (species.ray_density > 0) {
    scatter(s, species.ray_density, species.ray_length, species.ray_width, species.ray_darkness, false);
  }
  return bend_grain(s, paint(s));
}

cv::Mat draw_swatches(std::uint64_t seed) {
  const double px = 8;
  const int width = 360, height = 1000, gap = 14;
  const auto& all = wood_species();
  cv::Mat sheet(2 * height + 3 * gap, static_cast<int>(all.size()) * (width + gap) + gap, CV_8UC3,
                cv::Scalar(122, 118, 114));
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (int row = 0; row < 2; ++row) {
      const cv::Rect place(gap + static_cast<int>(i) * (width + gap), gap + row * (height + gap), width, height);
      grow_wood(all[i], place.size(), px, seed + static_cast<std::uint64_t>(row)).copyTo(sheet(place));
    }
  }
  return sheet;
}

}  // namespace veneer::sim
