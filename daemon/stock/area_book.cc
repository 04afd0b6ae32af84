#include "daemon/stock/area_book.h"

#include <algorithm>
#include <opencv2/core.hpp>

#include "daemon/stock/pixel_coverage.h"

namespace veneer::daemon {
namespace {

SquareMillimetres usable_within(const Region<PanelFrame>& area, const Raster<PanelFrame>& mask) {
  const PixelCoverage coverage = pixel_coverage(area, mask);
  const cv::Rect place(coverage.column, coverage.row, coverage.covered.cols, coverage.covered.rows);
  const cv::Rect seen = place & cv::Rect(0, 0, mask.pixels.cols, mask.pixels.rows);
  double pixels = 0;
  for (int row = seen.y; row < seen.y + seen.height; ++row) {
    const auto* const covered = coverage.covered.ptr<double>(row - place.y);
    const auto* const usable = mask.pixels.ptr<unsigned char>(row);
    for (int column = seen.x; column < seen.x + seen.width; ++column)
      if (usable[column] != 0) pixels += covered[column - place.x];
  }
  const double pixel = 1 / mask.resolution.px_per_mm;
  return SquareMillimetres(pixels * pixel * pixel);
}

}  // namespace

Region<PanelFrame> whole_panel(Millimetres width, Millimetres height) {
  const Millimetres none(0);
  return Region<PanelFrame>(Ring<PanelFrame>{{none, none}, {width, none}, {width, height}, {none, height}});
}

SquareMillimetres usable_of_panel(const Raster<PanelFrame>& mask, Millimetres width, Millimetres height) {
  const double columns = std::clamp<double>(mask.resolution.to_px(width).count(), 0, mask.pixels.cols);
  const double rows = std::clamp<double>(mask.resolution.to_px(height).count(), 0, mask.pixels.rows);
  const int whole_columns = static_cast<int>(columns), whole_rows = static_cast<int>(rows);
  // The last column and the uppermost row count in part.
  const auto count = [&](int left, int right, int bottom, int top) {
    const cv::Rect place(left, mask.pixels.rows - top, right - left, top - bottom);
    return place.empty() ? 0 : cv::countNonZero(mask.pixels(place));
  };
  const int end_column = std::min(whole_columns + 1, mask.pixels.cols),
            end_row = std::min(whole_rows + 1, mask.pixels.rows);
  const double beside = columns - whole_columns, above = rows - whole_rows;
  const double pixels = count(0, whole_columns, 0, whole_rows) +
                        beside * count(whole_columns, end_column, 0, whole_rows) +
                        above * count(0, whole_columns, whole_rows, end_row) +
                        beside * above * count(whole_columns, end_column, whole_rows, end_row);
  const double pixel = 1 / mask.resolution.px_per_mm;
  return SquareMillimetres(pixels * pixel * pixel);
}

BookedWood booked_wood(const db::AllocationRecord& allocation, const Raster<PanelFrame>& mask,
                       const Region<PanelFrame>& panel) {
  const auto whole = intersect(allocation.area, panel);
  const auto outline = intersect(Region<PanelFrame>(allocation.outline), whole);
  return {whole.area(), outline.area(), usable_within(whole, mask)};
}

AreaBook opened(const Region<PanelFrame>& panel, SquareMillimetres usable) {
  AreaBook book;
  book.panel = panel.area();
  book.free = usable;
  book.unusable = book.panel - usable;
  return book;
}

void enter(AreaBook& book, const BookedWood& wood, db::AllocationState state) {
  switch (state) {
    case db::AllocationState::kReleased:
      return;
    case db::AllocationState::kLeased:
    case db::AllocationState::kReserved:
    case db::AllocationState::kCutting:
      book.reserved += wood.whole;
      break;
    case db::AllocationState::kCut:
      book.cut += wood.outline;
      book.kerf += (wood.whole - wood.outline);
      break;
    case db::AllocationState::kSuspect:
      book.suspect += wood.whole;
      break;
    case db::AllocationState::kScrap:
      book.scrap += wood.whole;
      break;
  }
  book.free -= wood.on_wood;
  book.unusable -= (wood.whole - wood.on_wood);
}

}  // namespace veneer::daemon
