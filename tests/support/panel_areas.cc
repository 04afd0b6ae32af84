#include "tests/support/panel_areas.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

namespace veneer::testing {
namespace {

using nlohmann::json;

struct Place {
  double x = 0, y = 0;
};
using Ring = std::vector<Place>;
struct Window {
  double left = 0, bottom = 0, right = 0, top = 0;
  double area() const { return std::max(0.0, right - left) * std::max(0.0, top - bottom); }
};

Ring ring_of(const json& points) {
  Ring out;
  for (const json& point : points) out.push_back({point[0].get<double>(), point[1].get<double>()});
  return out;
}

// Positive for a ring that is counter-clockwise: holes take their area away.
double signed_area(const Ring& ring) {
  double twice = 0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Place &a = ring[i], &b = ring[(i + 1) % ring.size()];
    twice += a.x * b.y - b.x * a.y;
  }
  return twice / 2;
}

// Of a ring what is on one side of a line, `inside` being how far a place is beyond it (Sutherland and Hodgman). Where
// a ring comes to lie in two parts they hang together by a line along the border, which has no area.
template <class Inside>
Ring clipped(const Ring& ring, const Inside& inside) {
  Ring out;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Place &a = ring[i], &b = ring[(i + 1) % ring.size()];
    const double at_a = inside(a), at_b = inside(b);
    if (at_a >= 0) out.push_back(a);
    if ((at_a > 0 && at_b < 0) || (at_a < 0 && at_b > 0)) {
      const double share = at_a / (at_a - at_b);
      out.push_back({a.x + share * (b.x - a.x), a.y + share * (b.y - a.y)});
    }
  }
  return out;
}
Ring clipped_up(const Ring& ring, double bottom, double top) {
  const Ring above = clipped(ring, [&](const Place& p) { return p.y - bottom; });
  return clipped(above, [&](const Place& p) { return top - p.y; });
}
Ring clipped_across(const Ring& ring, double left, double right) {
  const Ring behind = clipped(ring, [&](const Place& p) { return p.x - left; });
  return clipped(behind, [&](const Place& p) { return right - p.x; });
}
double area_within(const std::vector<Ring>& rings, const Window& window) {
  double sum = 0;
  for (const Ring& ring : rings)
    sum += signed_area(clipped_across(clipped_up(ring, window.bottom, window.top), window.left, window.right));
  return sum;
}

struct Wood {
  std::vector<Ring> rings;
  double bottom = 0, top = 0;
};

// Runs of like pixels of the panel, row by row; `see` gets each, and whether it is usable.
template <class See>
void see_runs(const cv::Mat& mask, double pixel_mm, double width_mm, double height_mm, const See& see) {
  for (int row = 0; row < mask.rows; ++row) {
    const double bottom = (mask.rows - row - 1) * pixel_mm, top = std::min(bottom + pixel_mm, height_mm);
    if (bottom >= height_mm) continue;
    const auto* pixels = mask.ptr<unsigned char>(row);
    for (int from = 0, column = 1; column <= mask.cols; ++column) {
      if (column < mask.cols && (pixels[column] != 0) == (pixels[from] != 0)) continue;
      const Window run{from * pixel_mm, bottom, std::min(column * pixel_mm, width_mm), top};
      if (run.left < run.right) see(run, pixels[from] != 0);
      from = column;
    }
    // What the mask does not reach is not usable.
    if (mask.cols * pixel_mm < width_mm) see(Window{mask.cols * pixel_mm, bottom, width_mm, top}, false);
  }
  if (mask.rows * pixel_mm < height_mm) see(Window{0, mask.rows * pixel_mm, width_mm, height_mm}, false);
}

}  // namespace

PanelAreas count_areas(const json& allocations, const cv::Mat& mask, double pixel_mm, double width_mm,
                       double height_mm) {
  PanelAreas out{{"panel", width_mm * height_mm}};
  for (const char* name : {"free", "reserved", "cut", "kerf", "suspect", "scrap", "unusable"}) out[name] = 0;
  const Window panel{0, 0, width_mm, height_mm};
  std::vector<Wood> booked;
  for (const json& allocation : allocations) {
    const std::string state = allocation["state"];
    if (state == "released") continue;
    Wood& wood = booked.emplace_back(Wood{{}, height_mm, 0});
    for (const json& points : allocation["allocation_mm"]) {
      const Ring& ring = wood.rings.emplace_back(ring_of(points));
      for (const Place& place : ring)
        wood.bottom = std::min(wood.bottom, place.y), wood.top = std::max(wood.top, place.y);
    }
    const double whole = area_within(wood.rings, panel);
    if (state == "cut") {
      const Ring piece = ring_of(allocation["outline_mm"]);
      const double its = std::abs(area_within({piece}, panel));
      out["cut"] += its;
      out["kerf"] += whole - its;  // the band around it
    } else {
      out[state == "suspect" || state == "scrap" ? state : "reserved"] += whole;
    }
  }
  see_runs(mask, pixel_mm, width_mm, height_mm, [&](const Window& run, bool usable) {
    double taken = 0;
    for (const Wood& wood : booked)
      if (wood.bottom < run.top && wood.top > run.bottom) taken += area_within(wood.rings, run);
    out[usable ? "free" : "unusable"] += run.area() - taken;
  });
  return out;
}

std::string disagreement(const json& book, const PanelAreas& counted, double within_mm2) {
  double told = 0, found = 0;
  for (const auto& [name, area] : counted) {
    if (!book.is_object() || !book.contains(name) || !book[name].is_number())
      return fmt::format("the area book does not tell what is {}", name);
    const double says = book[name];
    if (!(std::abs(says - area) <= within_mm2))
      return fmt::format("of what is {} the area book says {:.6f} mm2, and a count {:.6f}", name, says, area);
    if (!(says >= -within_mm2)) return fmt::format("the area book says that {:.6f} mm2 are {}", says, name);
    if (name != "panel") told += says, found += area;
  }
  const double panel = counted.at("panel");
  if (!(std::abs(told - panel) <= 1e-6))
    return fmt::format("the area book's classes are {:.7f} mm2 of a panel of {:.7f}", told, panel);
  if (!(std::abs(found - panel) <= within_mm2))
    return fmt::format("what was counted is {:.7f} mm2 of a panel of {:.7f}: wood is booked twice", found, panel);
  return "";
}

}  // namespace veneer::testing
