#include "planner/boundaries/wood_claims.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "planner/parallel.h"

namespace veneer::planner {
namespace {

// The surroundings of one face, pixel by pixel of its window and somewhat beyond.
class Surroundings {
 public:
  Surroundings(std::size_t self, std::span<const PlacedFace> faces, std::span<const Box<PanelFrame>> boxes,
               const std::vector<MatchPanel>& panels, Millimetres margin)
      : self_(self),
        faces_(faces),
        boxes_(boxes),
        features_(faces[self].artwork->features),
        grid_(faces[self].artwork->grid),
        placement_(**faces[self].placement),
        panel_(panels[static_cast<std::size_t>(placement_.panel)]) {
    apart_ = grid_.resolution.to_px(panel_.wood.kerf() * 2 + margin * 2).count() + kRaster;
    border_ = grid_.resolution.to_px(panel_.wood.border() + margin).count() + kRaster;
    const int pad = static_cast<int>(std::ceil(std::max(apart_, border_))) + 2;
    const cv::Rect& window = faces[self].window;
    wide_ = cv::Rect(window.x - pad, window.y - pad, window.width + 2 * pad, window.height + 2 * pad);
  }

  cv::Mat cost() const {
    const cv::Rect& window = faces_[self_].window;
    const cv::Rect inner(window.tl() - wide_.tl(), window.size());
    cv::Mat to_blocked(inner.size(), CV_32FC1, cv::Scalar(1e9));  // nearly always there is none near by
    if (const cv::Mat gone = blocked(); cv::countNonZero(gone) > 0) to_blocked = distance_from(gone)(inner);
    const cv::Mat own = own_pixels();
    const cv::Mat to_own = distance_from(own)(inner);
    cv::Mat to_others(inner.size(), CV_32FC1, cv::Scalar(1e9));
    if (const cv::Mat theirs = others(); !theirs.empty()) to_others = distance_from(theirs)(inner);
    cv::Mat out = sampled();
    for (int r = 0; r < out.rows; ++r)
      for (int c = 0; c < out.cols; ++c) {
        const bool free = static_cast<double>(to_blocked.at<float>(r, c)) >= border_ &&
                          static_cast<double>(to_others.at<float>(r, c) - to_own.at<float>(r, c)) >= apart_;
        const bool lies_there = own.at<std::uint8_t>(inner.y + r, inner.x + c) != 0;
        if (!free && !lies_there) out.at<float>(r, c) = kForbidden;
      }
    return out;
  }

 private:
  static constexpr double kRaster = 0.5;  // pixels: what drawing and distances on a raster may be wrong by

  static cv::Mat distance_from(const cv::Mat& shapes) {
    cv::Mat away, out;
    cv::bitwise_not(shapes, away);
    cv::distanceTransform(away, out, cv::DIST_L2, cv::DIST_MASK_5);
    return out;
  }

  cv::Mat own_pixels() const {
    cv::Mat out(wide_.size(), CV_8UC1, cv::Scalar(0));
    const PatchPixels own = patch_pixels(faces_[self_].outline, grid_, features_.cols, features_.rows);
    for (const PatchPixels::Span& span : own.spans)
      out.row(span.row - wide_.y).colRange(span.begin - wide_.x, span.end - wide_.x).setTo(255);
    return out;
  }
  // An outline on the face's panel, where this face's pose shows it.
  void draw(const Ring<ArtworkFrame>& outline, const Isometry2<PanelFrame, ArtworkFrame>& there, cv::Mat& on) const {
    constexpr int kShift = 6;
    const Isometry2<ArtworkFrame, ArtworkFrame> here = placement_.panel_from_artwork.inverse() * there;
    std::vector<cv::Point> corners;
    for (const auto& p : outline) {
      const Point<ArtworkFrame> q = here * p;
      const double x = grid_.resolution.to_px(q.x).count() - wide_.x - 0.5;
      const double y = grid_.resolution.to_px(grid_.height - q.y).count() - wide_.y - 0.5;
      corners.emplace_back(cvRound(x * (1 << kShift)), cvRound(y * (1 << kShift)));
    }
    cv::fillPoly(on, std::vector<std::vector<cv::Point>>{corners}, cv::Scalar(255), cv::LINE_8, kShift);
  }

  // The pieces near by; empty when there are none.
  cv::Mat others() const {
    const Millimetres reach = grid_.resolution.to_mm(Pixels(std::hypot(wide_.width, wide_.height)));
    const Box<PanelFrame>& own = boxes_[self_];
    cv::Mat out;
    for (std::size_t i = 0; i < faces_.size(); ++i) {
      const auto& placement = *faces_[i].placement;
      if (i == self_ || !placement || placement->panel != placement_.panel) continue;
      const Box<PanelFrame>& box = boxes_[i];
      if (box.min.x > own.max.x + reach || own.min.x > box.max.x + reach || box.min.y > own.max.y + reach ||
          own.min.y > box.max.y + reach)
        continue;
      if (out.empty()) out = cv::Mat(wide_.size(), CV_8UC1, cv::Scalar(0));
      draw(faces_[i].outline, placement->panel_from_artwork, out);
    }
    return out;
  }

