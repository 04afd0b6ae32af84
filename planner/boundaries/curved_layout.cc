#include "planner/boundaries/curved_layout.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace veneer::planner {
namespace {

// A line of CutLines, or one of the artwork's borders, which follow them.
enum Border : std::size_t { kLeft, kRight, kTop, kBottom };

struct LineVertex {
  double along = 0;
  Point<ArtworkFrame> at;
};

class CurveBuilder {
 public:
  CurveBuilder(const CutLines& lines, Millimetres width, const PixelGrid& grid, Smoothness smoothness)
      : lines_(lines), grid_(grid), smoothness_(smoothness), sides_(lines.lines.size() + 4) {
    out_.width = width, out_.height = grid.height;
  }

  Partition run() {
    out_.faces.resize(lines_.faces.size());
    for (const FaceLines& face : lines_.faces)
      for (const std::size_t upright : {number(face.left, kLeft), number(face.right, kRight)})
        for (const std::size_t level : {number(face.top, kTop), number(face.bottom, kBottom)})
          add_vertex(upright, level);
    for (std::size_t line = 0; line < sides_.size(); ++line) add_edges(line);
    for (std::size_t f = 0; f < lines_.faces.size(); ++f) close(f);
    return std::move(out_);
  }

 private:
  struct Meeting {
    std::size_t other;
    LineVertex vertex;
  };
  struct Side {
    std::vector<Meeting> meetings;  // along the line
    std::size_t first_edge = 0;     // the edge between the first two
  };

  std::size_t number(int line, Border border) const {
    return line == FaceLines::kBorder ? lines_.lines.size() + border : static_cast<std::size_t>(line);
  }
  bool is_border(std::size_t line) const { return line >= lines_.lines.size(); }
  bool is_upright(std::size_t line) const {
    return is_border(line) ? line - lines_.lines.size() <= kRight : lines_.lines[line].upright;
  }
  // Where a line lies across, in pixels.
  double across(std::size_t line, double along) const {
    if (!is_border(line)) return lines_.lines[line](along);
    const std::size_t border = line - lines_.lines.size();
    return border == kRight ? lines_.width : border == kBottom ? lines_.height : 0;
  }

  Point<ArtworkFrame> artwork_point(double column, double row) const {
    return {grid_.resolution.to_mm(Pixels(column)), grid_.height - grid_.resolution.to_mm(Pixels(row))};
  }
  static Millimetres whole(Millimetres length) {
    return Millimetres(static_cast<double>(std::llround(length.count() * 1000)) / 1000);
  }
  // To whole micrometres.
  static Point<ArtworkFrame> whole(const Point<ArtworkFrame>& p) { return {whole(p.x), whole(p.y)}; }

  void add_vertex(std::size_t upright, std::size_t level) {
    std::vector<Meeting>& known = sides_[upright].meetings;
    if (std::any_of(known.begin(), known.end(), [&](const Meeting& it) { return it.other == level; })) return;
    // The lines turn by less than 45 degrees, so going from one to the other and back comes ever closer.
    double column = across(upright, across(level, 0)), row = across(level, column);
    for (int i = 0; i < 100; ++i) {
      const double next = across(upright, row);
      if (std::abs(next - column) < 1e-9) break;
      column = (column + next) / 2, row = across(level, column);
    }
    Point<ArtworkFrame> at = whole(artwork_point(column, row));
    if (is_border(upright)) at.x = upright - lines_.lines.size() == kRight ? out_.width : Millimetres(0);
    if (is_border(level)) at.y = level - lines_.lines.size() == kTop ? out_.height : Millimetres(0);
    known.push_back({level, {row, at}});
    sides_[level].meetings.push_back({upright, {column, at}});
  }

  void add_edges(std::size_t line) {
    Side& side = sides_[line];
    std::sort(side.meetings.begin(), side.meetings.end(),
              [](const Meeting& a, const Meeting& b) { return a.vertex.along < b.vertex.along; });
    side.first_edge = out_.edges.size();
    for (std::size_t i = 0; i + 1 < side.meetings.size(); ++i)
      out_.edges.push_back(edge_between(line, side.meetings[i].vertex, side.meetings[i + 1].vertex));
  }

