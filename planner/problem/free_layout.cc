#include "planner/problem/free_layout.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>

#include "planner/cancelled.h"
#include "planner/cutting/marks.h"
#include "planner/layout/fabricable_partition.h"
#include "planner/layout/grid.h"
#include "planner/layout/tone_areas.h"
#include "planner/parallel.h"

namespace veneer::planner {
namespace {

constexpr double kLeastPixels = 6;         // side of a patch in the raster, of very many
constexpr double kMostRasterPixels = 9e6;  // in a raster that is finer than that
constexpr double kSizeRatio = 2;           // of the largest tile to the smallest, at most
constexpr double kSmallest = 0.25;         // area of the smallest patch, in wished ones
constexpr double kStated = 0.5;            // the same, for the sake of the stated size
constexpr double kTileSpare = 1.5;         // area of the smallest tile that is wished for, in the smallest faces
constexpr double kMostPaintedRatio = 4;    // the largest to the smallest, where somebody painted sizes
const Millimetres kMarkedTile{6};          // side of a tile with room for its mark, mostly
constexpr int kToneGroups = 6;             // of an automatic segmentation
constexpr double kLargestArea = 6;         // of it, in wished patches, about

cv::Size raster_of(const Artwork& artwork, double px_per_mm) {
  const auto pixels = [&](Millimetres side) {
    return std::max(1, static_cast<int>(std::lround(side.count() * px_per_mm)));
  };
  return {pixels(artwork.width), pixels(artwork.height)};
}

// Areas of one colour get one number; in the order in which colours come.
cv::Mat labels_of(const cv::Mat& picture) {
  const double scale = std::min(1.0, std::sqrt(kMostRasterPixels / static_cast<double>(picture.total())));
  cv::Mat colours = picture;
  if (scale < 1) cv::resize(picture, colours, {}, scale, scale, cv::INTER_NEAREST);
  std::map<std::uint32_t, int> known;
  cv::Mat out(colours.size(), CV_32SC1);
  for (int r = 0; r < out.rows; ++r)
    for (int c = 0; c < out.cols; ++c) {
      const auto& bgr = colours.at<cv::Vec3b>(r, c);
      const std::uint32_t colour =
          bgr[0] | static_cast<std::uint32_t>(bgr[1]) << 8 | static_cast<std::uint32_t>(bgr[2]) << 16;
      out.at<int>(r, c) = known.emplace(colour, static_cast<int>(known.size())).first->second;
    }
  return out;
}

// What draws the eye, and what the artwork says is important, in a raster of this size.
cv::Mat detail_of(const Artwork& artwork, SaliencyMaps& maps, cv::Size size) {
  cv::Mat out;
  cv::resize(maps.of(artwork.picture), out, size, 0, 0, cv::INTER_AREA);
  if (artwork.importance.empty()) return out;
  cv::Mat important, weight;
  cv::resize(artwork.importance, important, size, 0, 0, cv::INTER_AREA);
  important.convertTo(weight, CV_32F, 1.0 / 255);
  return out.mul(weight);
}

// The picture in a raster in which a patch is as many pixels wide as is wanted, or as there is room for.
struct PatchRaster {
  cv::Mat picture;
  int patches;  // of the grid
  double side;  // of a patch, pixels
};

PatchRaster patch_raster(const Artwork& artwork, const PlanOptions& options) {
  const GridSize grid = grid_size(artwork.width, artwork.height, options.patch);
  const double area = (artwork.width * artwork.height).count();
  const double count = static_cast<double>(grid.rows) * grid.columns, side = std::sqrt(area / count);
  const double finest = std::sqrt(kMostRasterPixels / area);
  const double px_per_mm =
      std::max(kLeastPixels / side, std::min(kPatchPixels * options.layout_fineness / side, finest));
  const cv::Size size = raster_of(artwork, px_per_mm);
  PatchRaster out{{}, grid.rows * grid.columns, side * px_per_mm};
  const bool shrinks = size.area() < artwork.picture.size().area();
  cv::resize(artwork.picture, out.picture, size, 0, 0, shrinks ? cv::INTER_AREA : cv::INTER_CUBIC);
  return out;
}

SquareMillimetres square_of(Millimetres side) { return side * side; }

SquareMillimetres handy_area(const PlanOptions& options) { return square_of(options.min_width) * kHandyArea; }

// The area of the smallest cell that is wished for, where faces keep to that of `limits`: long ones are as wide as may
// be cut, too.
double least_wished(const PlanOptions& options, const FabricationLimits& limits) {
  return kTileSpare *
         std::max(limits.area.count(), square_of(options.min_width).count() * std::max(1.0, options.cell_aspect));
}

// Of the largest tile to the smallest, so that cells around the smallest are seldom too small. The side of tiles goes
// evenly from the smallest to the largest over the picture's area, so the smallest times the ratio is a mean tile.
double size_ratio(const PlanOptions& options, double coarser) {
  const double mean = square_of(options.patch).count() * coarser;
  return std::clamp(mean / least_wished(options, face_limits(options)), 1.0, kSizeRatio);
}

// The least side of a tile where somebody painted sizes: its cell is large enough to be cut, and has room for its mark
// as often as the smallest of a size map that nobody painted.
Millimetres least_painted(const PlanOptions& options) {
  const Millimetres cut(std::sqrt(least_wished(options, moved_limits(options))));
  if (options.patch < kLeastMarkedPatch) return std::min(cut, options.patch);
  return std::min(options.patch, std::max(cut, std::min(kMarkedTile, options.patch / std::sqrt(kSizeRatio))));
}

// Sizes as they are painted, as unlike as their smallest may be: a little white makes small tiles much smaller than the
// mean one.
cv::Mat painted_sizes(const Artwork& artwork, const PatchRaster& raster, int tiles, const PlanOptions& options) {
  cv::Mat painted;
  cv::resize(artwork.guides.cell_sizes, painted, raster.picture.size(), 0, 0, cv::INTER_AREA);
  const cv::Mat white = smooth_painted(painted, tiles);
  const double least = least_painted(options).count() / options.patch.count() * raster.side;
  const auto smallest = [&](double ratio) {
    double side = 0;
    cv::minMaxLoc(painted_tile_sizes(white, tiles, ratio), &side);
    return side;
  };
  double low = 1, high = kMostPaintedRatio;
  if (smallest(high) >= least) low = high;
  for (int i = 0; i < 6 && low < high; ++i) {
    const double middle = (low + high) / 2;
    (smallest(middle) >= least ? low : high) = middle;
  }
  return painted_tile_sizes(white, tiles, low);
}

// As many tiles as the grid has patches, or so many times fewer; small where the picture is salient.
Result<Mosaic> mosaic_of(const Artwork& artwork, const PatchRaster& raster, double coarser, const PlanOptions& options,
                         SaliencyMaps& maps, const std::stop_token& stop) {
  const int tiles = std::max(1, static_cast<int>(std::lround(raster.patches / coarser)));
  return decorative_mosaic(
      raster.picture, tile_sizes(detail_of(artwork, maps, raster.picture.size()), tiles, size_ratio(options, coarser)),
      {tiles, 1, options.seed, threads_meant(options.threads)}, stop);
}

// Flow lines, one pixel wide.
cv::Mat drawn_lines(const std::vector<FlowLine>& lines, cv::Size size) {
  if (lines.empty()) return {};
  constexpr int kFraction = 4;  // bits behind the point of drawn coordinates
  cv::Mat out(size, CV_8UC1, cv::Scalar(0));
  const auto pixel = [&](int share, int pixels) {  // OpenCV's pixel centres lie at 0
    return static_cast<int>(std::lround((static_cast<double>(share) * pixels / kWholeSide - 0.5) * (1 << kFraction)));
  };
  for (const FlowLine& line : lines) {
    std::vector<cv::Point> points;
    for (const FlowPoint& p : line) points.emplace_back(pixel(p.x, size.width), pixel(p.y, size.height));
    cv::polylines(out, points, false, cv::Scalar(255), 1, cv::LINE_8, kFraction);
  }
  return out;
}

// The mosaic whose cells are the pieces, as the options and the artwork's guides want it.
Result<Mosaic> mosaic_of_cells(const Artwork& artwork, const PlanOptions& options, SaliencyMaps& maps,
                               const std::stop_token& stop) {
  const PatchRaster raster = patch_raster(artwork, options);
  const cv::Mat sizes = artwork.guides.cell_sizes.empty() ? tile_sizes(detail_of(artwork, maps, raster.picture.size()),
                                                                       raster.patches, size_ratio(options, 1))
                                                          : painted_sizes(artwork, raster, raster.patches, options);
  return decorative_mosaic(raster.picture, sizes,
                           {raster.patches, options.cell_aspect, options.seed, threads_meant(options.threads),
                            drawn_lines(artwork.guides.flow_lines, raster.picture.size()), options.flow_lines_only,
                            artwork.tiles_with_joints},
                           stop);
}

// Tiles of a raster as they lie on the artwork.
std::vector<MosaicTile> tiles_on(const Artwork& artwork, const std::vector<DisjointTile>& tiles, cv::Size raster) {
  const Millimetres pixel = artwork.width / raster.width;
  std::vector<MosaicTile> out;
  out.reserve(tiles.size());
  for (const DisjointTile& it : tiles)
    out.push_back({{artwork.width * (it.middle.x / raster.width), artwork.height * (1 - it.middle.y / raster.height)},
                   Radians(-it.angle),
                   pixel * it.length,
                   pixel * it.width});
  return out;
}

// Areas of one tone, where they are large cut along the cells of a coarse mosaic: no piece may be larger than wood is.
Result<cv::Mat> areas_of(const Artwork& artwork, const PlanOptions& options, SaliencyMaps& maps,
                         const std::stop_token& stop) {
  const PatchRaster raster = patch_raster(artwork, options);
  const Result<Mosaic> cells = mosaic_of(artwork, raster, kLargestArea, options, maps, stop);
  if (!cells.ok()) return cells.error();
  return cv::Mat(cells->labels * kToneGroups + tone_areas(raster.picture, raster.side, kToneGroups));
}

// What cells keep to where somebody painted their sizes: small ones are meant.
FabricationLimits painted_limits(const PlanOptions& options) {
  const FabricationLimits limits = face_limits(options);
  return {limits.width,
          std::max(moved_limits(options).area, std::min(limits.area, square_of(least_painted(options)) / kTileSpare))};
}

}  // namespace

FabricationLimits moved_limits(const PlanOptions& options) {
  if (options.min_size >= options.patch) return {options.min_width, handy_area(options)};
  const SquareMillimetres stated = std::min(square_of(options.min_size), square_of(options.patch) * kStated);
  return {options.min_width, std::max(handy_area(options), stated)};
}

FabricationLimits face_limits(const PlanOptions& options) {
  return {options.min_width, std::max(moved_limits(options).area, square_of(options.patch) * kSmallest)};
}

FabricationLimits drawn_limits(const PlanOptions& options) {
  return {options.min_width, std::max(handy_area(options), square_of(options.min_size))};
}

Millimetres handy_size(const PlanOptions& options) { return std::min(options.min_size, options.patch / 2); }

MorphOptions morph_options(const Artwork& artwork, const PlanOptions& options) {
  return {options.patch,
          face_limits(options),
          handy_size(options),
          options.curves == Curves::kG1 ? Smoothness::kG1 : Smoothness::kG0,
          threads_meant(options.threads),
          artwork.guides,
          options.triangles,
          options.layout_fineness};
}

Result<FreeLayout> free_layout(const Artwork& artwork, const PlanOptions& options, SaliencyMaps& maps,
                               const std::stop_token& stop) {
  FreeLayout out;
  cv::Mat labels;
  if (options.layout == LayoutKind::kMosaic) {
    Result<Mosaic> mosaic = mosaic_of_cells(artwork, options, maps, stop);
    if (!mosaic.ok()) return mosaic.error();
    labels = mosaic->labels;
    out.mosaic = mosaic->figures;
    if (mosaic->tile_figures) out.tiles = tiles_on(artwork, mosaic->tiles, labels.size());
    out.tile_figures = mosaic->tile_figures;
  } else if (artwork.segmentation.empty()) {
    Result<cv::Mat> areas = areas_of(artwork, options, maps, stop);
    if (!areas.ok()) return areas.error();
    labels = std::move(*areas);
  } else {
    labels = labels_of(artwork.segmentation);
  }
  const bool drawn_by_hand = options.layout == LayoutKind::kSegmentation && !artwork.segmentation.empty();
  const bool marked = options.patch >= kLeastMarkedPatch && !drawn_by_hand;
  const FabricationLimits limits = drawn_by_hand                       ? drawn_limits(options)
                                   : artwork.guides.cell_sizes.empty() ? face_limits(options)
                                                                       : painted_limits(options);
  FabricableOptions wanted{limits, options.patch, options.curves == Curves::kG1 ? Smoothness::kG1 : Smoothness::kG0,
                           threads_meant(options.threads)};
  if (marked && options.marks == MarkKind::kPlace) wanted.letter = artwork.letter;
  wanted.short_marks = marked && options.marks == MarkKind::kShort;
  if (drawn_by_hand) out.drawn.emplace();
  Result<Partition> partition = fabricable_partition(std::move(labels), artwork.width, artwork.height, wanted, stop,
                                                     drawn_by_hand ? &*out.drawn : nullptr);
  if (!partition.ok()) return partition.error();
  out.partition = std::move(*partition);
  return out;
}

}  // namespace veneer::planner
