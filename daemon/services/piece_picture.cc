#include "daemon/services/piece_picture.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "base/polygon_ops.h"

namespace veneer::daemon {
namespace {

constexpr Millimetres kReach{0.2};  // an edge that two pieces share is the same line, but for the web between them
constexpr Millimetres kSharedEdge{1};
constexpr double kMargin = 0.35;  // of the wood around it, in parts of its own size

}  // namespace

std::vector<std::string> neighbours_of(const db::PieceRecord& piece, const std::vector<db::PieceRecord>& pieces) {
  std::vector<std::string> out;
  if (piece.artwork_outline.empty()) return out;
  const auto grown = offset(Region<ArtworkFrame>(piece.artwork_outline), kReach);
  const auto box = bounds(grown.rings().front());
  for (const auto& other : pieces) {
    if (other.id == piece.id || other.artwork_outline.empty()) continue;
    const auto reach = bounds(other.artwork_outline);
    if (reach.min.x > box.max.x || reach.max.x < box.min.x || reach.min.y > box.max.y || reach.max.y < box.min.y)
      continue;
    const auto shared = intersect(grown, Region<ArtworkFrame>(other.artwork_outline));
    if (shared.area() > kReach * kSharedEdge) out.push_back(other.mark);
  }
  return out;
}

cv::Mat draw_piece(const Raster<PanelFrame>& map, const db::PieceRecord& piece, int width_px) {
  if (!piece.panel || piece.artwork_outline.empty()) return {};
  const auto box = bounds(piece.artwork_outline);
  const double width = (box.max.x - box.min.x).count(), height = (box.max.y - box.min.y).count();
  const double margin = kMargin * std::max(width, height);
  const double scale = std::min(map.resolution.px_per_mm, width_px / (width + 2 * margin));
  const cv::Size size(std::max(1, static_cast<int>((width + 2 * margin) * scale)),
                      std::max(1, static_cast<int>((height + 2 * margin) * scale)));
  // Three corners of the picture, through the artwork, to the map.
  const auto of_picture = [&](double x, double y) {
    return point<ArtworkFrame>(box.min.x.count() - margin + x / scale, box.max.y.count() + margin - y / scale);
  };
  cv::Point2f here[3], there[3];
  for (const int i : {0, 1, 2}) {
    const double x = i == 1 ? size.width : 0, y = i == 2 ? size.height : 0;
    double column = 0, row = 0;
    map.to_pixels(piece.panel_from_artwork * of_picture(x, y), column, row);
    // OpenCV has pixel centres at whole numbers.
    here[i] = cv::Point2f(static_cast<float>(x - 0.5), static_cast<float>(y - 0.5));
    there[i] = cv::Point2f(static_cast<float>(column - 0.5), static_cast<float>(row - 0.5));
  }
  cv::Mat wood;
  cv::warpAffine(map.pixels, wood, cv::getAffineTransform(here, there), size,
                 (scale < map.resolution.px_per_mm / 2 ? cv::INTER_AREA : cv::INTER_LINEAR) | cv::WARP_INVERSE_MAP,
                 cv::BORDER_CONSTANT, cv::Scalar(235, 235, 235));
  constexpr int kShift = 4;
  std::vector<cv::Point> outline;
  for (const auto& p : piece.artwork_outline)
    outline.emplace_back(cvRound((((p.x - box.min.x).count() + margin) * scale - 0.5) * (1 << kShift)),
                         cvRound((((box.max.y - p.y).count() + margin) * scale - 0.5) * (1 << kShift)));
  cv::Mat inside(size, CV_8UC1, cv::Scalar(0));
  cv::fillPoly(inside, std::vector{outline}, cv::Scalar(255), cv::LINE_8, kShift);
  cv::Mat out;
  cv::addWeighted(wood, 0.4, cv::Mat(size, CV_8UC3, cv::Scalar(235, 235, 235)), 0.6, 0, out);
  wood.copyTo(out, inside);
  cv::polylines(out, std::vector{outline}, true, cv::Scalar(40, 40, 40), 1, cv::LINE_AA, kShift);
  return out;
}

}  // namespace veneer::daemon
