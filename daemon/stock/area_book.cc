#include "daemon/stock/area_book.h"

#include <algorithm>
#include <opencv2/core.hpp>

#include "daemon/stock/pixel_coverage.h"

namespace veneer::daemon {
namespace {

// Of the area, what lies on pixels that the mask calls usable, and what on others or beside the mask.
MaskedWood masked(const Region<PanelFrame>& area, const Raster<PanelFrame>& mask) {
  const PixelCoverage coverage = pixel_coverage(area, mask);
  double usable = 0, unusable = 0;
  for (int row = 0; row < coverage.covered.rows; ++row) {
    const auto* const covered = coverage.covered.ptr<double>(row);
    const int mask_row = coverage.row + row;
    const bool is_seen = mask_row >= 0 && mask_row < mask.pixels.rows;
    const auto* const pixels = is_seen ? mask.pixels.ptr<unsigned char>(mask_row) : nullptr;
    for (int column = 0; column < coverage.covered.cols; ++column) {
      const int at = coverage.column + column;
      const bool is_usable = is_seen && at >= 0 && at < mask.pixels.cols && pixels[at] != 0;
      (is_usable ? usable : unusable) += covered[column];
    }
  }
  const double pixel = 1 / mask.resolution.px_per_mm;
  return {SquareMillimetres(usable * pixel * pixel), SquareMillimetres(unusable * pixel * pixel)};
}

}  // namespace

Region<PanelFrame> whole_panel(Millimetres width, Millimetres height) {
  const Millimetres none(0);
  return Region<PanelFrame>(Ring<PanelFrame>{{none, none}, {width, none}, {width, height}, {none, height}});
}

MaskedWood masked_panel(const Raster<PanelFrame>& mask, Millimetres width, Millimetres height) {
  const double pixel = 1 / mask.resolution.px_per_mm;
  const double all_columns = mask.resolution.to_px(width).count(), all_rows = mask.resolution.to_px(height).count();
  const double columns = std::clamp<double>(all_columns, 0, mask.pixels.cols);
  const double rows = std::clamp<double>(all_rows, 0, mask.pixels.rows);
  const int whole_columns = static_cast<int>(columns), whole_rows = static_cast<int>(rows);
  const int end_column = std::min(whole_columns + 1, mask.pixels.cols),
            end_row = std::min(whole_rows + 1, mask.pixels.rows);
  double usable = 0, unusable = 0;
  const auto count = [&](int left, int right, int bottom, int top, double share) {
    const cv::Rect place(left, mask.pixels.rows - top, right - left, top - bottom);
    if (place.empty()) return;
    cv::Mat others;
    cv::compare(mask.pixels(place), 0, others, cv::CMP_EQ);
    usable += share * cv::countNonZero(mask.pixels(place));
    unusable += share * cv::countNonZero(others);
  };
  // The last column and the uppermost row count in part.
  const double beside = columns - whole_columns, above = rows - whole_rows;
  count(0, whole_columns, 0, whole_rows, 1);
  count(whole_columns, end_column, 0, whole_rows, beside);
  count(0, whole_columns, whole_rows, end_row, above);
  count(whole_columns, end_column, whole_rows, end_row, beside * above);
  // What the mask does not reach is not usable.
  unusable += (all_columns - columns) * all_rows + columns * (all_rows - rows);
  return {SquareMillimetres(usable * pixel * pixel), SquareMillimetres(unusable * pixel * pixel)};
}

BookedWood booked_wood(const db::AllocationRecord& allocation, const Raster<PanelFrame>& mask,
                       const Region<PanelFrame>& panel) {
  const auto whole = intersect(allocation.area, panel);
  const auto outline = intersect(Region<PanelFrame>(allocation.outline), whole);
  return {whole.area(), outline.area(), subtract(whole, outline).area(), masked(whole, mask)};
}

AreaBook opened(const Region<PanelFrame>& panel, const MaskedWood& wood) {
  AreaBook book;
  book.panel = panel.area();
  book.free = wood.usable;
  book.unusable = wood.unusable;
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
      book.kerf += wood.kerf;
      break;
    case db::AllocationState::kSuspect:
      book.suspect += wood.whole;
      break;
    case db::AllocationState::kScrap:
      book.scrap += wood.whole;
      break;
  }
  book.free -= wood.pixels.usable;
  book.unusable -= wood.pixels.unusable;
}

}  // namespace veneer::daemon
