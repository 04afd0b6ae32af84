// Symbols as in planner/layout/centroidal_voronoi.h. Lengths are pixels of one raster over the artwork.
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "planner/layout/centroidal_voronoi.h"
#include "planner/layout/direction_field.h"
#include "planner/layout/grid.h"
#include "planner/layout/mosaic.h"
#include "planner/problem/priority.h"
#include "tests/gallery/stages.h"

namespace veneer::gallery {
namespace {

constexpr double kTile = 24;          // pixels of a tile's side, as problem/free_layout.cc has it
constexpr double kSizeRatio = 2;      // likewise
constexpr double kSmoothing = 0.35;   // tiles, as layout/mosaic.cc has it
constexpr double kEdgeWidth = 0.3;    // likewise
constexpr int kFirstIterations = 20;  // figure 7b
constexpr double kTileShare = 0.86;   // side of a tile in sides of its cell: delta
constexpr double kOverlap = 1.25;     // the same of ovals that overlap
constexpr double kLongAspect = 3;
constexpr int kFraction = 4;
const cv::Scalar kGrout(118, 130, 140);

struct Tiling {
  cv::Mat picture;  // the target in the raster
  cv::Mat edges;
  planner::VoronoiField field;
  cv::Mat across;  // the field of tiles that are longer than wide
  int count = 0;
  double tile = 0;
};

enum class Sizes { kByDetail, kEqual };

Tiling tiling_of(const StageView& view, Sizes sizes = Sizes::kByDetail) {
  const planner::ArtworkSize size = planner::artwork_size(view.target, view.size);
  const planner::GridSize grid = planner::grid_size(size.width, size.height, view.options.patch);
  Tiling out;
  out.count = grid.rows * grid.columns;
  const double px_per_mm = kTile * std::sqrt(out.count / (size.width * size.height).count());
  const cv::Size raster(static_cast<int>(std::lround(size.width.count() * px_per_mm)),
                        static_cast<int>(std::lround(size.height.count() * px_per_mm)));
  const bool shrinks = raster.area() < view.target.size().area();
  cv::resize(view.target, out.picture, raster, 0, 0, shrinks ? cv::INTER_AREA : cv::INTER_CUBIC);
  out.tile = std::sqrt(static_cast<double>(raster.area()) / out.count);
  out.edges = planner::salient_edges(out.picture, out.tile);
  const planner::DirectionField directions = planner::direction_field(out.edges, kSmoothing * out.tile);
  out.field.angle = directions.angle;
  out.across = directions.across;
  if (sizes == Sizes::kEqual) {
    out.field.size = cv::Mat(raster, CV_32FC1, cv::Scalar(out.tile));
  } else {
    cv::Mat detail;
    cv::resize(planner::saliency_of(view.target), detail, raster, 0, 0, cv::INTER_AREA);
    out.field.size = planner::tile_sizes(detail, out.count, kSizeRatio);
  }
  return out;
}

void avoid_edges(Tiling& tiling) {
  const int thick = std::max(1, static_cast<int>(std::lround(kEdgeWidth * tiling.tile))) | 1;
  cv::dilate(tiling.edges, tiling.field.avoid, cv::getStructuringElement(cv::MORPH_ELLIPSE, {thick, thick}));
}

Result<planner::VoronoiDiagram> rest(const Tiling& tiling, int iterations, const StageView& view, double aspect = 1) {
  const planner::VoronoiOptions options{tiling.count, std::sqrt(aspect), 0.1, iterations, view.options.seed, 1};
  return planner::centroidal_voronoi(planner::sampled_sites(tiling.field.size, tiling.count, view.options.seed),
                                     tiling.field, options);
}

// As layout/mosaic.cc does: first without edges, then away from them.
Result<planner::VoronoiDiagram> rest_beside_edges(Tiling& tiling, const StageView& view, double aspect = 1) {
  auto first = rest(tiling, kFirstIterations, view, aspect);
  if (!first.ok()) return first;
  avoid_edges(tiling);
  const planner::VoronoiOptions options{tiling.count, std::sqrt(aspect), 0.1, 300, view.options.seed, 1};
  return planner::centroidal_voronoi(std::move(first->sites), tiling.field, options);
}

std::uint8_t value_at(const cv::Mat& mask, int r, int c) { return mask.at<std::uint8_t>(r, c); }

// Cells in the mean colours of the picture, with their borders, and the picture's edges where tiles avoid them.
cv::Mat cells_of(const Tiling& tiling, const cv::Mat& labels, const std::vector<planner::PlanePoint>& sites,
                 bool borders) {
  std::vector<cv::Vec4d> sums(sites.size());
  const auto site = [&](int r, int c) { return static_cast<std::size_t>(labels.at<int>(r, c)); };
  for (int r = 0; r < labels.rows; ++r)
    for (int c = 0; c < labels.cols; ++c) {
      const cv::Vec3b& bgr = tiling.picture.at<cv::Vec3b>(r, c);
      sums[site(r, c)] += cv::Vec4d(bgr[0], bgr[1], bgr[2], 1);
    }
  cv::Mat out(labels.size(), CV_8UC3);
  for (int r = 0; r < labels.rows; ++r)
    for (int c = 0; c < labels.cols; ++c) {
      const cv::Vec4d& sum = sums[site(r, c)];
      const bool border = borders && ((c + 1 < labels.cols && site(r, c + 1) != site(r, c)) ||
                                      (r + 1 < labels.rows && site(r + 1, c) != site(r, c)));
      for (int k = 0; k < 3; ++k)
        out.at<cv::Vec3b>(r, c)[k] = cv::saturate_cast<std::uint8_t>(border ? kGrout[k] : sum[k] / sum[3]);
      if (!tiling.field.avoid.empty() && value_at(tiling.field.avoid, r, c) != 0)
        out.at<cv::Vec3b>(r, c) = cv::Vec3b(40, 200, 250);
    }
  return out;
}

struct TileShape {
  double aspect = 1, scale = kTileShare;
  bool oval = false;
};

// Of a tile with these half axes, in fractions of pixels.
std::vector<cv::Point> outline_of(const planner::PlanePoint& middle, double angle, const cv::Point2d& half, bool oval) {
  constexpr int kOvalPoints = 40;
  const cv::Point2d along(std::cos(angle), std::sin(angle)), across(-along.y, along.x);
  const int points = oval ? kOvalPoints : 4;
  const double reach = oval ? 1 : std::sqrt(2.0);
  std::vector<cv::Point> out;
  for (int i = 0; i < points; ++i) {
    const double turn = 2 * CV_PI * (i + 0.5) / points;
    // OpenCV's pixel centres lie at 0.
    const cv::Point2d corner = cv::Point2d(middle.x - 0.5, middle.y - 0.5) + along * (half.x * reach * std::cos(turn)) +
                               across * (half.y * reach * std::sin(turn));
    out.emplace_back(static_cast<int>(std::lround(corner.x * (1 << kFraction))),
                     static_cast<int>(std::lround(corner.y * (1 << kFraction))));
  }
  return out;
}

std::vector<double> areas_of(const planner::VoronoiDiagram& diagram) {
  std::vector<double> out(diagram.sites.size());
  for (const int label : cv::Mat_<int>(diagram.labels)) ++out[static_cast<std::size_t>(label)];
  return out;
}

// Tiles on grout, each in the picture's colour at its middle (point sampling, of what is a sixth of a tile wide). A
// tile whose cell came out smaller than was wished is as small as that, so that neighbours do not overlap; ovals may.
Result<cv::Mat> tiles(const StageView& view, Sizes sizes, const TileShape& shape) {
  Tiling tiling = tiling_of(view, sizes);
  if (shape.aspect > 1) tiling.field.angle = tiling.across;
  const auto diagram = rest_beside_edges(tiling, view, shape.aspect);
  if (!diagram.ok()) return diagram.error();
  const std::vector<double> areas = areas_of(*diagram);
  cv::Mat colours, out(tiling.picture.size(), CV_8UC3, kGrout);
  cv::GaussianBlur(tiling.picture, colours, {}, tiling.tile / 6);
  const double beta = std::sqrt(shape.aspect);
  for (std::size_t i = 0; i < diagram->sites.size(); ++i) {
    const planner::PlanePoint& site = diagram->sites[i];
    const int r = std::clamp(static_cast<int>(site.y), 0, out.rows - 1);
    const int c = std::clamp(static_cast<int>(site.x), 0, out.cols - 1);
    const auto wished = static_cast<double>(tiling.field.size.at<float>(r, c));
    const double side = shape.scale * (shape.oval ? wished : std::min(wished, std::sqrt(areas[i])));
    const auto angle = static_cast<double>(tiling.field.angle.at<float>(r, c));
    const cv::Vec3b& bgr = colours.at<cv::Vec3b>(r, c);
    cv::fillConvexPoly(out, outline_of(site, angle, {side / beta / 2, side * beta / 2}, shape.oval),
                       cv::Scalar(bgr[0], bgr[1], bgr[2]), cv::LINE_AA, kFraction);
  }
  return out;
}

}  // namespace

Result<cv::Mat> field_picture(const StageView& view) {
  const Tiling tiling = tiling_of(view);
  cv::Mat out = tiling.picture * 0.5;
  const int step = std::max(6, static_cast<int>(tiling.tile * 0.6));
  const double reach = step * 0.4;
  for (int y = step / 2; y < out.rows; y += step)
    for (int x = step / 2; x < out.cols; x += step) {
      const auto angle = static_cast<double>(tiling.field.angle.at<float>(y, x));
      for (const double arm : {angle, angle + CV_PI / 2}) {
        const cv::Point2d to(reach * std::cos(arm), reach * std::sin(arm));
        const cv::Point2d middle(x, y);
        cv::line(out, cv::Point((middle - to) * (1 << kFraction)), cv::Point((middle + to) * (1 << kFraction)),
                 cv::Scalar(235, 235, 225), 1, cv::LINE_AA, kFraction);
      }
    }
  cv::Mat thick;
  cv::dilate(tiling.edges, thick, cv::Mat());
  out.setTo(cv::Scalar(40, 200, 250), thick);
  return out;
}

Result<cv::Mat> size_picture(const StageView& view) {
  const Tiling tiling = tiling_of(view);
  cv::Mat scaled, out;
  cv::normalize(tiling.field.size, scaled, 20, 240, cv::NORM_MINMAX, CV_8U);
  cv::applyColorMap(scaled, out, cv::COLORMAP_BONE);
  return out;
}

Result<cv::Mat> scattered_cells(const StageView& view) {
  const Tiling tiling = tiling_of(view);
  const auto diagram = rest(tiling, 0, view);
  if (!diagram.ok()) return diagram.error();
  return cells_of(tiling, diagram->labels, diagram->sites, true);
}

Result<cv::Mat> resting_cells(const StageView& view) {
  const Tiling tiling = tiling_of(view);
  const auto diagram = rest(tiling, kFirstIterations, view);
  if (!diagram.ok()) return diagram.error();
  return cells_of(tiling, diagram->labels, diagram->sites, true);
}

Result<cv::Mat> avoiding_cells(const StageView& view) {
  Tiling tiling = tiling_of(view);
  const auto diagram = rest_beside_edges(tiling, view);
  if (!diagram.ok()) return diagram.error();
  return cells_of(tiling, diagram->labels, diagram->sites, true);
}

Result<cv::Mat> pixels_picture(const StageView& view) {
  const planner::ArtworkSize size = planner::artwork_size(view.target, view.size);
  const planner::GridSize grid = planner::grid_size(size.width, size.height, view.options.patch);
  cv::Mat small, out;
  cv::resize(view.target, small, {grid.columns, grid.rows}, 0, 0, cv::INTER_AREA);
  cv::resize(small, out, tiling_of(view, Sizes::kEqual).picture.size(), 0, 0, cv::INTER_NEAREST);
  return out;
}

Result<cv::Mat> random_cells(const StageView& view) {
  const Tiling tiling = tiling_of(view, Sizes::kEqual);
  const auto sites = planner::sampled_sites(tiling.field.size, tiling.count, view.options.seed);
  // The nearest site, as the eye measures.
  cv::Mat apart(tiling.picture.size(), CV_8UC1, cv::Scalar(255)), distance, nearest;
  for (const planner::PlanePoint& p : sites)
    apart.at<std::uint8_t>(std::clamp(static_cast<int>(p.y), 0, apart.rows - 1),
                           std::clamp(static_cast<int>(p.x), 0, apart.cols - 1)) = 0;
  cv::distanceTransform(apart, distance, nearest, cv::DIST_L2, cv::DIST_MASK_5, cv::DIST_LABEL_PIXEL);
  double most = 0;
  cv::minMaxLoc(nearest, nullptr, &most);
  return cells_of(tiling, nearest, std::vector<planner::PlanePoint>(static_cast<std::size_t>(most) + 1), false);
}

Result<cv::Mat> square_tiles(const StageView& view) { return tiles(view, Sizes::kByDetail, {}); }
Result<cv::Mat> equal_tiles(const StageView& view) { return tiles(view, Sizes::kEqual, {}); }
Result<cv::Mat> long_tiles(const StageView& view) {
  return tiles(view, Sizes::kByDetail, {kLongAspect, kTileShare, false});
}
Result<cv::Mat> oval_tiles(const StageView& view) { return tiles(view, Sizes::kByDetail, {1.6, kOverlap, true}); }

}  // namespace veneer::gallery
