#include "planner/drawings/flow_lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <system_error>
#include <utility>

namespace veneer::planner {
namespace {

constexpr double kSeen = kWholeSide / 1000.0;   // what a line may be moved by
constexpr int kFarthestFlow = 10 * kWholeSide;  // from the picture's corner

std::optional<int> coordinate(std::string_view text) {
  int value = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (fault != std::errc() || end != text.data() + text.size()) return std::nullopt;
  if (value < -kFarthestFlow || value > kFarthestFlow) return std::nullopt;
  return value;
}

std::optional<FlowPoint> point_of(std::string_view text) {
  const std::size_t comma = std::min(text.find(','), text.size());
  if (comma == text.size()) return std::nullopt;
  const auto x = coordinate(text.substr(0, comma)), y = coordinate(text.substr(comma + 1));
  if (!x || !y) return std::nullopt;
  return FlowPoint{*x, *y};
}

std::optional<FlowLine> line_of(std::string_view text) {
  FlowLine out;
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t end = std::min(text.find(' ', from), text.size());
    const auto point = point_of(text.substr(from, end - from));
    if (!point) return std::nullopt;
    out.push_back(*point);
    from = end + 1;
  }
  if (out.size() < 2) return std::nullopt;
  return out;
}

// "210x140". Only its shape matters, so a page is as large as its drawing says, which may be in any unit.
std::optional<DrawingPoint> page_of(std::string_view text) {
  const std::size_t by = std::min(text.find('x'), text.size());
  if (by == text.size()) return std::nullopt;
  DrawingPoint out{};
  for (const auto& [side, number] : {std::pair(&out[0], text.substr(0, by)), std::pair(&out[1], text.substr(by + 1))}) {
    const auto [end, fault] = std::from_chars(number.data(), number.data() + number.size(), *side);
    if (fault != std::errc() || end != number.data() + number.size()) return std::nullopt;
    if (!(std::isfinite(*side) && *side > 0)) return std::nullopt;
  }
  return out;
}

double aside(const DrawingPoint& p, const DrawingPoint& a, const DrawingPoint& b) {
  // Not std::hypot(), which takes most of the time: points that are too far away for squares are refused before.
  const auto length = [](double x, double y) { return std::sqrt(x * x + y * y); };
  const double x = b[0] - a[0], y = b[1] - a[1], squared = x * x + y * y;
  if (squared == 0) return length(p[0] - a[0], p[1] - a[1]);
  const double along = std::clamp(((p[0] - a[0]) * x + (p[1] - a[1]) * y) / squared, 0.0, 1.0);
  return length(p[0] - a[0] - along * x, p[1] - a[1] - along * y);
}

// Which points a line needs to stay within kSeen (Douglas and Peucker 1973); where that are more than `most`, only
// some of them but more than that, since each is found by a walk along the line.
std::vector<std::size_t> needed(const std::vector<DrawingPoint>& points, std::size_t most) {
  std::vector<std::size_t> out{0};
  std::vector<std::size_t> ends{points.size() - 1};
  while (!ends.empty() && out.size() + ends.size() <= most) {
    const std::size_t from = out.back(), to = ends.back();
    std::size_t farthest = from;
    double widest = kSeen;
    for (std::size_t i = from + 1; i < to; ++i)
      if (const double off = aside(points[i], points[from], points[to]); off > widest) widest = off, farthest = i;
    if (farthest != from) {
      ends.push_back(farthest);
    } else {
      out.push_back(to);
      ends.pop_back();
    }
  }
  out.insert(out.end(), ends.rbegin(), ends.rend());
  return out;
}

bool is_near(const DrawingPoint& p) {
  return std::abs(p[0]) <= kFarthestFlow && std::abs(p[1]) <= kFarthestFlow;  // false for what is no number
}

// Liang and Barsky (1984): what of the way from one to the other lies within the picture's sides.
bool segment_meets_picture(const DrawingPoint& from, const DrawingPoint& to) {
  double enters = 0, leaves = 1;
  for (const std::size_t axis : {0U, 1U}) {
    const double at = from[axis], way = to[axis] - at;
    if (way == 0) {
      if (at < 0 || at > kWholeSide) return false;
      continue;
    }
    const double one = -at / way, other = (kWholeSide - at) / way;
    enters = std::max(enters, std::min(one, other)), leaves = std::min(leaves, std::max(one, other));
  }
  return enters <= leaves;
}

bool any_meets_picture(const std::vector<DrawingPoint>& points) {
  for (std::size_t i = 1; i < points.size(); ++i)
    if (segment_meets_picture(points[i - 1], points[i])) return true;
  return false;
}

}  // namespace

