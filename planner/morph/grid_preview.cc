#include "planner/morph/grid_preview.h"

#include <algorithm>
#include <cstddef>

namespace veneer::planner {
namespace {

constexpr int kPoints = 6000, kFewestPerCell = 4, kMostPerCell = 16;  // of a grid's lines, about; along one cell
// Lines turn by at most 40 degrees, so that each step comes nearer by a quarter at least.
constexpr int kCrossingSteps = 40;

class Preview {
 public:
  Preview(const CutLines& lines, const GridSize& size, Millimetres width, Millimetres height)
      : lines_(lines), size_(size), width_(width), height_(height) {}

  GridPreview run() const {
    GridPreview out{size_, {}, {}};
    for (int row = 0; row <= size_.rows; ++row)
      for (int column = 0; column <= size_.columns; ++column) out.vertices.push_back(vertex(row, column));
    const int per_cell = std::clamp(kPoints / (size_.rows * size_.columns), kFewestPerCell, kMostPerCell);
    for (const CutLine& line : lines_.lines) {
      const int points = per_cell * (line.upright ? size_.rows : size_.columns);
      const double length = line.upright ? lines_.height : lines_.width;
      auto& drawn = out.lines.emplace_back();
      for (int i = 0; i <= points; ++i) {
        const double along = length * i / points;
        drawn.push_back(line.upright ? place(line(along), along) : place(along, line(along)));
      }
    }
    return out;
  }

 private:
  // Of the raster, y down.
  Point<ArtworkFrame> place(double x, double y) const {
    return {width_ * (x / lines_.width), height_ * (1 - y / lines_.height)};
  }
  double upright(int column, double y) const {
    if (column == 0) return 0;
    return column == size_.columns ? lines_.width : lines_.lines[static_cast<std::size_t>(column - 1)](y);
  }
  double level(int row, double x) const {
    if (row == 0) return 0;
    return row == size_.rows ? lines_.height : lines_.lines[static_cast<std::size_t>(size_.columns - 1 + row - 1)](x);
  }
  Point<ArtworkFrame> vertex(int row, int column) const {
    double x = lines_.width * column / size_.columns, y = lines_.height * row / size_.rows;
    for (int step = 0; step < kCrossingSteps; ++step) x = upright(column, y), y = level(row, x);
    return place(x, y);
  }

  const CutLines& lines_;
  GridSize size_;
  Millimetres width_, height_;
};

}  // namespace

GridPreview grid_preview(const CutLines& lines, const GridSize& size, Millimetres width, Millimetres height) {
  return Preview(lines, size, width, height).run();
}

}  // namespace veneer::planner
