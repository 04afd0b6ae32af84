#include "drivers/sim/proof/burn_raster.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace veneer::proof {
namespace {

// Widens [low, high] by the part of the line at height y that lies within radius of c.
void add_disc(double y, Vec2 c, double radius, double& low, double& high) {
  const double dy = y - c.y;
  const double half_sqr = radius * radius - dy * dy;
  if (half_sqr < 0) return;
  const double half = std::sqrt(half_sqr);
  low = std::min(low, c.x - half);
  high = std::max(high, c.x + half);
}

void add_edge(double y, Vec2 a, Vec2 b, double& low, double& high) {
  if ((a.y > y) == (b.y > y)) return;
  const double x = a.x + (b.x - a.x) * (y - a.y) / (b.y - a.y);
  low = std::min(low, x);
  high = std::max(high, x);
}

void fill_row(cv::Mat& mask, int row, double low, double high, unsigned char value) {
  const int first = std::max(0, static_cast<int>(std::ceil(low - 0.5)));
  const int last = std::min(mask.cols - 1, static_cast<int>(std::floor(high - 0.5)));
  if (last >= first) std::fill(mask.ptr(row) + first, mask.ptr(row) + last + 1, value);
}

}  // namespace

Window Window::around(Vec2 lower_left, Vec2 upper_right, double margin_mm, double px_per_mm) {
  Window w;
  w.px_per_mm = px_per_mm;
  w.left = lower_left.x - margin_mm;
  w.top = upper_right.y + margin_mm;
  w.columns = static_cast<int>(std::ceil((upper_right.x + margin_mm - w.left) * px_per_mm));
  w.rows = static_cast<int>(std::ceil((w.top - lower_left.y + margin_mm) * px_per_mm));
  return w;
}

void fill_capsule(cv::Mat& mask, Vec2 a, Vec2 b, double radius, unsigned char value) {
  const double top = std::min(a.y, b.y) - radius;
  const double bottom = std::max(a.y, b.y) + radius;
  const int first = std::max(0, static_cast<int>(std::ceil(top - 0.5)));
  const int last = std::min(mask.rows - 1, static_cast<int>(std::floor(bottom - 0.5)));
  const double length = sim::length(b - a);
  const Vec2 side = length > 0 ? Vec2{-(b.y - a.y), b.x - a.x} * (radius / length) : Vec2{};
  for (int row = first; row <= last; ++row) {
    const double y = row + 0.5;
    double low = std::numeric_limits<double>::max();
    double high = std::numeric_limits<double>::lowest();
    add_disc(y, a, radius, low, high);
    add_disc(y, b, radius, low, high);
    if (length > 0) {
      add_edge(y, a + side, b + side, low, high);
      add_edge(y, a - side, b - side, low, high);
    }
    if (low <= high) fill_row(mask, row, low, high, value);
  }
}

void fill_ring(cv::Mat& mask, const std::vector<Vec2>& ring, unsigned char value) {
  if (ring.size() < 3) return;
  double top = std::numeric_limits<double>::max();
  double bottom = std::numeric_limits<double>::lowest();
  for (const Vec2& p : ring) {
    top = std::min(top, p.y);
    bottom = std::max(bottom, p.y);
  }
  const int first = std::max(0, static_cast<int>(std::ceil(top - 0.5)));
  const int last = std::min(mask.rows - 1, static_cast<int>(std::floor(bottom - 0.5)));
  if (last < first) return;
  std::vector<std::vector<double>> crossings(static_cast<std::size_t>(last - first + 1));
  for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++) {
    const Vec2 a = ring[j].y < ring[i].y ? ring[j] : ring[i];
    const Vec2 b = ring[j].y < ring[i].y ? ring[i] : ring[j];
    const int from = std::max(first, static_cast<int>(std::ceil(a.y - 0.5)));
    for (int row = from; row <= last && row + 0.5 < b.y; ++row)
      crossings[static_cast<std::size_t>(row - first)].push_back(a.x + (b.x - a.x) * (row + 0.5 - a.y) / (b.y - a.y));
  }
  for (std::size_t k = 0; k < crossings.size(); ++k) {
    std::sort(crossings[k].begin(), crossings[k].end());
    for (std::size_t i = 0; i + 1 < crossings[k].size(); i += 2)
      fill_row(mask, first + static_cast<int>(k), crossings[k][i], crossings[k][i + 1], value);
  }
}

BurnIndex::BurnIndex(const sim::Sheet& sheet) {
  for (const sim::TrueBurn& burn : sheet.burns) {
    if (burn.points.empty()) continue;
    Entry entry{&burn, burn.points.front(), burn.points.front()};
    for (const Vec2& p : burn.points) {
      entry.low = {std::min(entry.low.x, p.x), std::min(entry.low.y, p.y)};
      entry.high = {std::max(entry.high.x, p.x), std::max(entry.high.y, p.y)};
    }
    const double widest = (burn.width_mm + burn.oval_mm) / 2;
    const Vec2 half{widest, widest};
    entry.low = entry.low - half;
    entry.high = entry.high + half;
    entries_.push_back(entry);
  }
}

void BurnIndex::draw(const Entry& entry, double narrower_mm, const Window& window, cv::Mat& mask, unsigned char value) {
  const Vec2 low = window.pixel({entry.low.x, entry.high.y});
  const Vec2 high = window.pixel({entry.high.x, entry.low.y});
  if (high.x < 0 || high.y < 0 || low.x > window.columns || low.y > window.rows) return;
  const auto& points = entry.burn->points;
  const auto radius = [&](Vec2 way) {
    const double length = sim::length(way), along_y = length > 0 ? way.y / length : 0;
    const double width = entry.burn->width_mm + entry.burn->oval_mm * along_y * along_y - narrower_mm;
    return std::max(0.0, width / 2 * window.px_per_mm);
  };
  Vec2 last = window.pixel(points.front());
  if (points.size() == 1) fill_capsule(mask, last, last, radius({}), value);
  for (std::size_t i = 1; i < points.size(); ++i) {
    const Vec2 next = window.pixel(points[i]);
    fill_capsule(mask, last, next, radius(points[i] - points[i - 1]), value);
    last = next;
  }
}

void BurnIndex::draw_through(const Window& window, cv::Mat& mask, unsigned char value) const {
  for (const Entry& entry : entries_)
    if (entry.burn->depth == sim::BurnDepth::kThrough) draw(entry, entry.burn->taper_mm, window, mask, value);
}

void BurnIndex::draw_cut_at_its_widest(const Window& window, cv::Mat& mask, unsigned char value) const {
  for (const Entry& entry : entries_)
    if (entry.burn->depth == sim::BurnDepth::kThrough) draw(entry, 0, window, mask, value);
}

void BurnIndex::draw_engraved(const Window& window, sim::SheetFace face, cv::Mat& mask, unsigned char value) const {
  for (const Entry& entry : entries_)
    if (entry.burn->depth == sim::BurnDepth::kEngrave && entry.burn->face == face) draw(entry, 0, window, mask, value);
}

bool BurnIndex::bounds(Vec2& lower_left, Vec2& upper_right) const {
  if (entries_.empty()) return false;
  lower_left = entries_.front().low;
  upper_right = entries_.front().high;
  for (const Entry& entry : entries_) {
    lower_left = {std::min(lower_left.x, entry.low.x), std::min(lower_left.y, entry.low.y)};
    upper_right = {std::max(upper_right.x, entry.high.x), std::max(upper_right.y, entry.high.y)};
  }
  return true;
}

}  // namespace veneer::proof
