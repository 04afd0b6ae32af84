// Which places of one lattice may still be free for windows of one class, one bit a place.
//
// A clear bit is certain: FreeWood refuses the place too. A set bit is FreeWood's to decide; for rectangular outlines
// on a raster of the working resolution the two hardly differ. Of windows that are not filled no more is known here
// than that their middle lies on the panel.
#pragma once

#include <cstdint>
#include <stop_token>
#include <vector>

#include "planner/matching/cell_index.h"

namespace veneer::planner {

class PlaceBits {
 public:
  // `picture` is the panel at the working resolution; `border` is what outlines keep from blocked pixels. kCancelled:
  // within a row after a stop was requested.
  static Result<PlaceBits> make(const Lattice& lattice, const WindowClass& windows, const Raster<PanelFrame>& picture,
                                const BlockedPixels& blocked, Millimetres border, const std::stop_token& stop);

  // For places of the lattice.
  bool at(int x, int y) const {
    const int bit = x - begin_[static_cast<std::size_t>(y)];
    if (bit < 0 || bit >= stored(y)) return false;
    return (row(y)[bit / 64] >> (static_cast<unsigned>(bit) % 64) & 1) != 0;
  }
  // Whether any place with x in [x0, x1) and y in [y0, y1) is set; parts outside the lattice hold none.
  bool any(int x0, int x1, int y0, int y1) const;

  // Clears the places whose window would overlap `taken`, an outline already grown by the kerf (grown_rings()). Returns
  // a rectangle of places around all that changed.
  cv::Rect remove(const std::vector<Ring<PanelFrame>>& taken, const Raster<PanelFrame>& picture, Millimetres kerf);

  int width() const { return lattice_.width(); }
  int height() const { return lattice_.height(); }
  std::size_t bytes() const { return words_.size() * sizeof(std::uint64_t); }

 private:
  PlaceBits(const Lattice& lattice, const WindowClass& windows) : lattice_(lattice), windows_(windows) {}

  // What windows cover, in pixels from the place, for outlines grown by some distance.
  struct Reach {
    double left, right, top, bottom;
  };
  Reach reach(double grow) const {
    if (!windows_.filled) return {windows_.middle_x(), windows_.middle_x(), windows_.middle_y(), windows_.middle_y()};
    return {windows_.left - grow, windows_.right + grow, windows_.top - grow, windows_.bottom + grow};
  }
  const std::uint64_t* row(int y) const { return words_.data() + base_[static_cast<std::size_t>(y)]; }
  std::uint64_t* row(int y) { return words_.data() + base_[static_cast<std::size_t>(y)]; }
  // Places of a row that have a bit, from begin_[y] on.
  int stored(int y) const {
    const auto at = static_cast<std::size_t>(y);
    return static_cast<int>(base_[at + 1] - base_[at]) * 64;
  }
  void mark_places_on_panel(const Reach& reach, const cv::Size& panel);
  Status clear_blocked(const Reach& reach, const Raster<PanelFrame>& picture, const BlockedPixels& blocked,
                       const std::stop_token& stop);

  Lattice lattice_;
  WindowClass windows_;
  // Turned panels fill half of their lattice: rows are stored where windows can lie on the panel.
  std::vector<int> begin_;         // per row, a multiple of 64
  std::vector<std::size_t> base_;  // per row, and one more: of its words
  std::vector<std::uint64_t> words_;
};

}  // namespace veneer::planner
