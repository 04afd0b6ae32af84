// An SVG path's data, and what else SVG draws, as lines in millimetres. Pure; thread-safe.
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "planner/drawings/drawing.h"

namespace veneer::planner {

// SVG's own: x' = a x + c y + e, y' = b x + d y + f.
struct SvgMatrix {
  double a = 1, b = 0, c = 0, d = 1, e = 0, f = 0;
  DrawingPoint apply(double x, double y) const { return {a * x + c * y + e, b * x + d * y + f}; }
  // First `inner`, then this.
  SvgMatrix operator*(const SvgMatrix& inner) const;
  double largest_stretch() const;
};

// "translate(3, 4) rotate(30)". Nothing when it does not read.
std::optional<SvgMatrix> parse_transform(std::string_view text);

// The numbers of a list, separated by blanks or commas; nothing when something else is among them.
std::optional<std::vector<double>> parse_numbers(std::string_view text);

// Lines of one element, one after the other, in millimetres through `mm_from_user`.
class LineDrawer {
 public:
  explicit LineDrawer(const SvgMatrix& mm_from_user, std::size_t most_points = kMostPoints)
      : m_(mm_from_user), stretch_(mm_from_user.largest_stretch()), most_(most_points) {}

  void move_to(DrawingPoint p);
  void line_to(DrawingPoint p);
  void cubic_to(DrawingPoint c1, DrawingPoint c2, DrawingPoint p);
  void quad_to(DrawingPoint c, DrawingPoint p);
  // As SVG's A: radii, turn of the ellipse in degrees, which of the four arcs.
  void arc_to(double rx, double ry, double turn_deg, bool large, bool sweep, DrawingPoint p);
  void ellipse(DrawingPoint centre, double rx, double ry);
  void close();
  // False when the data does not read: what was drawn until then stands, as SVG says. Reads no further once it is full.
  bool path(std::string_view data);

  // More points were to be drawn than it takes: those beyond are left out.
  bool is_full() const { return full_; }

  // Those of at least two different points; a point that is no number is among them.
  std::vector<std::vector<DrawingPoint>> take();

 private:
  void add(DrawingPoint user);
  void around(DrawingPoint centre, double rx, double ry, double turn, double from, double by);
  int steps(double twice_the_bend, double factor) const;

  SvgMatrix m_;
  double stretch_;
  std::size_t most_, drawn_ = 0;  // points, also those that fall on the one before
  bool full_ = false;
  std::vector<std::vector<DrawingPoint>> lines_;
  DrawingPoint at_{}, begin_{};  // in user units
};

}  // namespace veneer::planner
