#include "planner/cutting/marks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "planner/cutting/glyphs.h"

namespace veneer::planner {
namespace {

// In glyph units, a sixth of the height: room between characters so that burnt lines never touch, under them, and
// between two lines of them.
constexpr double kBarGap = 1.5, kBarDepth = kMarkBarDepth * kGlyphHeight, kLineGap = (kMarkLineStep - 1) * kGlyphHeight;
// As long as a capital is high, so that a bar under lines of one character is no stroke of another.
constexpr double kLeastBar = kGlyphHeight;

struct Text {
  std::vector<std::vector<GlyphPoint>>
      strokes;  // left end of the bar at x = 0, last baseline at y = 0; the bar is last
  std::vector<std::string> lines;
  double width = 0, top = 0;

  double height() const { return top + kBarDepth; }
};

// Lines from top to bottom, over one bar.
std::optional<Text> compose(std::initializer_list<std::string_view> lines) {
  Text text;
  double baseline = (kGlyphHeight + kLineGap) * static_cast<double>(lines.size() - 1);
  text.top = baseline + kGlyphHeight;
  for (const std::string_view line : lines) {
    text.lines.emplace_back(line);
    double right = 0;
    for (const char c : line) {
      const Glyph* glyph = find_glyph(c);
      if (glyph == nullptr) return std::nullopt;
      if (right > 0) right += kBarGap;
      for (const auto& stroke : glyph->strokes) {
        auto& placed = text.strokes.emplace_back(stroke);
        for (GlyphPoint& p : placed) p = {p.x + right, p.y + baseline};
      }
      right += glyph->width;
    }
    text.width = std::max(text.width, right);
    baseline -= kGlyphHeight + kLineGap;
  }
  text.width = std::max(text.width, kLeastBar);
  text.strokes.push_back({{0, -kBarDepth}, {text.width, -kBarDepth}});
  return text;
}

// The ways to write a mark, the best first: on one line, or broken before its hyphen, or in its middle.
std::vector<Text> ways_to_write(std::string_view mark) {
  std::vector<Text> ways;
  if (auto text = compose({mark})) ways.push_back(std::move(*text));
  const std::size_t hyphen = mark.find('-'), half = hyphen == std::string_view::npos ? (mark.size() + 1) / 2 : hyphen;
  if (ways.empty() || half == 0 || half == mark.size()) return ways;
  ways.push_back(*compose({mark.substr(0, half), mark.substr(half)}));
  return ways;
}

// The outline in coordinates turned so that the text's up is +y.
using Turned = std::vector<GlyphPoint>;

Turned turn_outline(const Ring<BedFrame>& outline, double up) {
  const double c = std::cos(kPi / 2 - up), s = std::sin(kPi / 2 - up);
  Turned turned;
  turned.reserve(outline.size());
  for (const auto& p : outline)
    turned.push_back({c * p.x.count() - s * p.y.count(), s * p.x.count() + c * p.y.count()});
  return turned;
}

bool inside(const Turned& outline, GlyphPoint p) {
  bool in = false;
  for (std::size_t i = 0, j = outline.size() - 1; i < outline.size(); j = i++) {
    const GlyphPoint &a = outline[i], &b = outline[j];
    if ((a.y > p.y) != (b.y > p.y) && p.x < (b.x - a.x) * (p.y - a.y) / (b.y - a.y) + a.x) in = !in;
  }
  return in;
}

// Whether a segment has a point strictly inside the box of these half sides around the centre (Liang and Barsky).
bool enters(GlyphPoint a, GlyphPoint b, GlyphPoint centre, double half_width, double half_height) {
  double from = 0, to = 1;
  const auto clip = [&](double start, double delta, double half) {
    if (delta == 0) return std::abs(start) < half;
    double t0 = (-half - start) / delta, t1 = (half - start) / delta;
    if (t0 > t1) std::swap(t0, t1);
    from = std::max(from, t0);
    to = std::min(to, t1);
    return from < to;
  };
  return clip(a.x - centre.x, b.x - a.x, half_width) && clip(a.y - centre.y, b.y - a.y, half_height);
}

bool box_fits(const Turned& outline, GlyphPoint centre, double half_width, double half_height) {
  for (std::size_t i = 0, j = outline.size() - 1; i < outline.size(); j = i++)
    if (enters(outline[j], outline[i], centre, half_width, half_height)) return false;
  return true;
}

double squared_distance(GlyphPoint p, GlyphPoint a, GlyphPoint b) {
  const double dx = b.x - a.x, dy = b.y - a.y, length = dx * dx + dy * dy;
  const double t = length > 0 ? std::clamp(((p.x - a.x) * dx + (p.y - a.y) * dy) / length, 0.0, 1.0) : 0;
  const double x = a.x + t * dx - p.x, y = a.y + t * dy - p.y;
  return x * x + y * y;
}

bool cross(GlyphPoint a, GlyphPoint b, GlyphPoint c, GlyphPoint d) {
  const auto side = [](GlyphPoint p, GlyphPoint q, GlyphPoint r) {
    return (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x) > 0;
  };
  return side(a, b, c) != side(a, b, d) && side(c, d, a) != side(c, d, b);
}

// Whether no stroke comes nearer to the outline than `margin`, which lets corners of the text's box lie outside.
bool ink_fits(const Turned& outline, GlyphPoint centre, const Text& text, double unit, double margin) {
  for (const auto& stroke : text.strokes) {
    const auto at = [&](std::size_t i) {
      return GlyphPoint{centre.x + (stroke[i].x - text.width / 2) * unit,
                        centre.y + (stroke[i].y - (text.top - kBarDepth) / 2) * unit};
    };
    if (!inside(outline, at(0))) return false;
    for (std::size_t k = 1; k < stroke.size(); ++k) {
      const GlyphPoint a = at(k - 1), b = at(k);
      for (std::size_t i = 0, j = outline.size() - 1; i < outline.size(); j = i++) {
        const GlyphPoint &c = outline[j], &d = outline[i];
        // Most are far apart, which their boxes show.
        if (std::min(a.x, b.x) - std::max(c.x, d.x) > margin || std::min(c.x, d.x) - std::max(a.x, b.x) > margin ||
            std::min(a.y, b.y) - std::max(c.y, d.y) > margin || std::min(c.y, d.y) - std::max(a.y, b.y) > margin)
          continue;
        const double nearest = std::min(std::min(squared_distance(a, c, d), squared_distance(b, c, d)),
                                        std::min(squared_distance(c, a, b), squared_distance(d, a, b)));
        if (nearest < margin * margin || cross(a, b, c, d)) return false;
      }
    }
  }
  return true;
}

// What of a mark keeps its margin from the outline.
enum class Keeps { kBox, kInk };

struct Room {
  MarkOptions options;
  Keeps keeps = Keeps::kBox;
};

struct GlyphSpot {
  GlyphPoint centre;
  double height = 0;
};

// The greatest height, up to the wanted one, of a text around this centre.
double height_at(const Turned& outline, GlyphPoint centre, const Text& text, const Room& room) {
  const MarkOptions& options = room.options;
  const auto fits = [&](double height) {
    const double unit = height / kGlyphHeight, margin = options.margin.count();
    if (room.keeps == Keeps::kInk) return ink_fits(outline, centre, text, unit, margin);
    return box_fits(outline, centre, text.width * unit / 2 + margin, text.height() * unit / 2 + margin);
  };
  double low = options.min_height.count(), high = options.height.count();
  if (!fits(low)) return 0;
  if (fits(high)) return high;
  for (int i = 0; i < 10; ++i) {
    const double middle = (low + high) / 2;
    (fits(middle) ? low : high) = middle;
  }
  return low;
}

GlyphSpot best_fit(const Turned& outline, const Text& text, const Room& room) {
  const MarkOptions& options = room.options;
  GlyphPoint low = outline.front(), high = outline.front();
  for (const GlyphPoint& p : outline) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
  const GlyphPoint middle{(low.x + high.x) / 2, (low.y + high.y) / 2};
  constexpr int kSteps = 20;
  const double unit = options.min_height.count() / kGlyphHeight, margins = 2 * options.margin.count();
  if (high.x - low.x < text.width * unit + margins || high.y - low.y < text.height() * unit + margins) return {};
  GlyphSpot best;
  double best_off = 0;
  const auto consider = [&](GlyphPoint centre) {
    if (!inside(outline, centre)) return;
    const double height = height_at(outline, centre, text, room);
    const double off = std::hypot(centre.x - middle.x, centre.y - middle.y);
    if (height > best.height + 1e-9 || (height > best.height - 1e-9 && height > 0 && off < best_off)) {
      best = {centre, height};
      best_off = off;
    }
  };
  // The middle is where it belongs; elsewhere only when it would be smaller there.
  consider(middle);
  if (best.height >= options.height.count()) return best;
  for (int i = 1; i < kSteps; ++i)
    for (int k = 1; k < kSteps; ++k)
      consider({low.x + (high.x - low.x) * i / kSteps, low.y + (high.y - low.y) * k / kSteps});
  return best;
}

Mark place(const Text& text, const GlyphSpot& fit, double up) {
  Mark mark;
  mark.height = Millimetres(fit.height);
  mark.up = Radians(up);
  mark.lines = text.lines;
  const double unit = fit.height / kGlyphHeight;
  const double c = std::cos(up - kPi / 2), s = std::sin(up - kPi / 2);
  for (const auto& stroke : text.strokes) {
    auto& path = mark.strokes.emplace_back();
    for (const GlyphPoint& p : stroke) {
      const double x = fit.centre.x + (p.x - text.width / 2) * unit;
      const double y = fit.centre.y + (p.y - (text.top - kBarDepth) / 2) * unit;
      path.push_back(point<BedFrame>(c * x - s * y, s * x + c * y));
    }
  }
  return mark;
}

// In which directions, off upright, the text is tried: as the artwork stands and by quarters, along the outline's long
// edges (slivers and triangles have room there), then by 15 degrees, the least turned first.
std::vector<double> turns_for(const Ring<BedFrame>& outline, double up) {
  std::vector<double> turns = {0, kPi / 2, -kPi / 2, kPi};
  const auto add = [&](double turn) {
    const auto same = [&](double other) {
      return std::abs(std::remainder(turn - other, 2 * kPi)) < degrees(3).count();
    };
    if (std::none_of(turns.begin(), turns.end(), same)) turns.push_back(turn);
  };
  std::vector<std::pair<double, double>> edges;  // length, turn that lays the baseline along the edge
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const auto &a = outline[i], &b = outline[(i + 1) % outline.size()];
    const double along = std::atan2((b.y - a.y).count(), (b.x - a.x).count()) + kPi / 2 - up;
    edges.emplace_back(distance(a, b).count(), std::remainder(along, 2 * kPi));
  }
  std::stable_sort(edges.begin(), edges.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  constexpr std::size_t kMostEdges = 4;
  if (edges.size() > kMostEdges) edges.resize(kMostEdges);
  for (const auto& [length, turn] : edges) {
    const double other = std::remainder(turn + kPi, 2 * kPi);
    const bool upright = std::abs(turn) <= std::abs(other);
    add(upright ? turn : other);
    add(upright ? other : turn);
  }
  for (int step = 1; step < 12; ++step) {
    add(step * degrees(15).count());
    add(-step * degrees(15).count());
  }
  return turns;
}

// What is tried one after the other: a good height, less margin, less height, and at last the ink alone.
std::vector<Room> rooms_for(const MarkOptions& options) {
  Room room{options};
  room.options.min_height = std::clamp(options.good_height, options.min_height, options.height);
  std::vector<Room> rooms = {room};
  room.options.margin = std::min(options.margin, options.min_margin);
  if (room.options.margin < options.margin) rooms.push_back(room);
  if (options.min_height < room.options.min_height) {
    room.options.min_height = options.min_height;
    rooms.push_back(room);
  }
  room.keeps = Keeps::kInk;
  rooms.push_back(room);
  return rooms;
}

}  // namespace

Result<Mark> lay_out_mark(std::string_view text, const Ring<BedFrame>& outline, Radians artwork_up,
                          const MarkOptions& options) {
  const std::vector<Text> ways = ways_to_write(text);
  if (ways.empty() || text.empty())
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("the mark \"{}\" cannot be engraved: only capitals, digits and '-' can", text)};
  if (outline.size() < 3) return Error{ErrorCode::kInvalidArgument, "a piece without an outline cannot carry a mark"};
  const std::vector<double> turns = turns_for(outline, artwork_up.count());
  for (const Room& room : rooms_for(options))
    for (const double turn : turns) {
      const double up = artwork_up.count() + turn;
      const Turned turned = turn_outline(outline, up);
      for (const Text& way : ways)
        if (const GlyphSpot fit = best_fit(turned, way, room); fit.height > 0) return place(way, fit, up);
    }
  return Error{ErrorCode::kRefused,
               fmt::format("the mark \"{}\" does not fit on its piece at {:.1f} mm", text, options.min_height.count())};
}

bool has_room_for_mark(std::string_view text, const Ring<ArtworkFrame>& outline, const MarkOptions& options) {
  Ring<BedFrame> back;  // turned over about the artwork's vertical, which leaves its up where it is
  back.reserve(outline.size());
  for (const auto& p : outline) back.push_back({-p.x, p.y});
  // Whatever fits larger or farther from the outline fits like this.
  MarkOptions least = options;
  least.height = least.good_height = least.min_height;
  least.margin = least.min_margin = std::min(least.margin, least.min_margin);
  return lay_out_mark(text, back, degrees(90), least).ok();
}

bool has_spare_room_for_mark(std::string_view text, const Ring<ArtworkFrame>& outline) {
  MarkOptions larger;
  larger.min_height = larger.min_height * 1.02;
  return has_room_for_mark(text, outline, larger);
}

}  // namespace veneer::planner
