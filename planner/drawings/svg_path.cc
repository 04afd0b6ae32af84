#include "planner/drawings/svg_path.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

namespace veneer::planner {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180;
constexpr int kMostSteps = 20000;

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\f'; }

// Reads SVG's numbers, which may stand without anything between them: "1.5.5-3". A comma stands between two values and
// nowhere else: what a viewer draws only in part is not to be burnt whole.
class NumberScanner {
 public:
  explicit NumberScanner(std::string_view text) : text_(text) {}
  bool at_end() {
    skip();
    return at_ == text_.size() && !comma_;
  }
  // Behind a comma: only a value may follow.
  bool owes_value() const { return comma_; }
  char peek() {
    skip();
    return at_ < text_.size() ? text_[at_] : '\0';
  }
  void next() {
    ++at_;
    behind_value_ = false;
  }
  bool number_follows() {
    const char c = peek();
    return (c >= '0' && c <= '9') || c == '-' || c == '+' || c == '.';
  }
  std::optional<double> number() {
    if (!number_follows()) return std::nullopt;
    std::size_t from = at_;
    if (text_[from] == '+' && text_.substr(from + 1, 1) != "-") ++from;
    double value = 0;
    const auto [end, error] = std::from_chars(text_.data() + from, text_.data() + text_.size(), value);
    if (error != std::errc() || !std::isfinite(value)) return std::nullopt;
    read_to(static_cast<std::size_t>(end - text_.data()));
    return value;
  }
  std::optional<bool> flag() {
    const char c = peek();
    if (c != '0' && c != '1') return std::nullopt;
    read_to(at_ + 1);
    return c == '1';
  }

 private:
  void skip() {
    while (at_ < text_.size() && (is_blank(text_[at_]) || (text_[at_] == ',' && behind_value_))) {
      if (text_[at_++] != ',') continue;
      comma_ = true;
      behind_value_ = false;
    }
  }
  void read_to(std::size_t end) {
    at_ = end;
    behind_value_ = true;
    comma_ = false;
  }
  std::string_view text_;
  std::size_t at_ = 0;
  bool behind_value_ = false;  // so that a comma may follow
  bool comma_ = false;
};

std::optional<SvgMatrix> matrix_of(std::string_view name, const std::vector<double>& n) {
  const auto turn = [](double degrees) {
    const double s = std::sin(degrees * kRadPerDeg), c = std::cos(degrees * kRadPerDeg);
    return SvgMatrix{c, s, -s, c, 0, 0};
  };
  if (name == "matrix" && n.size() == 6) return SvgMatrix{n[0], n[1], n[2], n[3], n[4], n[5]};
  if (name == "translate" && (n.size() == 1 || n.size() == 2))
    return SvgMatrix{1, 0, 0, 1, n[0], n.size() == 2 ? n[1] : 0};
  if (name == "scale" && (n.size() == 1 || n.size() == 2)) return SvgMatrix{n[0], 0, 0, n.back(), 0, 0};
  if (name == "rotate" && n.size() == 1) return turn(n[0]);
  if (name == "rotate" && n.size() == 3)
    return SvgMatrix{1, 0, 0, 1, n[1], n[2]} * turn(n[0]) * SvgMatrix{1, 0, 0, 1, -n[1], -n[2]};
  if (name == "skewX" && n.size() == 1) return SvgMatrix{1, 0, std::tan(n[0] * kRadPerDeg), 1, 0, 0};
  if (name == "skewY" && n.size() == 1) return SvgMatrix{1, std::tan(n[0] * kRadPerDeg), 0, 1, 0, 0};
  return std::nullopt;
}

// As a whole number of steps, whatever it is.
int bounded(double steps) { return steps < kMostSteps ? std::max(1, static_cast<int>(std::ceil(steps))) : kMostSteps; }

double dist(DrawingPoint a, DrawingPoint b) { return std::hypot(a[0] - b[0], a[1] - b[1]); }

// How far the middle one lies from between the others, twice.
double bend(DrawingPoint a, DrawingPoint b, DrawingPoint c) {
  return std::hypot(a[0] - 2 * b[0] + c[0], a[1] - 2 * b[1] + c[1]);
}

}  // namespace

SvgMatrix SvgMatrix::operator*(const SvgMatrix& i) const {
  return {a * i.a + c * i.b, b * i.a + d * i.b,     a * i.c + c * i.d,
          b * i.c + d * i.d, a * i.e + c * i.f + e, b * i.e + d * i.f + f};
}

double SvgMatrix::largest_stretch() const { return std::hypot(std::hypot(a, b), std::hypot(c, d)); }

