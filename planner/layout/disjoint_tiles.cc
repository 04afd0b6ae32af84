#include "planner/layout/disjoint_tiles.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/core.hpp>

#include "planner/cancelled.h"
#include "planner/layout/quarter_turns.h"

namespace veneer::planner {
namespace {

constexpr int kFiner = 3;             // places a pixel's side at which overlap is looked at
constexpr double kMostBeyond = 0.05;  // share of a tile beyond its cell
constexpr int kLeastTenths = 6;       // of a tile's sides, for the sake of that
constexpr int kFarthestTenths = 3;    // of its sides it is moved, for the same

// A tile with its axes.
class TileArea {
 public:
  explicit TileArea(const DisjointTile& tile) : tile_(tile), cos_(std::cos(tile.angle)), sin_(std::sin(tile.angle)) {}

  // How far inside the tile a place lies; below 0: outside.
  double depth(double x, double y) const {
    const double dx = x - tile_.middle.x, dy = y - tile_.middle.y;
    return std::min(tile_.length / 2 - std::abs(cos_ * dx + sin_ * dy),
                    tile_.width / 2 - std::abs(cos_ * dy - sin_ * dx));
  }

  // Calls `visit` with all cells, column and row, of a grid with `finer` cells a pixel whose middles lie in the tile,
  // those beyond the raster too.
  template <class Visit>
  void for_each(int finer, const Visit& visit) const {
    const double reach = std::hypot(tile_.length, tile_.width) / 2;
    const auto first = [&](double at) { return static_cast<int>(std::floor((at - reach) * finer)); };
    const auto end = [&](double at) { return static_cast<int>(std::ceil((at + reach) * finer)); };
    for (int r = first(tile_.middle.y); r < end(tile_.middle.y); ++r)
      for (int c = first(tile_.middle.x); c < end(tile_.middle.x); ++c)
        if (depth((c + 0.5) / finer, (r + 0.5) / finer) >= 0) visit(c, r);
  }

  // The same with those on a raster of this size alone.
  template <class Visit>
  void for_each_on(cv::Size size, int finer, const Visit& visit) const {
    const cv::Rect raster({0, 0}, size * finer);
    for_each(finer, [&](int c, int r) {
      if (raster.contains({c, r})) visit(c, r);
    });
  }

 private:
  const DisjointTile& tile_;
  double cos_, sin_;
};

double share_beyond(const DisjointTile& tile, const cv::Mat& labels, int cell) {
  const cv::Rect raster({0, 0}, labels.size() * kFiner);
  int beyond = 0, all = 0;
  TileArea(tile).for_each(kFiner, [&](int c, int r) {
    ++all;
    if (!raster.contains({c, r}) || labels.at<int>(r / kFiner, c / kFiner) != cell) ++beyond;
  });
  return static_cast<double>(beyond) / std::max(1, all);
}

// The largest tile that lies in its cell, nearest to where it was; or the smallest that is looked at, where least of it
// lies beyond.
DisjointTile kept_in_cell(const DisjointTile& tile, const cv::Mat& labels, int cell) {
  if (share_beyond(tile, labels, cell) <= kMostBeyond) return tile;
  DisjointTile best = tile;
  for (int tenths = 10; tenths >= kLeastTenths; --tenths) {
    double least = std::numeric_limits<double>::infinity();
    for (int i = -kFarthestTenths; i <= kFarthestTenths; ++i)
      for (int j = -kFarthestTenths; j <= kFarthestTenths; ++j) {
        const double along = i / 10.0 * tile.length, across = j / 10.0 * tile.width;
        const double cos = std::cos(tile.angle), sin = std::sin(tile.angle);
        const DisjointTile moved{
            {tile.middle.x + cos * along - sin * across, tile.middle.y + sin * along + cos * across},
            tile.angle,
            tile.length * tenths / 10,
            tile.width * tenths / 10};
        const double near = 1e-6 * (i * i + j * j);  // of those that are as good, the nearest
        if (const double beyond = share_beyond(moved, labels, cell) + near; beyond < least)
          least = beyond, best = moved;
      }
    if (least <= kMostBeyond) break;
  }
  return best;
}

}  // namespace

std::vector<DisjointTile> disjoint_tiles(const cv::Mat& labels, const VoronoiField& field, double aspect) {
  struct Cell {
    double x = 0, y = 0, area = 0;
  };
  double most = 0;
  cv::minMaxLoc(labels, nullptr, &most);
  std::vector<Cell> cells(static_cast<std::size_t>(most) + 1);
  for (int r = 0; r < labels.rows; ++r)
    for (int c = 0; c < labels.cols; ++c) {
      Cell& cell = cells[static_cast<std::size_t>(labels.at<int>(r, c))];
      cell.x += c + 0.5, cell.y += r + 0.5, ++cell.area;
    }
  std::vector<DisjointTile> out;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const Cell& cell = cells[i];
    if (cell.area == 0) continue;
    const PlanePoint middle{cell.x / cell.area, cell.y / cell.area};
    const int r = static_cast<int>(middle.y), c = static_cast<int>(middle.x);
    const double side = kTileShare * std::min(static_cast<double>(field.size.at<float>(r, c)), std::sqrt(cell.area));
    // The field's axis lies across the edge, along which a tile is long.
    const double along = static_cast<double>(field.angle.at<float>(r, c)) + std::numbers::pi / 2;
    out.push_back(
        kept_in_cell({middle, along, side * std::sqrt(aspect), side / std::sqrt(aspect)}, labels, static_cast<int>(i)));
  }
  return out;
}

Result<TileFigures> tile_figures(const std::vector<DisjointTile>& tiles, const cv::Mat& angle, const cv::Mat& edges,
                                 const std::stop_token& stop) {
  TileFigures out;
  const cv::Size size = angle.size();
  cv::Mat covered(size.height * kFiner, size.width * kFiner, CV_8UC1, cv::Scalar(0));
  double sum = 0;
  int straddling = 0;
  std::vector<double> turns;
  for (const DisjointTile& tile : tiles) {
    if (Status status = unless_cancelled(stop); !status.ok()) return status.error();
    const TileArea area(tile);
    area.for_each_on(size, kFiner, [&](int c, int r) { ++sum, covered.at<std::uint8_t>(r, c) = 1; });
    double cos = 0, sin = 0, deep = 0;
    area.for_each_on(size, 1, [&](int c, int r) {
      const auto four = 4 * static_cast<double>(angle.at<float>(r, c));
      cos += std::cos(four), sin += std::sin(four);
      if (edges.at<std::uint8_t>(r, c) != 0 && area.depth(c + 0.5, r + 0.5) > kStraddlingDepth * tile.width) ++deep;
    });
    turns.push_back(degrees_apart(tile.angle, std::atan2(sin, cos) / 4));
    straddling += deep > kStraddlingLength * std::sqrt(tile.length * tile.width) ? 1 : 0;
  }
  const double all = cv::countNonZero(covered);
  out.coverage = all / static_cast<double>(covered.total());
  out.overlap = sum > 0 ? (sum - all) / sum : 0;
  out.deviation_deg = median(std::move(turns));
  out.straddling = tiles.empty() ? 0 : static_cast<double>(straddling) / static_cast<double>(tiles.size());
  return out;
}

}  // namespace veneer::planner
