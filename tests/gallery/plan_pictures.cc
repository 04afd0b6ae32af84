#include "tests/gallery/plan_pictures.h"

#include <fmt/format.h>

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "planner/pictures/pictures.h"

namespace veneer::gallery {
namespace {

constexpr int kShift = 4;  // OpenCV draws at sixteenths of a pixel
constexpr int kEnlarged = 2;
const cv::Scalar kLine(24, 28, 34);
const cv::Scalar kJoint(206, 214, 220);
const cv::Scalar kGone(255, 255, 255);

// A ring in pixels of a picture that shows `height` upright. OpenCV's pixel centres lie at 0.
template <class Frame>
std::vector<cv::Point> drawn(const Ring<Frame>& ring, double px_per_mm, Millimetres height) {
  std::vector<cv::Point> out;
  constexpr double kUnit = 1 << kShift;
  for (const auto& point : ring) {
    const double x = point.x.count() * px_per_mm - 0.5, y = (height - point.y).count() * px_per_mm - 0.5;
    out.emplace_back(static_cast<int>(std::lround(x * kUnit)), static_cast<int>(std::lround(y * kUnit)));
  }
  return out;
}

struct Outlines {
  std::vector<std::vector<cv::Point>> rings;  // of the artwork's pieces
  std::vector<bool> filled;                   // whether they have wood
};
Outlines outlines_of(const PlanView& view, cv::Size size) {
  const planner::PlanArtwork& artwork = view.run.plan.artworks[view.artwork];
  const double px_per_mm = size.width / artwork.width.count();
  Outlines out;
  for (const planner::Piece& piece : view.run.plan.pieces) {
    if (piece.artwork != view.artwork) continue;
    out.rings.push_back(drawn(piece.artwork_outline, px_per_mm, artwork.height));
    out.filled.push_back(piece.placement.has_value());
  }
  return out;
}

void draw_lines(cv::Mat& picture, const Outlines& outlines, const cv::Scalar& colour, int thickness) {
  cv::polylines(picture, outlines.rings, true, colour, thickness, cv::LINE_AA, kShift);
}

// Each piece in the mean that `colours` has there.
cv::Mat means(const cv::Mat& colours, const Outlines& outlines) {
  cv::Mat labels(colours.size(), CV_32SC1, cv::Scalar(-1));
  for (std::size_t i = 0; i < outlines.rings.size(); ++i)
    cv::fillPoly(labels, std::vector{outlines.rings[i]}, cv::Scalar(static_cast<double>(i)), cv::LINE_8, kShift);
  std::vector<cv::Vec4d> sums(outlines.rings.size());
  for (int r = 0; r < colours.rows; ++r)
    for (int c = 0; c < colours.cols; ++c) {
      const int label = labels.at<int>(r, c);
      if (label < 0) continue;
      const cv::Vec3b& bgr = colours.at<cv::Vec3b>(r, c);
      sums[static_cast<std::size_t>(label)] += cv::Vec4d(bgr[0], bgr[1], bgr[2], 1);
    }
  cv::Mat out = colours.clone();
  for (int r = 0; r < colours.rows; ++r)
    for (int c = 0; c < colours.cols; ++c) {
      const int label = labels.at<int>(r, c);
      if (label < 0) continue;
      const cv::Vec4d& sum = sums[static_cast<std::size_t>(label)];
      for (int k = 0; k < 3; ++k)
        out.at<cv::Vec3b>(r, c)[k] = cv::saturate_cast<std::uint8_t>(sum[k] / std::max(1.0, sum[3]));
    }
  return out;
}

cv::Mat enlarged(const cv::Mat& picture, int interpolation) {
  cv::Mat out;
  cv::resize(picture, out, {}, kEnlarged, kEnlarged, interpolation);
  return out;
}

}  // namespace

Result<cv::Mat> preview_picture(const PlanView& view) {
  // As `veneerctl plan` names them.
  const std::string name =
      view.artwork == 0 ? "preview.png" : fmt::format("preview-{}.png", view.run.plan.artworks[view.artwork].letter);
  return planner::load_picture(view.run.folder / name);
}

Result<cv::Mat> with_cut_lines(const PlanView& view) {
  const auto preview = preview_picture(view);
  if (!preview.ok()) return preview;
  cv::Mat out = enlarged(*preview, cv::INTER_CUBIC);
  draw_lines(out, outlines_of(view, out.size()), kLine, 1);
  return out;
}

Result<cv::Mat> in_mean_colours(const PlanView& view) {
  const auto preview = preview_picture(view);
  if (!preview.ok()) return preview;
  return means(*preview, outlines_of(view, preview->size()));
}

Result<cv::Mat> in_flat_colours(const PlanView& view) {
  const auto preview = preview_picture(view);
  if (!preview.ok()) return preview;
  cv::Mat target;
  cv::resize(view.target, target, preview->size() * kEnlarged, 0, 0, cv::INTER_CUBIC);
  const Outlines outlines = outlines_of(view, target.size());
  cv::Mat out = means(target, outlines);
  draw_lines(out, outlines, kJoint, 2);
  return out;
}

Result<cv::Mat> taken_wood(const PlanView& view) {
  auto panel = planner::load_picture(view.wood);
  if (!panel.ok()) return panel;
  cv::Mat out = *panel;
  const planner::PlanPanel& first = view.run.plan.panels.front();
  const double px_per_mm = out.cols / first.width.count();
  for (const planner::Piece& piece : view.run.plan.pieces)
    if (piece.placement && piece.placement->panel == first.id)
      cv::fillPoly(out, std::vector{drawn(piece.panel_outline(), px_per_mm, first.height)}, kGone, cv::LINE_AA, kShift);
  return out;
}

}  // namespace veneer::gallery