  Point<PanelFrame> on_panel(double column, double row) const {
    return placement_.panel_from_artwork * Point<ArtworkFrame>{grid_.resolution.to_mm(Pixels(column)),
                                                               grid_.height - grid_.resolution.to_mm(Pixels(row))};
  }

  cv::Mat blocked() const {
    const Raster<PanelFrame>& free = panel_.wood.raster();
    cv::Mat out(wide_.size(), CV_8UC1);
    double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
    free.to_pixels(on_panel(wide_.x + 0.5, wide_.y + 0.5), x0, y0);
    free.to_pixels(on_panel(wide_.x + 1.5, wide_.y + 0.5), x1, y1);
    const double dx = x1 - x0, dy = y1 - y0;  // of one column; a row is that turned
    for (int r = 0; r < out.rows; ++r)
      for (int c = 0; c < out.cols; ++c) {
        const auto x = static_cast<int>(std::floor(x0 + dx * c - dy * r));
        const auto y = static_cast<int>(std::floor(y0 + dy * c + dx * r));
        const bool inside = x >= 0 && y >= 0 && x < free.pixels.cols && y < free.pixels.rows;
        out.at<std::uint8_t>(r, c) = inside && free.pixels.at<std::uint8_t>(y, x) != 0 ? 0 : 255;
      }
    return out;
  }

  // Squared distance of features, the panel's sampled bilinearly.
  cv::Mat sampled() const {
    const cv::Rect& window = faces_[self_].window;
    const cv::Mat& map = panel_.features.pixels;
    const int channels = map.channels();
    double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
    panel_.features.to_pixels(on_panel(window.x + 0.5, window.y + 0.5), x0, y0);
    panel_.features.to_pixels(on_panel(window.x + 1.5, window.y + 0.5), x1, y1);
    const double dx = x1 - x0, dy = y1 - y0;
    cv::Mat out(window.size(), CV_32FC1);
    for (int r = 0; r < out.rows; ++r) {
      const auto* target = features_.ptr<float>(window.y + r) + static_cast<std::ptrdiff_t>(window.x) * channels;
      for (int c = 0; c < out.cols; ++c) {
        const double x = std::clamp(x0 + dx * c - dy * r - 0.5, 0.0, map.cols - 1.0);
        const double y = std::clamp(y0 + dy * c + dx * r - 0.5, 0.0, map.rows - 1.0);
        const int column = std::min(static_cast<int>(x), std::max(map.cols - 2, 0));
        const int row = std::min(static_cast<int>(y), std::max(map.rows - 2, 0));
        const auto fx = static_cast<float>(x - column), fy = static_cast<float>(y - row);
        const int right = map.cols > 1 ? channels : 0;
        const auto* upper = map.ptr<float>(row) + static_cast<std::ptrdiff_t>(column) * channels;
        const auto* lower =
            map.ptr<float>(std::min(row + 1, map.rows - 1)) + static_cast<std::ptrdiff_t>(column) * channels;
        float sum = 0;
        for (int ch = 0; ch < channels; ++ch) {
          const float above = upper[ch] + fx * (upper[ch + right] - upper[ch]);
          const float below = lower[ch] + fx * (lower[ch + right] - lower[ch]);
          const float d = above + fy * (below - above) - target[c * channels + ch];
          sum += d * d;
        }
        out.at<float>(r, c) = sum;
      }
    }
    return out;
  }

  std::size_t self_;
  std::span<const PlacedFace> faces_;
  std::span<const Box<PanelFrame>> boxes_;
  const cv::Mat& features_;
  const PixelGrid& grid_;
  const PatchPlacement& placement_;
  const MatchPanel& panel_;
  double apart_ = 0, border_ = 0;
  cv::Rect wide_;
};

}  // namespace

Result<std::vector<FaceCost>> wood_around(std::span<const PlacedFace> faces, const std::vector<MatchPanel>& panels,
                                          Millimetres margin, int threads, const std::stop_token& stop) {
  std::vector<FaceCost> out(faces.size());
  std::vector<Box<PanelFrame>> boxes(faces.size());
  for (std::size_t i = 0; i < faces.size(); ++i)
    if (*faces[i].placement) boxes[i] = bounds((*faces[i].placement)->panel_from_artwork * faces[i].outline);
  const Status done = run_parallel(faces.size(), threads, stop, [&](std::size_t i) {
    out[i].window = faces[i].window;
    if (*faces[i].placement) {
      out[i].cost = Surroundings(i, faces, boxes, panels, margin).cost();
      return;
    }
    // A hole stays as it is: nobody grows into it, and it grows nowhere.
    out[i].cost = cv::Mat(faces[i].window.size(), CV_32FC1, cv::Scalar(kForbidden));
    const WorkingArtwork& artwork = *faces[i].artwork;
    const PatchPixels own = patch_pixels(faces[i].outline, artwork.grid, artwork.features.cols, artwork.features.rows);
    for (const PatchPixels::Span& span : own.spans)
      out[i]
          .cost.row(span.row - faces[i].window.y)
          .colRange(span.begin - faces[i].window.x, span.end - faces[i].window.x)
          .setTo(-kForbidden);
  });
  if (!done.ok()) return done.error();
  return out;
}

}  // namespace veneer::planner
