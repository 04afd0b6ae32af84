#include "daemon/stock/wood_place.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "planner/pictures/jpeg_codec.h"
#include "planner/pictures/tile_pyramid.h"

namespace veneer::daemon {
namespace {

// Columns or rows of tiles, the first and the last.
struct Span {
  int first = 0, last = 0;
};

// Those that hold the pixels from `from` to `to` of `pixels`, and one pixel more at each end for what is drawn between
// them.
Span tiles_of(double from, double to, int pixels) {
  const auto tile = [&](double at) {
    return static_cast<int>(std::clamp(std::floor(at), 0.0, pixels - 1.0)) / planner::kTileSide;
  };
  return {tile(from - 1), tile(to + 1)};
}

}  // namespace

Result<Raster<PanelFrame>> wood_of_place(const PanelLibrary& library, const std::string& map_file,
                                         const Box<PanelFrame>& place, int side_px,
                                         PanelLibrary::MissingTiles missing) {
  const auto levels = library.tile_levels(map_file, missing);
  if (!levels) return levels.error();
  const double map_height = kMapResolution.to_mm(Pixels(levels->front().height)).count();
  const double map_width = kMapResolution.to_mm(Pixels(levels->front().width)).count();
  if (place.empty() || place.max.x.count() < 0 || place.max.y.count() < 0 || place.min.x.count() > map_width ||
      place.min.y.count() > map_height)
    return Error{ErrorCode::kInvalidArgument, "that place lies beside the panel's picture: plan the picture anew"};
  const double finest = std::max(place.width(), place.height()).count() * kMapResolution.px_per_mm;
  const int level = static_cast<int>(
      std::clamp(std::floor(std::log2(finest / side_px)), 0.0, static_cast<double>(levels->size() - 1)));
  const ScanResolution resolution{kMapResolution.px_per_mm / std::exp2(level)};
  const cv::Size size = (*levels)[static_cast<std::size_t>(level)];
  const auto px = [&](double mm) { return mm * resolution.px_per_mm; };
  const Span columns = tiles_of(px(place.min.x.count()), px(place.max.x.count()), size.width);
  const Span rows = tiles_of(px(map_height - place.max.y.count()), px(map_height - place.min.y.count()), size.height);
  constexpr int kSide = planner::kTileSide;
  Raster<PanelFrame> out;
  out.resolution = resolution;
  out.pixels.create((rows.last - rows.first + 1) * kSide, (columns.last - columns.first + 1) * kSide, CV_8UC3);
  out.origin = {resolution.to_mm(Pixels(columns.first * kSide)),
                Millimetres(map_height) - resolution.to_mm(Pixels((rows.last + 1) * kSide))};
  for (int row = rows.first; row <= rows.last; ++row)
    for (int column = columns.first; column <= columns.last; ++column) {
      const auto jpeg = library.load_tile(map_file, level, column, row, missing);
      if (!jpeg) return jpeg.error();
      const auto tile = planner::decode_jpeg(*jpeg, cv::Size(kSide, kSide));
      if (!tile || tile->type() != CV_8UC3)
        return Error{ErrorCode::kStorage, "a tile of the panel's picture cannot be read: look at its map once more"};
      tile->copyTo(out.pixels(cv::Rect((column - columns.first) * kSide, (row - rows.first) * kSide, kSide, kSide)));
    }
  return out;
}

}  // namespace veneer::daemon