  PlanePoint sample(std::size_t line, double along) const {
    const double aside = across(line, along);
    const Point<ArtworkFrame> p = is_upright(line) ? artwork_point(aside, along) : artwork_point(along, aside);
    return {p.x.count(), p.y.count()};
  }

  PartitionEdge edge_between(std::size_t line, const LineVertex& from, const LineVertex& to) const {
    if (is_border(line)) {
      PartitionEdge out = straight_edge(from.at, to.at);
      for (const std::size_t k : {1, 2}) {
        if (from.at.x != to.at.x) out.curve[k].x = whole(out.curve[k].x);
        if (from.at.y != to.at.y) out.curve[k].y = whole(out.curve[k].y);
      }
      return out;
    }
    constexpr double kClear = 0.35;  // pixels between the ends and the samples
    std::vector<PlanePoint> path{{from.at.x.count(), from.at.y.count()}};
    for (double along = std::ceil(from.along + kClear - 0.5) + 0.5; along <= to.along - kClear; along += 1)
      path.push_back(sample(line, along));
    path.push_back({to.at.x.count(), to.at.y.count()});
    const PlanePoint before = sample(line, from.along - 1), after = sample(line, to.along + 1);
    // What rounding to micrometres moves a curve by is left to it.
    const double tolerance = kFitTolerance.count() - 0.001;
    PartitionEdge out{{from.at}};
    for (const Cubic& cubic : fit_cubics(path, tolerance, smoothness_, &before, &after))
      for (std::size_t k = 1; k < 4; ++k) out.curve.push_back(whole(point<ArtworkFrame>(cubic[k].x, cubic[k].y)));
    out.curve.back() = to.at;
    return out;
  }

  // The edges of `line` between two others, along it; `backwards`: as a boundary that runs against it.
  void add_side(std::size_t face, std::size_t line, std::size_t from, std::size_t to, bool backwards) {
    const Side& side = sides_[line];
    const auto place = [&](std::size_t other) {
      return static_cast<std::size_t>(std::find_if(side.meetings.begin(), side.meetings.end(),
                                                   [&](const Meeting& it) { return it.other == other; }) -
                                      side.meetings.begin());
    };
    const std::size_t first = place(from), last = place(to);
    std::vector<DirectedEdge>& boundary = out_.faces[face].boundary;
    for (std::size_t i = first; i < last; ++i) {
      const std::size_t edge = side.first_edge + (backwards ? last - 1 - (i - first) : i);
      (backwards ? out_.edges[edge].right : out_.edges[edge].left) = face;
      boundary.push_back({edge, backwards});
    }
  }

  // Edges run downwards and to the right; with +y up a counter-clockwise boundary follows its left and lower sides.
  void close(std::size_t f) {
    const FaceLines& face = lines_.faces[f];
    const std::size_t left = number(face.left, kLeft), right = number(face.right, kRight);
    const std::size_t top = number(face.top, kTop), bottom = number(face.bottom, kBottom);
    add_side(f, bottom, left, right, false);
    add_side(f, right, top, bottom, true);
    add_side(f, top, left, right, true);
    add_side(f, left, top, bottom, false);
  }

  const CutLines& lines_;
  const PixelGrid& grid_;
  Smoothness smoothness_;
  std::vector<Side> sides_;
  Partition out_;
};

}  // namespace

Partition curved_layout(const CutLines& lines, Millimetres width, const PixelGrid& grid, Smoothness smoothness) {
  return CurveBuilder(lines, width, grid, smoothness).run();
}

CurveLength curve_length(const Partition& partition) {
  CurveLength out;
  for (const PartitionEdge& edge : partition.edges) {
    if (edge.left == PartitionEdge::kOutside || edge.right == PartitionEdge::kOutside) continue;
    out.segments += edge.segments();
    const Polyline<ArtworkFrame> path = flattened(edge);
    for (std::size_t i = 1; i < path.size(); ++i) out.length += distance(path[i - 1], path[i]);
  }
  return out;
}

}  // namespace veneer::planner
