#include "planner/grain/grain_coherence.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "planner/matching/patch_pixels.h"

namespace veneer::planner {
namespace {

constexpr int kNobody = -1;
constexpr int kLookedAtStep = 2;  // one row and column in so many is looked at

// Of each pixel the piece that it belongs to.
cv::Mat pieces_of(const Plan& plan, std::size_t artwork, const Raster<ArtworkFrame>& preview) {
  cv::Mat out(preview.pixels.size(), CV_32SC1, cv::Scalar(kNobody));
  const PixelGrid grid{preview.resolution, plan.artworks[artwork].height};
  for (std::size_t i = 0; i < plan.pieces.size(); ++i) {
    if (plan.pieces[i].artwork != artwork || !plan.pieces[i].placement) continue;
    const PatchPixels pixels = patch_pixels(plan.pieces[i].artwork_outline, grid, out.cols, out.rows);
    for (const PatchPixels::Span& span : pixels.spans)
      std::fill(out.ptr<int>(span.row) + span.begin, out.ptr<int>(span.row) + span.end, static_cast<int>(i));
  }
  return out;
}

float grey_at(const cv::Mat& bgr, int row, int column) {
  const auto& p = bgr.at<cv::Vec3b>(row, column);
  return 0.114F * static_cast<float>(p[0]) + 0.587F * static_cast<float>(p[1]) + 0.299F * static_cast<float>(p[2]);
}

// Of each piece twice the angle of its grain, as long as it is sure; only pixels with all neighbours in the piece.
std::vector<cv::Vec2d> directions(const cv::Mat& bgr, const cv::Mat& pieces, std::size_t count) {
  std::vector<cv::Vec3d> tensors(count, cv::Vec3d::all(0));
  for (int r = 1; r + 1 < bgr.rows; r += kLookedAtStep)
    for (int c = 1; c + 1 < bgr.cols; c += kLookedAtStep) {
      const int piece = pieces.at<int>(r, c);
      if (piece == kNobody || pieces.at<int>(r, c - 1) != piece || pieces.at<int>(r, c + 1) != piece ||
          pieces.at<int>(r - 1, c) != piece || pieces.at<int>(r + 1, c) != piece)
        continue;
      const double dx = grey_at(bgr, r, c + 1) - grey_at(bgr, r, c - 1);
      const double dy = grey_at(bgr, r + 1, c) - grey_at(bgr, r - 1, c);
      tensors[static_cast<std::size_t>(piece)] += cv::Vec3d(dx * dx - dy * dy, 2 * dx * dy, dx * dx + dy * dy);
    }
  std::vector<cv::Vec2d> out;
  out.reserve(count);
  for (const cv::Vec3d& t : tensors) out.push_back(t[2] > 0 ? cv::Vec2d(-t[0] / t[2], -t[1] / t[2]) : cv::Vec2d(0, 0));
  return out;
}

}  // namespace

GrainCoherence grain_coherence(const Plan& plan, std::size_t artwork, const Raster<ArtworkFrame>& preview) {
  const cv::Mat pieces = pieces_of(plan, artwork, preview);
  const std::vector<cv::Vec2d> grain = directions(preview.pixels, pieces, plan.pieces.size());
  std::map<std::pair<int, int>, int> borders;  // in pixels
  const auto meet = [&](int a, int b) {
    if (a != b && a != kNobody && b != kNobody) ++borders[std::minmax(a, b)];
  };
  for (int r = 0; r < pieces.rows; r += kLookedAtStep)
    for (int c = 0; c + 1 < pieces.cols; ++c) meet(pieces.at<int>(r, c), pieces.at<int>(r, c + 1));
  for (int r = 0; r + 1 < pieces.rows; ++r)
    for (int c = 0; c < pieces.cols; c += kLookedAtStep) meet(pieces.at<int>(r, c), pieces.at<int>(r + 1, c));
  GrainCoherence out;
  for (const auto& [pair, length] : borders) {
    const cv::Vec2d &a = grain[static_cast<std::size_t>(pair.first)], &b = grain[static_cast<std::size_t>(pair.second)];
    out.agreement += length * a.dot(b), out.weight += length * cv::norm(a) * cv::norm(b);
  }
  return out;
}

}  // namespace veneer::planner
