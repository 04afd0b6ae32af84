// Draws pictures of a laser bed as a camera with known lens and place would take them, for tests of calib's bed side.
//
// It has its own camera mathematics and shares none with calib; lengths are plain doubles (mm, px, y down, pixel
// centres at +0.5). A scene is a pile of sheets, each a function from its own millimetres to a grey value.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace veneer::test {

struct TrueCamera {
  int width = 2000, height = 1500;
  double focal = 1560, aspect = 1.0005, cx = 1011.3, cy = 742.8;
  std::array<double, 5> lens{-0.10, 0.03, 0.0006, -0.0004, 0.0};  // k1 k2 p1 p2 k3
  double eye_x = 240, eye_y = 140, eye_z = 480;                   // over the bed
  double tilt_deg = 7, lean_deg = -4, yaw_deg = 2.5;              // about bed x, y, then about the axis of view

  // Rows: the picture's right, down and the direction of view, in bed coordinates.
  std::array<std::array<double, 3>, 3> axes() const;
  std::array<double, 2> pixel_of(double x, double y, double z) const;
  // Where the ray through a pixel meets z = height.
  std::array<double, 2> bed_of(double px, double py, double z) const;
};

// Own millimetres to bed: p -> R(turn) * (mirrored ? (-x, y) : (x, y)) + (x, y).
struct Lay {
  double x = 0, y = 0, turn_deg = 0;
  bool mirrored = false;
  std::array<double, 2> bed_of(double sx, double sy) const;
  std::array<double, 2> sheet_of(double bx, double by) const;
};

constexpr float kNothingHere = -1.0F;

struct SceneSheet {
  Lay lay;
  double height = 0;                           // of its upper face above the bed
  std::function<float(double, double)> shade;  // own mm -> grey 0..255, or kNothingHere outside
};

struct PictureOptions {
  double blur_px = 0.6, noise = 3.0;
  int samples = 3;          // per pixel and axis
  bool thin_lines = false;  // sample every pixel fully, not only where its corners differ
  std::uint64_t seed = 1;
};

// Sheets from the bottom to the top; below them lies the dark honeycomb.
cv::Mat photograph(const TrueCamera& camera, const std::vector<SceneSheet>& sheets, const PictureOptions& options = {});

// 36h11 tags: grey of the black square and its quiet zone; coordinates in tag sizes, (0, 0) = lower left of the black
// square. Outside the quiet zone: kNothingHere.
float tag_shade(int id, double u, double v);

// 12 x 10 tags, 18 mm, pitch 24 mm, on a 300 x 250 mm sheet; origin at the lower left of tag 0's black square.
float april_grid_shade(double x, double y);

}  // namespace veneer::test
