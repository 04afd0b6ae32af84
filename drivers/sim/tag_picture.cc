#include "drivers/sim/tag_picture.h"

#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <opencv2/core.hpp>

namespace veneer::sim {
namespace {

constexpr int kCells = 10;       // cells of the printed picture, quiet zone included
constexpr int kSquareCells = 8;  // cells of the black square

// 1 = black; row 0 is the upper edge of the upright tag.
using Cells = std::array<std::array<float, kCells>, kCells>;

Cells cells_of(int id) {
  const std::unique_ptr<apriltag_family_t, void (*)(apriltag_family_t*)> family(tag36h11_create(), tag36h11_destroy);
  // Debian's library hides image_u8_destroy; a picture is two blocks of malloc.
  const auto release = [](image_u8_t* image) {
    std::free(image->buf);
    std::free(image);
  };
  const std::unique_ptr<image_u8_t, decltype(release)> picture(
      apriltag_to_image(family.get(), static_cast<unsigned>(id)), release);
  Cells cells{};
  for (int r = 0; r < kCells; ++r) {
    for (int c = 0; c < kCells; ++c) {
      cells[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)] =
          picture->buf[r * picture->stride + c] < 128 ? 1.0F : 0.0F;
    }
  }
  return cells;
}

// Mean of the cells under a square of side `side` around (x, y), in cells; what lies outside the picture counts as
// white.
double black_under(const Cells& cells, double x, double y, double side) {
  double sum = 0;
  for (int r = static_cast<int>(std::floor(y - side / 2)); r <= static_cast<int>(std::floor(y + side / 2)); ++r) {
    const double high = std::min(r + 1.0, y + side / 2) - std::max<double>(r, y - side / 2);
    for (int c = static_cast<int>(std::floor(x - side / 2)); c <= static_cast<int>(std::floor(x + side / 2)); ++c) {
      if (r < 0 || c < 0 || r >= kCells || c >= kCells) continue;
      const double wide = std::min(c + 1.0, x + side / 2) - std::max<double>(c, x - side / 2);
      sum +=
          cells[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)] * std::max(0.0, high) * std::max(0.0, wide);
    }
  }
  return sum / (side * side);
}

}  // namespace

void print_tag(Sheet& sheet, const TagPlace& place) {
  const Cells cells = cells_of(place.id);
  const double cell_mm = place.square_mm / kSquareCells;
  const double c = std::cos(place.angle_rad), s = std::sin(place.angle_rad);
  const double across = place.face == SheetFace::kShow ? 1 : -1;  // the back is seen mirrored
  const auto to_sheet = [&](Vec2 own) {
    return place.centre + Vec2{across * (c * own.x - s * own.y), s * own.x + c * own.y};
  };
  const double half = place.square_mm / 2;
  TrueTag tag{place.id, place.face, {}};
  tag.corners = {to_sheet({-half, -half}), to_sheet({half, -half}), to_sheet({half, half}), to_sheet({-half, half})};
  sheet.tags.push_back(tag);

  cv::Mat& raster = place.face == SheetFace::kShow ? sheet.front : sheet.back;
  const cv::Vec3f paper(244, 246, 247), ink(34, 31, 31);
  const double reach = (kCells / 2.0 + 1) * cell_mm * 1.5;
  const Vec2 low = sheet.pixel(place.centre + Vec2{-reach, reach}),
             high = sheet.pixel(place.centre + Vec2{reach, -reach});
  const double pixel_cells = 1 / (sheet.px_per_mm * cell_mm);
  for (int row = std::max(0, static_cast<int>(low.y)); row < std::min(raster.rows, static_cast<int>(high.y)); ++row) {
    for (int col = std::max(0, static_cast<int>(low.x)); col < std::min(raster.cols, static_cast<int>(high.x)); ++col) {
      const Vec2 d = sheet.mm({col + 0.5, row + 0.5}) - place.centre;
      const Vec2 own{c * across * d.x + s * d.y, -s * across * d.x + c * d.y};
      const double x = own.x / cell_mm + kCells / 2.0, y = kCells / 2.0 - own.y / cell_mm;
      const double inside = std::min({x, y, kCells - x, kCells - y}) / pixel_cells + 0.5;
      if (inside <= 0) continue;
      const auto sticker = static_cast<float>(std::min(1.0, inside));
      const auto black = static_cast<float>(black_under(cells, x, y, pixel_cells));
      const cv::Vec3f print = paper * (1 - black) + ink * black;
      auto& pixel = raster.at<cv::Vec3b>(row, col);
      for (int k = 0; k < 3; ++k)
        pixel[k] = cv::saturate_cast<unsigned char>(pixel[k] * (1 - sticker) + print[k] * sticker);
    }
  }
}

}  // namespace veneer::sim
