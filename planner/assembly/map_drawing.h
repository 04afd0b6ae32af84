// The map itself: the pieces of an artwork, their marks, the squares that name their places. Not for several threads at
// once on one page.
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "planner/assembly/assembly_map.h"
#include "planner/assembly/map_squares.h"
#include "planner/cutting/marks.h"

struct _cairo;  // NOLINT(bugprone-reserved-identifier): cairo_t, for those who do not draw

namespace veneer::planner {

using Tint = std::array<double, 3>;  // red, green, blue, 0 to 1
inline constexpr Tint kNoWoodTint{0.75, 0.75, 0.75};

// On the page, in mm, y down.
struct PageBox {
  double x = 0, y = 0, width = 0, height = 0;
};

class MapDrawing {
 public:
  // `plan` outlives it; `artwork` is one of its.
  MapDrawing(const Plan& plan, std::size_t artwork, MapView view);

  Millimetres width() const { return squares_.width; }
  Millimetres height() const { return squares_.height; }
  const MapSquares& squares() const { return squares_; }
  const std::vector<std::size_t>& pieces() const { return pieces_; }  // of the artwork, indices of Plan::pieces
  std::string square_of(std::size_t piece) const;                     // an index of Plan::pieces
  Tint tint_of(const PanelId& panel) const;                           // which colour its pieces have; pale

  // The part `shown` of the artwork (mm of the map from its upper left corner), drawn `scale` times its size with its
  // upper left corner at (x, y) of the page; nothing outside `shown` is drawn but the squares' names beside the map.
  void draw(_cairo* context, const PageBox& shown, double x, double y, double scale) const;

 private:
  Point<MapFrame> on_map(const Point<ArtworkFrame>& p) const;
  void trace(_cairo* context, std::size_t piece) const;
  void write_mark(_cairo* context, std::size_t piece) const;
  void draw_squares(_cairo* context, double scale) const;
  void name_squares(_cairo* context, const PageBox& shown, double x, double y, double scale) const;

  const Plan& plan_;
  std::size_t artwork_;
  MapView view_;
  MapSquares squares_;
  std::vector<std::size_t> pieces_;
  std::vector<std::size_t> faces_;             // of the layout, of each of pieces_
  std::vector<std::optional<Mark>> marks_;     // of each of pieces_, in MapFrame's numbers
  std::map<std::size_t, Point<MapFrame>> at_;  // the middle of each piece
};

}  // namespace veneer::planner
