#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "calib/bed_pose.h"

namespace veneer::calib {
namespace {

// Okabe-Ito blue and orange; shape and text say the same as the colour.
const cv::Scalar kBlue(178, 114, 0), kOrange(0, 159, 230), kWhite(255, 255, 255), kBlack(0, 0, 0);

struct Pen {
  cv::Mat& picture;
  const CameraModel& model;
  Millimetres height;
  const Isometry2<BedFrame, PanelFrame>& bed_from_panel;

  cv::Point at(const Point<PanelFrame>& p) const {
    const auto seen = model.camera_from_bed(bed_from_panel * p, height);
    return {static_cast<int>(std::floor(seen.x.count())), static_cast<int>(std::floor(seen.y.count()))};
  }
  // Straight on the panel, bent by the lens.
  void line(const Point<PanelFrame>& a, const Point<PanelFrame>& b, const cv::Scalar& colour, int width) const {
    const int steps = std::max(1, static_cast<int>(distance(a, b) / Millimetres(15)));
    cv::Point from = at(a);
    for (int i = 1; i <= steps; ++i) {
      const double t = static_cast<double>(i) / steps;
      const cv::Point to = at({a.x + (b.x - a.x) * t, a.y + (b.y - a.y) * t});
      cv::line(picture, from, to, colour, width, cv::LINE_AA);
      from = to;
    }
  }
  void ring(std::span<const Point<PanelFrame>> points, const cv::Scalar& colour, int width) const {
    for (std::size_t i = 0; i < points.size(); ++i) line(points[i], points[(i + 1) % points.size()], colour, width);
  }
  void text(cv::Point where, const std::string& words, double size) const {
    const int width = std::max(1, static_cast<int>(std::lround(size * 2)));
    cv::putText(picture, words, where, cv::FONT_HERSHEY_SIMPLEX, size, kBlack, width * 3, cv::LINE_AA);
    cv::putText(picture, words, where, cv::FONT_HERSHEY_SIMPLEX, size, kWhite, width, cv::LINE_AA);
  }
};

}  // namespace

cv::Mat draw_pose(const cv::Mat& picture, const CameraModel& model, Millimetres height, const BedPose& pose,
                  const PanelFiducials& fiducials, std::span<const Point<PanelFrame>> outline) {
  cv::Mat out;
  if (picture.channels() == 1) {
    cv::cvtColor(picture, out, cv::COLOR_GRAY2BGR);
  } else {
    out = picture.clone();
  }
  const int width = std::max(1, out.cols / 800);
  const double letters = out.cols / 2200.0;
  const Pen pen{out, model, height, pose.bed_from_panel};
  pen.ring(outline, kBlue, 2 * width);
  for (const int id : pose.tags) {
    const PanelTag* tag = fiducials.tag(id);
    if (tag == nullptr) continue;
    pen.ring(tag->corners, kOrange, width);
    pen.text(pen.at(tag->corners[2]), std::to_string(id), letters);
  }
  pen.text({out.cols / 60, out.rows / 20},
           fmt::format("{}, {} up, {} tags, {:.3f} mm rms", pose.panel.value,
                       pose.face_up == Face::kShow ? "show face" : "back", pose.tags.size(), pose.rms.count()),
           letters * 1.4);
  return out;
}

}  // namespace veneer::calib
