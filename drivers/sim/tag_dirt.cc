#include "drivers/sim/tag_dirt.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <vector>

#include "base/units.h"
#include "drivers/sim/noise.h"
#include "drivers/sim/tag_picture.h"

namespace veneer::sim {
namespace {

Vec2 centre_of(const TrueTag& tag) { return (tag.corners[0] + tag.corners[2]) * 0.5; }

// Lays `colour` over the face around `centre`: opaque by cover(distance from it in mm, both ways), 0 to 1.
template <class Cover>
void lay_dirt(Sheet& sheet, SheetFace face, Vec2 centre, double reach_mm, cv::Vec3f colour, const Cover& cover) {
  cv::Mat& raster = face == SheetFace::kShow ? sheet.front : sheet.back;
  const Vec2 low = sheet.pixel(centre + Vec2{-reach_mm, reach_mm}),
             high = sheet.pixel(centre + Vec2{reach_mm, -reach_mm});
  for (int r = std::max(0, static_cast<int>(low.y)); r < std::min(raster.rows, static_cast<int>(high.y)); ++r) {
    for (int c = std::max(0, static_cast<int>(low.x)); c < std::min(raster.cols, static_cast<int>(high.x)); ++c) {
      const auto a = static_cast<float>(std::clamp(cover(sheet.mm({c + 0.5, r + 0.5}) - centre), 0.0, 1.0));
      if (a <= 0) continue;
      auto& pixel = raster.at<cv::Vec3b>(r, c);
      for (int k = 0; k < 3; ++k)
        pixel[k] = cv::saturate_cast<unsigned char>(static_cast<float>(pixel[k]) * (1 - a) + colour[k] * a);
    }
  }
}

// A blot with a wavy rim.
void blot(Sheet& sheet, SheetFace face, Vec2 at, double radius, const cv::Vec3f& colour, double opaque,
          Random& random) {
  const double lobes = 3 + random.below(4), phase = random.uniform(0, 2 * kPi);
  lay_dirt(sheet, face, at, radius * 1.4, colour, [=](Vec2 d) {
    const double rim = radius * (1 + 0.25 * std::sin(lobes * std::atan2(d.y, d.x) + phase));
    return opaque * std::clamp((rim - length(d)) / (0.3 * radius) + 0.5, 0.0, 1.0);
  });
}

// A strip of masking tape over one half.
void paste_over(Sheet& sheet, const TrueTag& tag, Random& random) {
  const double way = random.uniform(0, 2 * kPi), c = std::cos(way), s = std::sin(way);
  lay_dirt(sheet, tag.face, centre_of(tag), 14, {150, 205, 226}, [=](Vec2 d) {
    const double across = c * d.x + s * d.y, along = -s * d.x + c * d.y;
    return across > 0 && across < 12 && std::abs(along) < 13 ? 0.97 : 0.0;
  });
}

std::vector<TrueTag> tags_of(const Sheet& sheet, SheetFace face) {
  std::vector<TrueTag> out;
  std::copy_if(sheet.tags.begin(), sheet.tags.end(), std::back_inserter(out),
               [face](const TrueTag& tag) { return tag.face == face; });
  return out;
}

}  // namespace

void soil_tags(Sheet& sheet, double amount, std::uint64_t seed) {
  if (amount <= 0) return;
  Random random(seed, "dirt");
  for (const SheetFace face : {SheetFace::kShow, SheetFace::kBack}) {
    const std::vector<TrueTag> tags = tags_of(sheet, face);
    if (tags.empty()) continue;
    const int covered = random.below(static_cast<int>(tags.size()));
    for (int i = 0; i < static_cast<int>(tags.size()); ++i) {
      const TrueTag& tag = tags[static_cast<std::size_t>(i)];
      const bool stained = random.uniform() < amount, scorched = random.uniform() < amount / 2;
      const Vec2 near = centre_of(tag) + Vec2{random.spread(8), random.spread(8)};
      const double radius = random.uniform(1, 3.5);
      const Vec2 beside{random.spread(1), random.spread(1)};
      const Vec2 corner = tag.corners[static_cast<std::size_t>(random.below(4))] + beside;
      if (stained) blot(sheet, face, near, radius, {60, 100, 130}, 0.35, random);
      if (scorched) blot(sheet, face, corner, radius * 0.5, {20, 26, 34}, 0.9, random);
      if (amount >= 0.5 && i == covered) paste_over(sheet, tag, random);
    }
  }
}

void slip_one_tag(Sheet& sheet, SheetFace face, double by_mm, Random& random) {
  const std::vector<TrueTag> tags = tags_of(sheet, face);
  if (tags.empty()) return;
  const TrueTag& tag = tags[static_cast<std::size_t>(random.below(static_cast<int>(tags.size())))];
  const double way = random.uniform(0, 2 * kPi);
  const Vec2 edge = tag.corners[1] - tag.corners[0];
  TagPlace place{tag.id, face, centre_of(tag) + Vec2{std::cos(way), std::sin(way)} * by_mm, 0, length(edge)};
  place.angle_rad = std::atan2(edge.y, face == SheetFace::kShow ? edge.x : -edge.x);
  // Printed on pictures of its own: others hold the same ones.
  cv::Mat& raster = face == SheetFace::kShow ? sheet.front : sheet.back;
  raster = raster.clone();
  print_tag(sheet, place);
  sheet.tags.pop_back();
}

}  // namespace veneer::sim
