// Which places of one lattice may still be free for windows of one class, one bit a place.
//
// A clear bit is certain: FreeWood refuses the place too. A set bit is FreeWood's to decide; for rectangular outlines
// on a raster of the working resolution the two hardly differ.
#pragma once

#include <cstdint>
#include <vector>

#include "planner/cell_index.h"

namespace veneer::planner {

class PlaceBits {
 public:
  // `picture` is the panel at the working resolution; `border` is what outlines keep from blocked pixels.
  PlaceBits(const Lattice& lattice, const WindowClass& windows, const Raster<PanelFrame>& picture,
            const BlockedPixels& blocked, Millimetres border);

  bool at(int x, int y) const { return (words_[word_of(x, y)] >> (static_cast<unsigned>(x) % 64) & 1) != 0; }
  // Whether any place with x in [x0, x1) and y in [y0, y1) is set; parts outside the lattice hold none.
  bool any(int x0, int x1, int y0, int y1) const;

  // Clears the places whose window would overlap `taken`, an outline in PanelFrame already grown by the kerf.
  // Returns a rectangle of places around all that changed.
  cv::Rect remove(const Ring<PanelFrame>& taken, const Raster<PanelFrame>& picture, Millimetres kerf);

  int width() const { return lattice_.width(); }
  int height() const { return lattice_.height(); }
  std::size_t bytes() const { return words_.size() * sizeof(std::uint64_t); }

 private:
  // What windows cover, in pixels from the place, for outlines grown by some distance.
  struct Reach {
    double left, right, top, bottom;
  };
  Reach reach(double grow) const {
    return {windows_.left - grow, windows_.right + grow, windows_.top - grow, windows_.bottom + grow};
  }
  std::size_t word_of(int x, int y) const {
    return static_cast<std::size_t>(y) * row_words_ + static_cast<std::size_t>(x) / 64;
  }
  void mark_places_on_panel(const Reach& reach, const cv::Size& panel);
  void clear_blocked(const Reach& reach, const Raster<PanelFrame>& picture, const BlockedPixels& blocked);

  Lattice lattice_;
  WindowClass windows_;
  std::size_t row_words_;
  std::vector<std::uint64_t> words_;
};

}  // namespace veneer::planner
