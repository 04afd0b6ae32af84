#include "daemon/stock/piece_picture.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "base/polygon_ops.h"

namespace veneer::daemon {
namespace {

constexpr Millimetres kReach{0.2};  // an edge that two pieces share is the same line, but for the web between them
constexpr Millimetres kSharedEdge{1};
constexpr double kMargin = 0.35;  // of the wood around it, in parts of its own size
constexpr int kShift = 4;         // OpenCV draws in sixteenths of a pixel
const cv::Scalar kBeyond(235, 235, 235);

// What of the map lies in this box of the artwork.
cv::Mat upright(const Raster<PanelFrame>& map, const Isometry2<PanelFrame, ArtworkFrame>& panel_from_artwork,
                const Box<ArtworkFrame>& box, double scale) {
  const cv::Size size(std::max(1, cvRound(box.width().count() * scale)),
                      std::max(1, cvRound(box.height().count() * scale)));
  // Three corners of the picture, through the artwork, to the map.
  cv::Point2f here[3], there[3];
  for (const int i : {0, 1, 2}) {
    const double x = i == 1 ? size.width : 0, y = i == 2 ? size.height : 0;
    double column = 0, row = 0;
    map.to_pixels(
        panel_from_artwork * point<ArtworkFrame>(box.min.x.count() + x / scale, box.max.y.count() - y / scale), column,
        row);
    // OpenCV has pixel centres at whole numbers.
    here[i] = cv::Point2f(static_cast<float>(x - 0.5), static_cast<float>(y - 0.5));
    there[i] = cv::Point2f(static_cast<float>(column - 0.5), static_cast<float>(row - 0.5));
  }
  cv::Mat wood;
  cv::warpAffine(map.pixels, wood, cv::getAffineTransform(here, there), size,
                 (scale < map.resolution.px_per_mm / 2 ? cv::INTER_AREA : cv::INTER_LINEAR) | cv::WARP_INVERSE_MAP,
                 cv::BORDER_CONSTANT, kBeyond);
  return wood;
}

std::vector<cv::Point> pixels_of(const Ring<ArtworkFrame>& outline, const Box<ArtworkFrame>& box, double scale) {
  std::vector<cv::Point> out;
  for (const auto& p : outline)
    out.emplace_back(cvRound(((p.x - box.min.x).count() * scale - 0.5) * (1 << kShift)),
                     cvRound(((box.max.y - p.y).count() * scale - 0.5) * (1 << kShift)));
  return out;
}

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
  auto box = bounds(piece.artwork_outline);
  const Millimetres margin = kMargin * std::max(box.width(), box.height());
  box.min = {box.min.x - margin, box.min.y - margin}, box.max = {box.max.x + margin, box.max.y + margin};
  const double scale = std::min(map.resolution.px_per_mm, width_px / box.width().count());
  const cv::Mat wood = upright(map, piece.panel_from_artwork, box, scale);
  const std::vector outline{pixels_of(piece.artwork_outline, box, scale)};
  cv::Mat inside(wood.size(), CV_8UC1, cv::Scalar(0));
  cv::fillPoly(inside, outline, cv::Scalar(255), cv::LINE_8, kShift);
  cv::Mat out;
  cv::addWeighted(wood, 0.4, cv::Mat(wood.size(), CV_8UC3, kBeyond), 0.6, 0, out);
  wood.copyTo(out, inside);
  cv::polylines(out, outline, true, cv::Scalar(40, 40, 40), 1, cv::LINE_AA, kShift);
  return out;
}

cv::Mat cut_out_piece(const Raster<PanelFrame>& map, const Ring<ArtworkFrame>& outline,
                      const Isometry2<PanelFrame, ArtworkFrame>& panel_from_artwork, int side_px) {
  if (outline.empty()) return {};
  const auto box = bounds(outline);
  const double side = std::max(box.width(), box.height()).count();
  const double scale = std::min(map.resolution.px_per_mm, side_px / side);
  cv::Mat out;
  cv::cvtColor(upright(map, panel_from_artwork, box, scale), out, cv::COLOR_BGR2BGRA);
  cv::Mat inside(out.size(), CV_8UC1, cv::Scalar(0));
  cv::fillPoly(inside, std::vector{pixels_of(outline, box, scale)}, cv::Scalar(255), cv::LINE_AA, kShift);
  cv::insertChannel(inside, out, 3);
  return out;
}

}  // namespace veneer::daemon
