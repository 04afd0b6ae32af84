#include "tests/support/panel_areas.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <optional>
#include <random>
#include <utility>

namespace veneer::testing {
namespace {

using nlohmann::json;

PlainRing ring_of(const json& points) {
  PlainRing out;
  for (const json& point : points) out.emplace_back(point[0].get<double>(), point[1].get<double>());
  return out;
}

// What wood of this state is where it is not within its piece's outline, and where it is.
std::string class_of(const std::string& state, bool within_outline) {
  if (state == "cut") return within_outline ? "cut" : "kerf";
  return state == "suspect" || state == "scrap" ? state : "reserved";
}

PanelAreas nothing_of(double panel_mm2) {
  PanelAreas out{{"panel", panel_mm2}};
  for (const char* name : {"free", "reserved", "cut", "kerf", "suspect", "scrap", "unusable"}) out[name] = 0;
  return out;
}

// By polygons.

// A line of a row's area or outline, from below to above.
struct Line {
  cv::Point2d low, high;
  std::size_t wood = 0;
  bool of_outline = false;
  double x_at(double y) const { return low.x + (y - low.y) * (high.x - low.x) / (high.y - low.y); }
};

std::vector<Line> lines_of(const std::vector<PlainWood>& wood) {
  std::vector<Line> out;
  const auto add = [&](const PlainRing& ring, std::size_t number, bool of_outline) {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const cv::Point2d &a = ring[i], &b = ring[(i + 1) % ring.size()];
      if (a.y == b.y) continue;  // nothing lies beside it
      out.push_back({a.y < b.y ? a : b, a.y < b.y ? b : a, number, of_outline});
    }
  };
  for (std::size_t i = 0; i < wood.size(); ++i) {
    if (wood[i].state == "released") continue;
    for (const PlainRing& ring : wood[i].area) add(ring, i, false);
    add(wood[i].outline, i, true);
  }
  std::ranges::sort(out, {}, [](const Line& line) { return line.low.y; });
  return out;
}

// Where two lines cross, if they do: between their ends.
std::optional<double> crossing(const Line& a, const Line& b) {
  const cv::Point2d along = a.high - a.low, other = b.high - b.low, between = b.low - a.low;
  const double cross = along.x * other.y - along.y * other.x;
  if (cross == 0) return std::nullopt;
  const double at = (between.x * other.y - between.y * other.x) / cross;
  const double there = (between.x * along.y - between.y * along.x) / cross;
  if (at <= 0 || at >= 1 || there <= 0 || there >= 1) return std::nullopt;
  return a.low.y + at * along.y;
}

// Rows of the panel that are alike: from each of `changes` on, which lie from left to right, it is usable or not.
struct Band {
  double bottom = 0, top = 0;
  std::vector<std::pair<double, bool>> changes;
};

std::vector<Band> bands_of(const PlainMask& mask, double width_mm, double height_mm) {
  std::vector<Band> out;
  const auto add = [&](Band band) {
    band.top = std::min(band.top, height_mm);
    if (band.bottom >= band.top) return;
    if (!out.empty() && out.back().changes == band.changes)
      out.back().top = band.top;
    else
      out.push_back(std::move(band));
  };
  for (int row = mask.pixels.rows - 1; row >= 0; --row) {
    Band band{(mask.pixels.rows - row - 1) * mask.pixel_mm, (mask.pixels.rows - row) * mask.pixel_mm, {}};
    const auto* const pixels = mask.pixels.ptr<unsigned char>(row);
    for (int column = 0; column < mask.pixels.cols && column * mask.pixel_mm < width_mm; ++column)
      if (const bool usable = pixels[column] != 0; band.changes.empty() || band.changes.back().second != usable)
        band.changes.emplace_back(column * mask.pixel_mm, usable);
    // What the mask does not reach is not usable.
    if (mask.pixels.cols * mask.pixel_mm < width_mm && band.changes.back().second)
      band.changes.emplace_back(mask.pixels.cols * mask.pixel_mm, false);
    add(std::move(band));
  }
  add({mask.pixels.rows * mask.pixel_mm, height_mm, {{0, false}}});
  return out;
}

// Between two heights no line ends or crosses another one: what lies between two neighbours is a trapezoid, as wide as
// it is in the middle.
class Slabs {
 public:
  Slabs(const std::vector<PlainWood>& wood, double width_mm, PanelAreas& out)
      : wood_(wood), width_(width_mm), out_(out), area_(wood.size()), outline_(wood.size()) {}

