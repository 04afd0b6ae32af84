// What a polygon covers along a horizontal band: the one question that rows of pixels and rows of places ask of shapes.
//
// Coordinates are pixels of whatever raster asks. A convex polygon covers one interval of a band, from its leftmost to
// its rightmost point there. Any other covers what its sides in the band span and what lies inside it along the band's
// middle: a point of it in the band has, straight above and below, either a side within the band or both of the band's
// borders, and then the middle. Not thread-safe: within() reuses its answer.
#pragma once

#include <cstddef>
#include <vector>

#include "base/geometry.h"

namespace veneer::planner {

class BandedPolygon {
 public:
  // Rings under the even-odd rule, each added corner by corner.
  struct Corners {
    std::vector<double> x, y;
  };
  explicit BandedPolygon(std::vector<Corners> rings);

  double left() const { return left_; }
  double right() const { return right_; }
  double top() const { return top_; }
  double bottom() const { return bottom_; }

  struct Interval {
    double low, high;
  };
  // What the part with y in [top, bottom] covers, borders included; in no order, and some of it perhaps twice.
  const std::vector<Interval>& within(double top, double bottom) const;

 private:
  struct Side {
    double x0, y0, x1, y1;
    int first_row;  // that it reaches into
  };
  void sort_sides();
  // From -1, above the first, to their number, below the last.
  int row_of(double y) const {
    const double row = y - first_row_;
    if (row < 0) return -1;
    return row < rows_ ? static_cast<int>(row) : rows_;
  }

  std::vector<Corners> rings_;
  bool convex_;
  double left_ = 1e300, right_ = -1e300, top_ = 1e300, bottom_ = -1e300;
  // Unless it is convex: the sides that reach into each row, so that a band asks these alone; begins_[r] to
  // begins_[r + 1] are those of row r, a unit high, below the row of top().
  double first_row_ = 0;
  int rows_ = 0;
  std::vector<Side> sides_;
  std::vector<std::size_t> begins_;
  mutable std::vector<Interval> found_;
  mutable std::vector<double> crossings_;
};

// Whether a ring never turns back, rounding apart; in either direction.
bool is_convex(const std::vector<double>& x, const std::vector<double>& y);

template <class Frame>
bool is_convex(const Ring<Frame>& ring) {
  std::vector<double> x, y;
  for (const auto& p : ring) x.push_back(p.x.count()), y.push_back(p.y.count());
  return is_convex(x, y);
}

}  // namespace veneer::planner