std::optional<SvgMatrix> parse_transform(std::string_view text) {
  SvgMatrix all;
  while (true) {
    while (!text.empty() && (is_blank(text.front()) || text.front() == ',')) text.remove_prefix(1);
    if (text.empty()) return all;
    const auto open = text.find('('), close = text.find(')');
    if (open == std::string_view::npos || close == std::string_view::npos || close < open) return std::nullopt;
    std::string_view name = text.substr(0, open);
    while (!name.empty() && is_blank(name.back())) name.remove_suffix(1);
    const auto numbers = parse_numbers(text.substr(open + 1, close - open - 1));
    const auto matrix = numbers ? matrix_of(name, *numbers) : std::nullopt;
    if (!matrix) return std::nullopt;
    all = all * *matrix;
    text.remove_prefix(close + 1);
  }
}

std::optional<std::vector<double>> parse_numbers(std::string_view text) {
  NumberScanner scanner(text);
  std::vector<double> numbers;
  while (!scanner.at_end()) {
    const auto number = scanner.number();
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

// ---- LineDrawer

void LineDrawer::add(DrawingPoint user) {
  full_ = full_ || drawn_ == most_;
  if (full_) return;
  ++drawn_;
  const DrawingPoint p = m_.apply(user[0], user[1]);
  auto& line = lines_.back();
  const bool same = !line.empty() && dist(line.back(), p) <= 1e-6;  // never of what is no number
  if (!same) line.push_back(p);
}

void LineDrawer::move_to(DrawingPoint p) {
  lines_.emplace_back();
  at_ = begin_ = p;
  add(p);
}

void LineDrawer::line_to(DrawingPoint p) {
  if (lines_.empty()) return move_to(p);
  at_ = p;
  add(p);
}

// Wang's bound for curves cut into equal parts of their parameter.
int LineDrawer::steps(double twice_the_bend, double factor) const {
  return bounded(std::sqrt(factor * twice_the_bend * stretch_ / kFlatMm));
}

void LineDrawer::cubic_to(DrawingPoint c1, DrawingPoint c2, DrawingPoint p) {
  const DrawingPoint from = at_;
  const int n = steps(std::max(bend(from, c1, c2), bend(c1, c2, p)), 0.75);
  for (int i = 1; i < n; ++i) {
    const double t = static_cast<double>(i) / n, s = 1 - t;
    DrawingPoint q{};
    for (std::size_t k = 0; k < 2; ++k)
      q.at(k) = s * s * s * from.at(k) + 3 * s * s * t * c1.at(k) + 3 * s * t * t * c2.at(k) + t * t * t * p.at(k);
    line_to(q);
  }
  line_to(p);
}

void LineDrawer::quad_to(DrawingPoint c, DrawingPoint p) {
  const DrawingPoint from = at_;
  const int n = steps(bend(from, c, p), 0.25);
  for (int i = 1; i < n; ++i) {
    const double t = static_cast<double>(i) / n, s = 1 - t;
    line_to({s * s * from[0] + 2 * s * t * c[0] + t * t * p[0], s * s * from[1] + 2 * s * t * c[1] + t * t * p[1]});
  }
  line_to(p);
}

// Without its last point, whose place is known exactly.
void LineDrawer::around(DrawingPoint centre, double rx, double ry, double turn, double from, double by) {
  const double radius_mm = std::max(rx, ry) * stretch_;
  const double most = 2 * std::acos(std::clamp(1 - kFlatMm / std::max(radius_mm, kFlatMm), -1.0, 1.0));
  const int n = bounded(std::abs(by) / most);
  for (int i = 1; i < n; ++i) {
    const double t = from + by * i / n, x = rx * std::cos(t), y = ry * std::sin(t);
    line_to({centre[0] + x * std::cos(turn) - y * std::sin(turn), centre[1] + x * std::sin(turn) + y * std::cos(turn)});
  }
}

// SVG 1.1, appendix F.6.5: from end points to the centre.
void LineDrawer::arc_to(double rx, double ry, double turn_deg, bool large, bool sweep, DrawingPoint p) {
  rx = std::abs(rx), ry = std::abs(ry);
  if (rx == 0 || ry == 0 || dist(at_, p) == 0) return line_to(p);
  const double turn = turn_deg * kRadPerDeg, cos = std::cos(turn), sin = std::sin(turn);
  const double hx = (at_[0] - p[0]) / 2, hy = (at_[1] - p[1]) / 2;
  const double x = cos * hx + sin * hy, y = -sin * hx + cos * hy;
  const double too_small = x * x / (rx * rx) + y * y / (ry * ry);
  if (too_small > 1) rx *= std::sqrt(too_small), ry *= std::sqrt(too_small);
  const double below = rx * rx * y * y + ry * ry * x * x;
  double share = std::sqrt(std::max(0.0, (rx * rx * ry * ry - below) / below));
  if (large == sweep) share = -share;
  const double cx = share * rx * y / ry, cy = -share * ry * x / rx;
  const DrawingPoint centre{cos * cx - sin * cy + (at_[0] + p[0]) / 2, sin * cx + cos * cy + (at_[1] + p[1]) / 2};
  const double from = std::atan2((y - cy) / ry, (x - cx) / rx), to = std::atan2((-y - cy) / ry, (-x - cx) / rx);
  double by = to - from;
  if (sweep && by < 0) by += 2 * std::numbers::pi;
  if (!sweep && by > 0) by -= 2 * std::numbers::pi;
  around(centre, rx, ry, turn, from, by);
  line_to(p);
}

void LineDrawer::ellipse(DrawingPoint centre, double rx, double ry) {
  move_to({centre[0] + rx, centre[1]});
  around(centre, rx, ry, 0, 0, 2 * std::numbers::pi);
  close();
}

void LineDrawer::close() {
  if (!lines_.empty()) line_to(begin_);
}

bool LineDrawer::path(std::string_view data) {
  NumberScanner in(data);
  char command = '\0', before = '\0';
  DrawingPoint control{};  // of the curve before, for S and T
  while (!full_ && !in.at_end()) {
    if (!in.number_follows()) {
      command = in.peek();
      if (in.owes_value()) return false;
      in.next();
    } else if (command == 'M' || command == 'm') {
      command = command == 'M' ? 'L' : 'l';  // more pairs behind a move are lines
    } else if (command == '\0' || command == 'Z' || command == 'z') {
      return false;
    }
    const bool relative = command >= 'a';
    const auto upper = static_cast<char>(relative ? command - 'a' + 'A' : command);
    if (before == '\0' && upper != 'M') return false;
    if (upper == 'Z') {
      close();
      at_ = begin_;
      before = upper;
      if (!in.at_end() && in.peek() != 'M' && in.peek() != 'm') move_to(begin_);
      continue;
    }
    const auto point = [&]() -> std::optional<DrawingPoint> {
      const auto x = in.number();
      const auto y = x ? in.number() : std::nullopt;
      if (!y) return std::nullopt;
      return relative ? DrawingPoint{at_[0] + *x, at_[1] + *y} : DrawingPoint{*x, *y};
    };
    const DrawingPoint mirrored{2 * at_[0] - control[0], 2 * at_[1] - control[1]};
    switch (upper) {
      case 'M':
      case 'L': {
        const auto p = point();
        if (!p) return false;
        upper == 'M' ? move_to(*p) : line_to(*p);
        break;
      }
      case 'H':
      case 'V': {
        const auto n = in.number();
        if (!n) return false;
        const std::size_t k = upper == 'H' ? 0 : 1;
        DrawingPoint p = at_;
        p.at(k) = relative ? p.at(k) + *n : *n;
        line_to(p);
        break;
      }
      case 'C':
      case 'S': {
        const bool smooth = upper == 'S';
        const auto c1 = smooth ? (before == 'C' || before == 'S' ? mirrored : at_) : point();
        const auto c2 = c1 ? point() : std::nullopt;
        const auto p = c2 ? point() : std::nullopt;
        if (!p) return false;
        cubic_to(*c1, *c2, *p);
        control = *c2;
        break;
      }
      case 'Q':
      case 'T': {
        const bool smooth = upper == 'T';
        const auto c = smooth ? (before == 'Q' || before == 'T' ? mirrored : at_) : point();
        const auto p = c ? point() : std::nullopt;
        if (!p) return false;
        quad_to(*c, *p);
        control = *c;
        break;
      }
      case 'A': {
        const auto rx = in.number(), ry = in.number(), turn = in.number();
        const auto large = in.flag(), sweep = in.flag();
        const auto p = rx && ry && turn && large && sweep ? point() : std::nullopt;
        if (!p) return false;
        arc_to(*rx, *ry, *turn, *large, *sweep, *p);
        break;
      }
      default:
        return false;
    }
    before = upper;
  }
  return true;
}

std::vector<std::vector<DrawingPoint>> LineDrawer::take() {
  std::erase_if(lines_, [](const auto& line) { return line.size() < 2; });
  return std::move(lines_);
}

}  // namespace veneer::planner