  void add(const Band& band, const std::vector<const Line*>& lines, double bottom, double top) {
    const double middle = (bottom + top) / 2;
    stops_.clear();
    for (const auto& [x, usable] : band.changes) stops_.push_back({x, nullptr, usable});
    for (const Line* line : lines)
      if (line->low.y < middle && line->high.y > middle) stops_.push_back({line->x_at(middle), line, false});
    std::ranges::sort(stops_, {}, &Stop::x);
    area_.assign(wood_.size(), false), outline_.assign(wood_.size(), false);
    inside_.clear();
    bool usable = false;
    for (std::size_t i = 0; i < stops_.size(); ++i) {
      const Stop& stop = stops_[i];
      if (stop.line == nullptr) {
        usable = stop.usable;
      } else if (stop.line->of_outline) {
        outline_[stop.line->wood] = !outline_[stop.line->wood];
      } else {
        area_[stop.line->wood] = !area_[stop.line->wood];
        if (area_[stop.line->wood])
          inside_.push_back(stop.line->wood);
        else
          std::erase(inside_, stop.line->wood);
      }
      const double from = std::max(stop.x, 0.0),
                   to = std::min(i + 1 < stops_.size() ? stops_[i + 1].x : width_, width_);
      if (to <= from) continue;
      const double area = (to - from) * (top - bottom);
      if (inside_.empty()) out_[usable ? "free" : "unusable"] += area;
      for (const std::size_t number : inside_) out_[class_of(wood_[number].state, outline_[number])] += area;
    }
  }

 private:
  struct Stop {
    double x = 0;
    const Line* line = nullptr;  // none: the mask changes
    bool usable = false;
  };
  const std::vector<PlainWood>& wood_;
  const double width_;
  PanelAreas& out_;
  std::vector<Stop> stops_;
  std::vector<bool> area_, outline_;  // of each row: are we in it
  std::vector<std::size_t> inside_;
};

// By points.

struct Cells {
  Cells(double width_mm, double height_mm) {
    constexpr double kLargest = 0.05, kFewest = 1e6;
    const double step = std::min(kLargest, std::sqrt(width_mm * height_mm / kFewest));
    columns = static_cast<int>(std::ceil(width_mm / step)), rows = static_cast<int>(std::ceil(height_mm / step));
    width = width_mm / columns, height = height_mm / rows;
  }
  double area() const { return width * height; }
  // How many a straight line may cross at most.
  double crossed_by(const cv::Point2d& line) const {
    return std::ceil(std::abs(line.x) / width) + std::ceil(std::abs(line.y) / height) + 1;
  }

  int columns, rows;
  double width, height;
};

// Of its area and outline.
cv::Rect2d box_of(const PlainWood& wood) {
  double left = HUGE_VAL, right = -HUGE_VAL, low = HUGE_VAL, high = -HUGE_VAL;
  const auto add = [&](const PlainRing& ring) {
    for (const cv::Point2d& p : ring) {
      left = std::min(left, p.x), right = std::max(right, p.x);
      low = std::min(low, p.y), high = std::max(high, p.y);
    }
  };
  for (const PlainRing& ring : wood.area) add(ring);
  add(wood.outline);
  return left > right ? cv::Rect2d() : cv::Rect2d(left, low, right - left, high - low);
}

bool is_usable(const PlainMask& mask, const cv::Point2d& place) {
  const int column = static_cast<int>(place.x / mask.pixel_mm);
  const int row = mask.pixels.rows - 1 - static_cast<int>(place.y / mask.pixel_mm);
  return row >= 0 && column < mask.pixels.cols && mask.pixels.at<unsigned char>(row, column) != 0;
}

// Each class to what is `within` its name.
std::string disagreement(const json& book, const PanelAreas& counted, const PanelAreas& within) {
  const double panel = counted.at("panel");
  double told = 0, found = 0;
  for (const auto& [name, area] : counted)
    if (name != "panel") found += area;
  if (!(std::abs(found - panel) <= within.at("panel")))
    return fmt::format("what was counted is {:.7f} mm2 of a panel of {:.7f}: wood is booked twice", found, panel);
  for (const auto& [name, area] : counted) {
    const double within_mm2 = within.at(name);
    if (!book.is_object() || !book.contains(name) || !book[name].is_number())
      return fmt::format("the area book does not tell what is {}", name);
    const double says = book[name];
    if (!(std::abs(says - area) <= within_mm2))
      return fmt::format("of what is {} the area book says {:.6f} mm2, and a count {:.6f}", name, says, area);
    if (!(says >= -within_mm2)) return fmt::format("the area book says that {:.6f} mm2 are {}", says, name);
    if (name != "panel") told += says;
  }
  if (!(std::abs(told - panel) <= 1e-6))
    return fmt::format("the area book's classes are {:.7f} mm2 of a panel of {:.7f}", told, panel);
  return "";
}

}  // namespace

