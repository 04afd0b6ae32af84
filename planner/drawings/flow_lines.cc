#include "planner/drawings/flow_lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <system_error>

namespace veneer::planner {
namespace {

constexpr double kSeen = kWholeSide / 1000.0;   // what a line may be moved by
constexpr int kFarthestFlow = 10 * kWholeSide;  // from the picture's corner

std::optional<int> coordinate(std::string_view text) {
  int value = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (fault != std::errc() || end != text.data() + text.size() || std::abs(value) > kFarthestFlow) return std::nullopt;
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

double aside(const DrawingPoint& p, const DrawingPoint& a, const DrawingPoint& b) {
  const double x = b[0] - a[0], y = b[1] - a[1], length = std::hypot(x, y);
  if (length == 0) return std::hypot(p[0] - a[0], p[1] - a[1]);
  const double along = std::clamp(((p[0] - a[0]) * x + (p[1] - a[1]) * y) / (length * length), 0.0, 1.0);
  return std::hypot(p[0] - a[0] - along * x, p[1] - a[1] - along * y);
}

// Which points a line needs to stay within kSeen (Douglas and Peucker 1973).
std::vector<std::size_t> needed(const std::vector<DrawingPoint>& points) {
  std::vector<std::size_t> out{0};
  std::vector<std::size_t> ends{points.size() - 1};
  while (!ends.empty()) {
    const std::size_t from = out.back(), to = ends.back();
    std::size_t farthest = from;
    double most = kSeen;
    for (std::size_t i = from + 1; i < to; ++i)
      if (const double off = aside(points[i], points[from], points[to]); off > most) most = off, farthest = i;
    if (farthest != from) {
      ends.push_back(farthest);
    } else {
      out.push_back(to);
      ends.pop_back();
    }
  }
  return out;
}

bool is_near(const DrawingPoint& p) {
  return std::abs(p[0]) <= kFarthestFlow && std::abs(p[1]) <= kFarthestFlow;  // false for what is no number
}

bool on_picture(const DrawingPoint& p) { return p[0] >= 0 && p[0] <= kWholeSide && p[1] >= 0 && p[1] <= kWholeSide; }

}  // namespace

Result<std::vector<FlowLine>> flow_lines_of(std::string_view name, std::string_view text) {
  std::vector<FlowLine> out;
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
    out.push_back(*std::move(line));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return out;
}

std::string flow_text(const std::vector<FlowLine>& lines) {
  std::string out;
  for (const FlowLine& line : lines) {
    if (!out.empty()) out += ';';
    for (std::size_t i = 0; i < line.size(); ++i)
      out += fmt::format("{}{},{}", i == 0 ? "" : " ", line[i].x, line[i].y);
  }
  return out;
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
    any = any || std::ranges::any_of(shares, on_picture);
    FlowLine& flow = out.emplace_back();
    for (const std::size_t i : needed(shares))
      flow.push_back({static_cast<int>(std::lround(shares[i][0])), static_cast<int>(std::lround(shares[i][1]))});
    points += flow.size();
  }
  if (!any)
    return Error{ErrorCode::kInvalidArgument, "the drawing has no line on its page: draw where cells are to lie"};
  if (points > kMostFlowPoints)
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("the drawing's lines have {} points, more than {}: draw fewer lines, or simpler ones",
                             points, kMostFlowPoints)};
  return out;
}

}  // namespace veneer::planner
