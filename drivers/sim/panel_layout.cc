#include "drivers/sim/panel_layout.h"

#include <algorithm>
#include <cmath>

#include "base/units.h"
#include "drivers/sim/wood.h"

namespace veneer::sim {
namespace {

constexpr double kTagSquare = 14;
constexpr double kHoleDiameter = 6;

// Tags of one face in its margin, `across` counted as the face itself shows it.
void lay_tags(PanelLayout& layout, SheetFace face, double width, double height, Random& random) {
  const auto glue = [&](double across, double up) {
    TagPlace tag;
    tag.face = face;
    tag.angle_rad = degrees(random.spread(2)).count();
    tag.square_mm = kTagSquare * (1 + random.spread(0.003));
    across += random.spread(0.5), up += random.spread(0.5);
    tag.centre = {face == SheetFace::kShow ? across : width - across, up};
    layout.tags.push_back(tag);
  };
  const double edge = kBoardMargin / 2;
  const int row = std::max(2, static_cast<int>(std::lround((width - 60) / 95)));
  const double pitch = width / row, play = std::min(14.0, pitch / 4);
  for (int i = 0; i < row; ++i) glue(std::clamp((i + 0.42) * pitch + random.spread(play), 14.0, width - 14), edge);
  for (int i = 0; i < row; ++i)
    glue(std::clamp((i + 0.58) * pitch + random.spread(play), 14.0, width - 14), height - edge);
  const double middle = std::max(0.0, height / 2 - 50);
  glue(edge, height * 0.42 + random.spread(std::min(24.0, middle)));
  glue(width - edge, height * 0.60 + random.spread(std::min(24.0, middle)));
}

// All six distances between the four holes differ, so that no motion and no mirror can mistake one for another.
bool asymmetric(const std::vector<TrueHole>& holes) {
  std::vector<double> distances;
  for (std::size_t i = 0; i < holes.size(); ++i) {
    for (std::size_t k = i + 1; k < holes.size(); ++k) distances.push_back(length(holes[i].centre - holes[k].centre));
  }
  std::sort(distances.begin(), distances.end());
  for (std::size_t i = 1; i < distances.size(); ++i) {
    if (distances[i] - distances[i - 1] < 4) return false;
  }
  return distances.front() > 40;
}

void lay_holes(PanelLayout& layout, double width, double height, Random& random) {
  const auto is_clear = [&](Vec2 p) {
    return std::all_of(layout.tags.begin(), layout.tags.end(),
                       [&](const TagPlace& tag) { return length(tag.centre - p) > 18; });
  };
  for (int attempt = 0; attempt < 5000; ++attempt) {
    const double edge = random.uniform(9, 13);
    const std::vector<Vec2> places = {
        {random.uniform(12, width * 0.45), edge},
        {random.uniform(width * 0.5, width - 12), random.uniform(9, 13)},
        {random.uniform(width * 0.2, width * 0.8), height - random.uniform(9, 13)},
        {random.uniform() < 0.5 ? edge : width - edge, random.uniform(height * 0.25, height * 0.85)}};
    if (!std::all_of(places.begin(), places.end(), is_clear)) continue;
    layout.holes.clear();
    for (const Vec2& p : places) layout.holes.push_back({p, kHoleDiameter});
    if (asymmetric(layout.holes)) return;
  }
}

void lay_strips(PanelLayout& layout, double width, double height, int wanted, Random& random) {
  const double field = width - 2 * kBoardMargin;
  const int count = wanted > 0 ? wanted : std::clamp(static_cast<int>(std::lround(field / 45)), 6, 10);
  std::vector<std::string> order;
  while (static_cast<int>(order.size()) < count) {
    std::vector<std::string> round;
    for (const WoodSpecies& w : wood_species()) round.push_back(w.name);
    for (std::size_t i = round.size(); i > 1; --i)
      std::swap(round[i - 1], round[static_cast<std::size_t>(random.below(static_cast<int>(i)))]);
    order.insert(order.end(), round.begin(), round.end());
  }
  std::vector<double> shares;
  double total = 0;
  for (int i = 0; i < count; ++i) total += shares.emplace_back(random.uniform(0.86, 1.14));
  double left = 0, slant_left = random.spread(0.3);
  for (int i = 0; i < count; ++i) {
    const double gap = i + 1 < count ? random.uniform(1.0, 2.0) : 0;
    const double right = left + shares[static_cast<std::size_t>(i)] / total * field - gap;
    const double slant_right = random.spread(0.3);
    StripPlace strip{order[static_cast<std::size_t>(i)], kBoardMargin + left, kBoardMargin + left + slant_left,
                     kBoardMargin + right, kBoardMargin + right + slant_right};
    layout.strips.push_back(strip);
    const int screws = 1 + random.below(2);
    for (int k = 0; k < screws; ++k) {
      const double x = random.uniform(strip.left_low + 8, strip.right_low - 8);
      const double y = random.uniform(kBoardMargin + 15, height - kBoardMargin - 15);
      layout.screw_holes.push_back({{x, y}, random.uniform(3.8, 5.0)});
    }
    left = right + gap, slant_left = slant_right;
  }
}

}  // namespace

PanelLayout draw_layout(double width_mm, double height_mm, int strips, std::uint64_t seed) {
  Random random(seed, "layout");
  PanelLayout layout;
  lay_tags(layout, SheetFace::kShow, width_mm, height_mm, random);
  lay_tags(layout, SheetFace::kBack, width_mm, height_mm, random);
  lay_holes(layout, width_mm, height_mm, random);
  lay_strips(layout, width_mm, height_mm, strips, random);
  return layout;
}

}  // namespace veneer::sim