std::vector<PlainWood> plain_wood(const json& allocations) {
  std::vector<PlainWood> out;
  for (const json& allocation : allocations) {
    PlainWood& wood = out.emplace_back(PlainWood{allocation["state"], {}, ring_of(allocation["outline_mm"])});
    for (const json& points : allocation["allocation_mm"]) wood.area.push_back(ring_of(points));
  }
  return out;
}

PanelAreas count_areas(const std::vector<PlainWood>& wood, const PlainMask& mask, double width_mm, double height_mm) {
  PanelAreas out = nothing_of(width_mm * height_mm);
  const std::vector<Line> all = lines_of(wood);
  std::vector<double> crossings;
  for (auto a = all.begin(); a != all.end(); ++a)
    for (auto b = a + 1; b != all.end() && b->low.y < a->high.y; ++b)
      if (const auto y = crossing(*a, *b)) crossings.push_back(*y);
  std::ranges::sort(crossings);
  Slabs slabs(wood, width_mm, out);
  for (const Band& band : bands_of(mask, width_mm, height_mm)) {
    std::vector<const Line*> lines;
    std::vector<double> heights = {band.bottom, band.top};
    for (const Line& line : all) {
      if (line.low.y >= band.top) break;
      if (line.high.y <= band.bottom) continue;
      lines.push_back(&line);
      heights.insert(heights.end(), {line.low.y, line.high.y});
      for (const auto& [x, usable] : band.changes)
        if ((line.low.x < x) != (line.high.x < x))
          heights.push_back(line.low.y + (x - line.low.x) * (line.high.y - line.low.y) / (line.high.x - line.low.x));
    }
    heights.insert(heights.end(), std::ranges::lower_bound(crossings, band.bottom),
                   std::ranges::upper_bound(crossings, band.top));
    std::ranges::sort(heights);
    for (std::size_t i = 0; i + 1 < heights.size(); ++i) {
      const double bottom = std::max(heights[i], band.bottom), top = std::min(heights[i + 1], band.top);
      if (bottom < top) slabs.add(band, lines, bottom, top);
    }
  }
  return out;
}

PanelAreas count_points(const std::vector<PlainWood>& wood, const PlainMask& mask, double width_mm, double height_mm) {
  enum Mark : unsigned char { kNone, kReserved, kCut, kKerf, kSuspect, kScrap, kFree, kUnusable, kMarks };
  constexpr const char* kNames[kMarks] = {"", "reserved", "cut", "kerf", "suspect", "scrap", "free", "unusable"};
  const auto mark_of = [](const std::string& state) {
    return state == "cut" ? kKerf : state == "suspect" ? kSuspect : state == "scrap" ? kScrap : kReserved;
  };
  const Cells cells(width_mm, height_mm);
  const auto columns = static_cast<std::size_t>(cells.columns);
  PanelAreas out = nothing_of(width_mm * height_mm);
  std::vector<Mark> marks(columns);
  std::vector<cv::Point2d> points(columns);
  std::vector<bool> inside(columns);
  // Calls `see` with the mark of each point of the row that lies within the rings.
  const auto within = [&](const PlainRing* rings, std::size_t count, const cv::Rect2d& box, int row, const auto& see) {
    const auto first_at = [&](double x) {
      return static_cast<std::size_t>(std::clamp(std::floor(x / cells.width), 0.0, static_cast<double>(columns)));
    };
    const std::size_t from = first_at(box.x), to = std::min(first_at(box.x + box.width) + 1, columns);
    std::fill(inside.begin() + static_cast<std::ptrdiff_t>(from), inside.begin() + static_cast<std::ptrdiff_t>(to),
              false);
    for (const PlainRing* ring = rings; ring != rings + count; ++ring)
      for (std::size_t i = 0; i < ring->size(); ++i) {
        const cv::Point2d &a = (*ring)[i], &b = (*ring)[i + 1 == ring->size() ? 0 : i + 1];
        if (a.y == b.y) continue;  // nothing lies beside it
        if (std::max(a.y, b.y) <= row * cells.height || std::min(a.y, b.y) >= (row + 1) * cells.height) continue;
        const double slope = (b.x - a.x) / (b.y - a.y);
        for (std::size_t at = std::max(from, first_at(std::min(a.x, b.x))); at < to; ++at)
          if (const cv::Point2d& p = points[at]; (a.y <= p.y) != (b.y <= p.y) && a.x + (p.y - a.y) * slope < p.x)
            inside[at] = !inside[at];
      }
    for (std::size_t at = from; at < to; ++at)
      if (inside[at]) see(marks[at]);
  };
  std::vector<cv::Rect2d> boxes;  // of each row of the ledger
  for (const PlainWood& one : wood) boxes.push_back(box_of(one));
  std::mt19937 dice(1);
  const auto anywhere = [&] { return static_cast<double>(dice()) * 0x1p-32; };
  long counted[kMarks] = {};
  for (int row = 0; row < cells.rows; ++row) {
    for (std::size_t at = 0; at < columns; ++at) {
      points[at].x = (static_cast<double>(at) + anywhere()) * cells.width;
      points[at].y = (row + anywhere()) * cells.height;
    }
    std::ranges::fill(marks, kNone);
    for (std::size_t i = 0; i < wood.size(); ++i) {
      const PlainWood& one = wood[i];
      if (one.state == "released" || (row + 1) * cells.height < boxes[i].y ||
          row * cells.height > boxes[i].y + boxes[i].height)
        continue;
      const Mark mark = mark_of(one.state);
      within(one.area.data(), one.area.size(), boxes[i], row, [&](Mark& point) {
        if (point != kNone) ++counted[point];  // another row holds it, too
        point = mark;
      });
      if (mark == kKerf)
        within(&one.outline, 1, boxes[i], row, [&](Mark& point) {
          if (point == kKerf) point = kCut;
        });
    }
    for (std::size_t at = 0; at < columns; ++at)
      ++counted[marks[at] != kNone ? marks[at] : is_usable(mask, points[at]) ? kFree : kUnusable];
  }
  for (int mark = kNone + 1; mark < kMarks; ++mark)
    out[kNames[mark]] = static_cast<double>(counted[mark]) * cells.area();
  return out;
}

