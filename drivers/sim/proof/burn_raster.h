// The vector burn log drawn as masks, exact to half a pixel: a pixel is burnt when its centre is.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "drivers/sim/sheet.h"

namespace veneer::proof {

using sim::Vec2;

// A rectangle of a sheet seen from its show face, as pixels: y down, pixel (c, r) has its centre at
// (left + (c + 0.5) / px_per_mm, top - (r + 0.5) / px_per_mm) in sheet mm.
struct Window {
  double left = 0, top = 0;
  double px_per_mm = 50;
  int columns = 0, rows = 0;

  static Window around(Vec2 lower_left, Vec2 upper_right, double margin_mm, double px_per_mm);
  // Continuous pixel coordinates, centres at +0.5.
  Vec2 pixel(Vec2 mm) const { return {(mm.x - left) * px_per_mm, (top - mm.y) * px_per_mm}; }
  Vec2 mm(Vec2 px) const { return {left + px.x / px_per_mm, top - px.y / px_per_mm}; }
};

// The burns of a sheet with their bounding boxes, so that a window finds its own quickly. Each bit of a burn is as wide
// as it is along that direction: a spot may be oval.
class BurnIndex {
 public:
  explicit BurnIndex(const sim::Sheet& sheet);

  // Sets to `value` what the burns of one depth (engraving: only what met `face`) burnt. Through is what is open from
  // face to face: where the beam leaves the wood, on the show face of what is cut from the back, a cut is narrowest.
  void draw_through(const Window& window, cv::Mat& mask, unsigned char value) const;
  // All that a cut took where it is widest, at the face that the beam met.
  void draw_cut_at_its_widest(const Window& window, cv::Mat& mask, unsigned char value) const;
  void draw_engraved(const Window& window, sim::SheetFace face, cv::Mat& mask, unsigned char value) const;
  // Box of all burns; false when there are none.
  bool bounds(Vec2& lower_left, Vec2& upper_right) const;

 private:
  struct Entry {
    const sim::TrueBurn* burn;
    Vec2 low, high;  // with half the width
  };
  static void draw(const Entry& entry, double narrower_mm, const Window& window, cv::Mat& mask, unsigned char value);
  std::vector<Entry> entries_;
};

// A line of width 2 * radius with round ends, and a disc; everything in pixels.
void fill_capsule(cv::Mat& mask, Vec2 a, Vec2 b, double radius, unsigned char value);
// A closed ring in pixels, by pixel centres (even-odd).
void fill_ring(cv::Mat& mask, const std::vector<Vec2>& ring, unsigned char value);

}  // namespace veneer::proof
