#include "planner/problem/priority.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <opencv2/saliency.hpp>

#include "planner/matching/banded_polygon.h"

namespace veneer::planner {
namespace {

constexpr int kSaliencySide = 512;

// Sum of the map over a rectangle, border pixels by their covered part.
double sum_over(const cv::Mat& integral, double left, double top, double right, double bottom) {
  // The integral image is linear within a pixel, so its bilinear value is the sum up to a point.
  const auto upto = [&](double x, double y) {
    const int c = std::clamp(static_cast<int>(x), 0, integral.cols - 2);
    const int r = std::clamp(static_cast<int>(y), 0, integral.rows - 2);
    const double fx = std::clamp(x - c, 0.0, 1.0), fy = std::clamp(y - r, 0.0, 1.0);
    const auto at = [&](int row, int column) { return integral.at<double>(row, column); };
    return (1 - fy) * ((1 - fx) * at(r, c) + fx * at(r, c + 1)) +
           fy * ((1 - fx) * at(r + 1, c) + fx * at(r + 1, c + 1));
  };
  return upto(right, bottom) - upto(left, bottom) - upto(right, top) + upto(left, top);
}

bool is_upright_rectangle(const Ring<ArtworkFrame>& outline) {
  const Box<ArtworkFrame> box = bounds(outline);
  return outline.size() == 4 && std::all_of(outline.begin(), outline.end(), [&](const Point<ArtworkFrame>& p) {
           return (p.x == box.min.x || p.x == box.max.x) && (p.y == box.min.y || p.y == box.max.y);
         });
}

// Sum of the map over any other outline, in strips of a fraction of a pixel.
double sum_over(const cv::Mat& integral, BandedPolygon::Corners corners) {
  constexpr double kStrip = 0.125;
  const BandedPolygon shape({std::move(corners)});
  double sum = 0;
  const double height = shape.bottom() - shape.top();
  const int strips = std::max(1, static_cast<int>(std::ceil(height / kStrip)));
  for (int k = 0; k < strips; ++k) {
    const double top = shape.top() + height * k / strips, bottom = shape.top() + height * (k + 1) / strips;
    const double middle = (top + bottom) / 2;
    for (const auto& [low, high] : shape.within(middle, middle)) sum += sum_over(integral, low, top, high, bottom);
  }
  return sum;
}

// Integrals of a map that is stretched over the artwork, in map units times mm2.
std::vector<double> sums_over(const cv::Mat& map, const Artwork& artwork, const std::vector<Patch>& patches) {
  cv::Mat integral;
  cv::integral(map, integral, CV_64F);
  const double px_per_mm_x = map.cols / artwork.width.count(), px_per_mm_y = map.rows / artwork.height.count();
  std::vector<double> out;
  out.reserve(patches.size());
  for (const Patch& patch : patches) {
    if (!is_upright_rectangle(patch.outline)) {
      BandedPolygon::Corners corners;
      for (const Point<ArtworkFrame>& p : patch.outline)
        corners.x.push_back(p.x.count() * px_per_mm_x),
            corners.y.push_back((artwork.height - p.y).count() * px_per_mm_y);
      out.push_back(sum_over(integral, std::move(corners)) / (px_per_mm_x * px_per_mm_y));
      continue;
    }
    const Box<ArtworkFrame> box = bounds(patch.outline);
    const double sum =
        sum_over(integral, box.min.x.count() * px_per_mm_x, (artwork.height - box.max.y).count() * px_per_mm_y,
                 box.max.x.count() * px_per_mm_x, (artwork.height - box.min.y).count() * px_per_mm_y);
    out.push_back(sum / (px_per_mm_x * px_per_mm_y));
  }
  return out;
}

// CV_32FC1 in [0, 1].
cv::Mat importance_map(const Artwork& artwork, cv::Size size) {
  cv::Mat scaled, out;
  cv::resize(artwork.importance, scaled, size, 0, 0,
             size.area() < artwork.importance.size().area() ? cv::INTER_AREA : cv::INTER_LINEAR);
  scaled.convertTo(out, CV_32F, 1.0 / 255);
  return out;
}

std::vector<double> saliency_sums(const Artwork& artwork, const std::vector<Patch>& patches, SaliencyMaps& maps) {
  const cv::Mat map = maps.of(artwork.picture);
  if (artwork.importance.empty()) return sums_over(map, artwork, patches);
  cv::Mat weighed;  // not the map itself, which others share
  cv::multiply(map, importance_map(artwork, map.size()), weighed);
  return sums_over(weighed, artwork, patches);
}

std::vector<double> centre_distances(const Artwork& artwork, const std::vector<Patch>& patches) {
  const Point<ArtworkFrame> centre{artwork.width / 2, artwork.height / 2};
  std::vector<double> out;
  out.reserve(patches.size());
  for (const Patch& patch : patches) {
    const Box<ArtworkFrame> box = bounds(patch.outline);
    out.push_back(-distance(centre, {(box.min.x + box.max.x) / 2, (box.min.y + box.max.y) / 2}).count());
  }
  return out;
}

}  // namespace

cv::Mat saliency_of(const cv::Mat& bgr) {
  const double scale = static_cast<double>(kSaliencySide) / std::min(bgr.cols, bgr.rows);
  const cv::Size size(std::max(kSaliencySide, static_cast<int>(std::lround(bgr.cols * scale))),
                      std::max(kSaliencySide, static_cast<int>(std::lround(bgr.rows * scale))));
  cv::Mat scaled;
  cv::resize(bgr, scaled, size, 0, 0, scale < 1 ? cv::INTER_AREA : cv::INTER_LINEAR);
  cv::Mat map;
  const auto saliency = cv::saliency::StaticSaliencyFineGrained::create();
  if (!saliency->computeSaliency(scaled, map) || map.empty()) return cv::Mat(size, CV_32FC1, cv::Scalar(0));
  cv::Mat out;
  map.convertTo(out, CV_32F);
  return out;
}

cv::Mat SaliencyMaps::of(const cv::Mat& bgr) {
  for (const Known& it : known_)
    if (it.picture.data == bgr.data && it.picture.size() == bgr.size() && it.picture.step == bgr.step) return it.map;
  return known_.emplace_back(Known{bgr, saliency_of(bgr)}).map;
}

std::vector<double> urgencies(const Artwork& artwork, const std::vector<Patch>& patches, Priority priority,
                              SaliencyMaps& maps) {
  return priority == Priority::kSaliency ? saliency_sums(artwork, patches, maps) : centre_distances(artwork, patches);
}

std::vector<double> importances(const Artwork& artwork, const std::vector<Patch>& patches) {
  if (artwork.importance.empty()) return std::vector<double>(patches.size(), 1.0);
  std::vector<double> out = sums_over(importance_map(artwork, artwork.importance.size()), artwork, patches);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const Ring<ArtworkFrame>& outline = patches[i].outline;
    const Box<ArtworkFrame> box = bounds(outline);
    out[i] /= is_upright_rectangle(outline) ? (box.width() * box.height()).count() : std::abs(signed_area(outline));
  }
  return out;
}

std::vector<std::size_t> by_urgency(const std::vector<double>& urgency) {
  std::vector<std::size_t> order(urgency.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return urgency[a] > urgency[b]; });
  return order;
}

}  // namespace veneer::planner