PanelAreas doubt_of_points(const std::vector<PlainWood>& wood, const PlainMask& mask, double width_mm,
                           double height_mm) {
  const Cells cells(width_mm, height_mm);
  PanelAreas crossed = nothing_of(0);
  const auto border_of = [&](const PlainRing& ring) {
    double out = 0;
    for (std::size_t i = 0; i < ring.size(); ++i) out += cells.crossed_by(ring[(i + 1) % ring.size()] - ring[i]);
    return out;
  };
  for (const PlainWood& one : wood) {
    if (one.state == "released") continue;
    double around = 0;
    for (const PlainRing& ring : one.area) around += border_of(ring);
    for (const char* name : {"free", "unusable", "panel"}) crossed[name] += around;
    if (one.state != "cut") {
      crossed[class_of(one.state, false)] += around;
      continue;
    }
    const double both = around + border_of(one.outline);
    crossed["cut"] += both, crossed["kerf"] += both;
  }
  // The sides between pixels that differ; what is outside is not usable.
  cv::Mat usable;
  cv::copyMakeBorder(mask.pixels != 0, usable, 1, 1, 1, 1, cv::BORDER_CONSTANT, 0);
  const cv::Mat beside = usable.colRange(1, usable.cols) != usable.colRange(0, usable.cols - 1);
  const cv::Mat above = usable.rowRange(1, usable.rows) != usable.rowRange(0, usable.rows - 1);
  const double sides = cv::countNonZero(beside) * cells.crossed_by({0, mask.pixel_mm}) +
                       cv::countNonZero(above) * cells.crossed_by({mask.pixel_mm, 0});
  crossed["free"] += sides, crossed["unusable"] += sides;
  for (auto& [name, cells_crossed] : crossed) cells_crossed = 4 * std::sqrt(cells_crossed) * cells.area() + 1e-6;
  return crossed;
}

std::string disagreement(const json& book, const PanelAreas& counted, double within_mm2) {
  PanelAreas within = counted;
  for (auto& [name, area] : within) area = within_mm2;
  return disagreement(book, counted, within);
}

std::string disagreement(const json& book, const std::vector<PlainWood>& wood, const PlainMask& mask, double width_mm,
                         double height_mm, bool by_points) {
  std::string wrong = disagreement(book, count_areas(wood, mask, width_mm, height_mm), 1e-6);
  if (!wrong.empty()) return "by polygons: " + wrong;
  return by_points ? disagreement_by_points(book, wood, mask, width_mm, height_mm) : "";
}

std::string disagreement_by_points(const json& book, const std::vector<PlainWood>& wood, const PlainMask& mask,
                                   double width_mm, double height_mm) {
  PanelAreas within = doubt_of_points(wood, mask, width_mm, height_mm);
  for (auto& [name, doubt] : within) doubt = std::min(doubt, 1e-3 * width_mm * height_mm);
  const std::string wrong = disagreement(book, count_points(wood, mask, width_mm, height_mm), within);
  return wrong.empty() ? "" : "by points: " + wrong;
}

}  // namespace veneer::testing
