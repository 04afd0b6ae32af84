#include "db/wood_parts.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace veneer::db {
namespace {

constexpr double kRoundingUm = 3;
// The middles of so many edges tell how wide the band is.
constexpr std::size_t kMeasured = 48;

struct Place {
  double x = 0, y = 0;
};

double distance_to(const Place& p, const MicroPoint& from, const MicroPoint& to) {
  const double ax = static_cast<double>(from.x_um) - p.x, ay = static_cast<double>(from.y_um) - p.y;
  const double dx = static_cast<double>(to.x_um - from.x_um), dy = static_cast<double>(to.y_um - from.y_um);
  const double length2 = dx * dx + dy * dy;
  const double along = length2 > 0 ? std::clamp(-(ax * dx + ay * dy) / length2, 0.0, 1.0) : 0.0;
  return std::hypot(ax + along * dx, ay + along * dy);
}

double distance_to(const Place& p, const MicroArea& border) {
  double nearest = HUGE_VAL;
  for (const MicroRing& ring : border.rings)
    for (std::size_t i = 0; i < ring.size(); ++i)
      nearest = std::min(nearest, distance_to(p, ring[i], ring[(i + 1) % ring.size()]));
  return nearest;
}

// The median: a lead-in, and a border of the panel that cuts the area off, are beside a few edges only.
double width_of_band(const MicroArea& area, const MicroRing& outline) {
  const std::size_t step = outline.size() / kMeasured + 1;
  std::vector<double> widths;
  for (std::size_t i = 0; i < outline.size(); i += step) {
    const MicroPoint &from = outline[i], &to = outline[(i + 1) % outline.size()];
    const Place middle{static_cast<double>(from.x_um + to.x_um) / 2, static_cast<double>(from.y_um + to.y_um) / 2};
    widths.push_back(distance_to(middle, area));
  }
  const auto median = widths.begin() + static_cast<std::ptrdiff_t>(widths.size() / 2);
  std::nth_element(widths.begin(), median, widths.end());
  return *median;
}

}  // namespace

MicroArea lead_in_of(const MicroArea& area, const MicroRing& outline) {
  if (outline.empty() || area.empty()) return {};
  const MicroArea band =
      micro::offset(micro::unite(MicroArea{{outline}}, {}), width_of_band(area, outline) + kRoundingUm, false);
  return micro::subtract(area, band);
}

MicroArea kerf_of(const MicroArea& area, const MicroRing& outline, const MicroArea& lead_in) {
  if (outline.empty()) return {};
  return micro::subtract(micro::subtract(area, MicroArea{{outline}}), lead_in);
}

}  // namespace veneer::db