bool meets_picture(const FlowLine& line) {
  std::vector<DrawingPoint> points;
  for (const FlowPoint& p : line) points.push_back({static_cast<double>(p.x), static_cast<double>(p.y)});
  return any_meets_picture(points);
}

Result<FlowDrawing> flow_drawing_of(std::string_view name, std::string_view text) {
  FlowDrawing out;
  if (const std::size_t colon = text.find(':'); colon != std::string_view::npos) {
    out.page = page_of(text.substr(0, colon));
    if (!out.page)
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("{} must have the page's width and height in mm before the colon, like 210x140, not "
                               "\"{}\": correct them, or leave them out",
                               name, text.substr(0, std::min<std::size_t>(colon, 40)))};
    text.remove_prefix(colon + 1);
  }
  std::size_t points = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(';'), text.size());
    auto line = line_of(text.substr(0, end));
    if (!line)
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("{} must be lines of X,Y in ten-thousandths of the picture's sides, with blanks between "
                               "points and semicolons between lines, not \"{}\": correct it",
                               name, text.substr(0, std::min<std::size_t>(end, 40)))};
    points += line->size();
    if (points > kMostFlowPoints)
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("{} has more than {} points: draw fewer lines, or simpler ones", name, kMostFlowPoints)};
    out.lines.push_back(*std::move(line));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return out;
}

std::string flow_text(const FlowDrawing& drawing) {
  std::string out;
  if (drawing.page) out = fmt::format("{:.6g}x{:.6g}:", (*drawing.page)[0], (*drawing.page)[1]);
  for (const FlowLine& line : drawing.lines) {
    if (&line != &drawing.lines.front()) out += ';';
    for (std::size_t i = 0; i < line.size(); ++i)
      out += fmt::format("{}{},{}", i == 0 ? "" : " ", line[i].x, line[i].y);
  }
  return out;
}

Status check_flow_page(std::string_view named, const DrawingPoint& page, int width, int height) {
  constexpr double kAlike = 0.02;  // as of masks
  const double stretch = page[0] / page[1] * height / width;
  if (std::abs(stretch - 1) <= kAlike) return Ok();
  return Error{ErrorCode::kInvalidArgument,
               fmt::format("{}: the drawing has a page of {:.6g} x {:.6g} mm, and the picture {} x {} pixels: draw "
                           "over the picture, on a page of its shape",
                           named, page[0], page[1], width, height)};
}

Result<std::vector<FlowLine>> flow_lines_of_drawing(const Drawing& drawing) {
  const auto [width, height] = drawing.page;
  if (!(width > 0 && height > 0))
    return Error{ErrorCode::kInvalidArgument, "the drawing has no page: give its <svg> a viewBox"};
  std::vector<FlowLine> out;
  std::size_t points = 0;
  bool any = false;  // on the picture
  for (const DrawnLine& line : drawing.lines) {
    std::vector<DrawingPoint> shares;
    for (const DrawingPoint& p : line.points)
      shares.push_back({p[0] / width * kWholeSide, (height - p[1]) / height * kWholeSide});
    if (shares.size() < 2) continue;
    if (!std::ranges::all_of(shares, is_near))
      return Error{ErrorCode::kInvalidArgument, "a line of the drawing lies far beside its page: draw on the page"};
    any = any || any_meets_picture(shares);
    FlowLine& flow = out.emplace_back();
    for (const std::size_t i : needed(shares, kMostFlowPoints - points))
      flow.push_back({static_cast<int>(std::lround(shares[i][0])), static_cast<int>(std::lround(shares[i][1]))});
    points += flow.size();
    if (points > kMostFlowPoints)
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("the drawing's lines need more than {} points: draw fewer lines, or simpler ones",
                               kMostFlowPoints)};
  }
  if (!any)
    return Error{ErrorCode::kInvalidArgument, "the drawing has no line on its page: draw where cells are to lie"};
  return out;
}

}  // namespace veneer::planner
