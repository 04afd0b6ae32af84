#include "planner/matching/clearance.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "planner/cancelled.h"
#include "planner/matching/banded_polygon.h"

namespace veneer::planner {

Clearance::Clearance(const FreeWood& wood, Millimetres reach)
    : raster_(wood.raster()),
      kerf_(wood.kerf()),
      reach_(static_cast<int>(std::ceil(raster_.resolution.to_px(reach).count())) + 2) {}

Result<Clearance> Clearance::measure(const FreeWood& wood, Millimetres reach, const std::stop_token& stop) {
  // Band by band: no band looks further beyond its rows than anything reaches.
  constexpr int kBand = 64 * kBlock;
  Clearance out(wood, reach);
  cv::Mat free;
  cv::copyMakeBorder(out.raster_.pixels, free, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  out.distance_.create(free.size(), CV_16UC1);
  out.farthest_.create((free.rows + kBlock - 1) / kBlock, (free.cols + kBlock - 1) / kBlock, CV_16UC1);
  for (int top = 0; top < free.rows; top += kBand) {
    if (stop.stop_requested()) return cancelled();
    const cv::Range band(top, std::min(free.rows, top + kBand));
    const cv::Range seen(std::max(0, band.start - out.reach_), std::min(free.rows, band.end + out.reach_));
    cv::Mat distances;
    cv::distanceTransform(free.rowRange(seen), distances, cv::DIST_L2, cv::DIST_MASK_PRECISE);
    out.rounded(distances.rowRange(band.start - seen.start, band.end - seen.start))
        .copyTo(out.distance_.rowRange(band));
    out.find_farthest({0, band.start, free.cols, band.size()});
  }
  return out;
}

void Clearance::find_farthest(const cv::Rect& part) {
  for (int r = part.y / kBlock; r * kBlock < part.br().y; ++r) {
    for (int c = part.x / kBlock; c * kBlock < part.br().x; ++c) {
      const cv::Rect block = cv::Rect(c * kBlock, r * kBlock, kBlock, kBlock) & cv::Rect({0, 0}, distance_.size());
      std::uint16_t most = 0;
      for (int y = block.y; y < block.br().y; ++y)
        for (int x = block.x; x < block.br().x; ++x) most = std::max(most, distance_.ptr<std::uint16_t>(y)[x]);
      farthest_.at<std::uint16_t>(r, c) = most;
    }
  }
}

cv::Mat Clearance::rounded(const cv::Mat& distances) const {
  cv::Mat out;
  distances.convertTo(out, CV_16U, kUnits, 0.5);  // never less
  return out;
}

void Clearance::take(const std::vector<Ring<PanelFrame>>& grown) {
  std::vector<BandedPolygon::Corners> corners;
  for (const Ring<PanelFrame>& ring : grown) {
    BandedPolygon::Corners& it = corners.emplace_back();
    for (const Point<PanelFrame>& p : ring) {
      raster_.to_pixels(p, it.x.emplace_back(), it.y.emplace_back());
      it.x.back() += 1, it.y.back() += 1;  // the border
    }
  }
  const BandedPolygon shape(std::move(corners));
  const cv::Rect around(cv::Point(cvFloor(shape.left()) - reach_, cvFloor(shape.top()) - reach_),
                        cv::Point(cvCeil(shape.right()) + reach_, cvCeil(shape.bottom()) + reach_));
  const cv::Rect part = around & cv::Rect({0, 0}, distance_.size());
  cv::Mat free(part.size(), CV_8UC1, cv::Scalar(255));
  for (int r = 0; r < part.height; ++r) {
    // Pixels whose centre lies within, by more than rounding.
    const double centre = part.y + r + 0.5, inside = 0.5 + 1e-6;
    for (const auto& [low, high] : shape.within(centre, centre)) {
      const int first = std::max(cvCeil(low - inside + 2e-6), part.x), last = cvFloor(high - inside);
      for (int c = first; c <= std::min(last, part.br().x - 1); ++c) free.at<std::uint8_t>(r, c - part.x) = 0;
    }
  }
  if (cv::countNonZero(free) == static_cast<int>(free.total())) return;
  cv::Mat distances;
  cv::distanceTransform(free, distances, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::Mat known = distance_(part);
  cv::min(known, rounded(distances), known);
  find_farthest(part);
}

std::vector<CoverDisc> cover_of(const Ring<ArtworkFrame>& outline, const PixelGrid& grid, int left, int top) {
  constexpr std::size_t kMost = 16;
  constexpr double kSpots = 24;       // along the window's shorter side, that may be centres
  constexpr double kApart = 0.8;      // of a disc's radius, to the centre of a smaller one
  constexpr double kRounding = 0.01;  // pixels
  std::vector<cv::Point2f> corners;
  float right = 0, bottom = 0;
  for (const Point<ArtworkFrame>& p : outline) {
    corners.emplace_back(static_cast<float>(grid.resolution.to_px(p.x).count() - left),
                         static_cast<float>(grid.resolution.to_px(grid.height - p.y).count() - top));
    right = std::max(right, corners.back().x), bottom = std::max(bottom, corners.back().y);
  }
  const float step = static_cast<float>(std::max(1.0, std::min(right, bottom) / kSpots));
  std::vector<CoverDisc> all, out;
  for (float y = step / 2; y < bottom; y += step)
    for (float x = step / 2; x < right; x += step)
      if (const double radius = cv::pointPolygonTest(corners, {x, y}, true) - kRounding; radius > 0)
        all.push_back({x, y, radius});
  std::stable_sort(all.begin(), all.end(), [](const CoverDisc& a, const CoverDisc& b) { return a.radius > b.radius; });
  for (const CoverDisc& it : all) {
    if (out.size() == kMost) break;
    if (std::none_of(out.begin(), out.end(), [&](const CoverDisc& larger) {
          return std::hypot(it.x - larger.x, it.y - larger.y) < kApart * larger.radius;
        }))
      out.push_back(it);
  }
  return out;
}

Cover::Cover(const std::vector<CoverDisc>& discs, const Lattice& lattice, const Raster<PanelFrame>& picture,
             const Clearance& clearance)
    : clearance_(clearance),
      discs_(discs),
      scale_(clearance.raster().resolution.px_per_mm / picture.resolution.px_per_mm) {
  const double kerf = clearance.raster().resolution.to_px(clearance.kerf()).count();
  // Lattice pixels to those of the stock raster: a motion and a scale, read off at three points.
  const auto stock = [&](double x, double y, double& column, double& row) {
    double c = 0, r = 0;
    lattice.to_panel(x, y, c, r);
    clearance.raster().to_pixels(picture.from_pixels(c, r), column, row);
  };
  stock(0, 0, column_, row_);
  stock(1, 0, column_x_, row_x_);
  stock(0, 1, column_y_, row_y_);
  column_x_ -= column_, column_y_ -= column_, row_x_ -= row_, row_y_ -= row_;
  for (CoverDisc& disc : discs_)
    disc = {column_x_ * disc.x + column_y_ * disc.y, row_x_ * disc.x + row_y_ * disc.y,
            std::min(disc.radius * scale_ + kerf - Clearance::kDoubt, Clearance::kFarthest)};
}

}  // namespace veneer::planner
