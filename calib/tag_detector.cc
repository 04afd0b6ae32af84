#include "calib/tag_detector.h"

#include <apriltag/apriltag.h>
#include <apriltag/common/zarray.h>
#include <apriltag/tag36h11.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "calib/probe.h"

namespace veneer::calib {
namespace {

struct FamilyDeleter {
  void operator()(apriltag_family_t* family) const { tag36h11_destroy(family); }
};
struct DetectorDeleter {
  void operator()(apriltag_detector_t* detector) const { apriltag_detector_destroy(detector); }
};
struct DetectionsDeleter {
  void operator()(zarray_t* detections) const { apriltag_detections_destroy(detections); }
};

// Grey, 8 bit; rows may be padded.
cv::Mat grey_of(const cv::Mat& picture) {
  if (picture.type() == CV_8UC1) return picture;
  cv::Mat grey;
  if (picture.type() == CV_8UC3) cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

using Vec = Eigen::Vector2d;

// A line as a point on it and its direction.
struct EdgeLine {
  Vec at, along;
};

// Total least squares through the points, those farther than three times the scatter dropped.
std::optional<EdgeLine> fit_line(std::vector<Vec> points) {
  EdgeLine line;
  for (int pass = 0; pass < 3; ++pass) {
    if (points.size() < 6) return std::nullopt;
    Vec mean = Vec::Zero();
    for (const Vec& p : points) mean += p;
    mean /= static_cast<double>(points.size());
    Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
    for (const Vec& p : points) spread += (p - mean) * (p - mean).transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(spread);
    line = {mean, axes.eigenvectors().col(1)};
    const Vec across = axes.eigenvectors().col(0);
    const double scatter = std::sqrt(axes.eigenvalues()(0) / static_cast<double>(points.size()));
    const double limit = 3 * std::max(scatter, 0.02);
    std::erase_if(points, [&](const Vec& p) { return std::abs(across.dot(p - mean)) > limit; });
  }
  return line;
}

// Where the border between black (inside) and white runs between two corners. Across it the brightness rises from
// black to white; the area of the rise tells the place of the step whatever the (symmetric) blur.
std::optional<EdgeLine> refine_edge(const cv::Mat& grey, const Vec& from, const Vec& to, double cell) {
  const Vec along = (to - from).normalized(), outwards(-along.y(), along.x());
  const double reach = std::clamp(0.4 * cell, 1.5, 4.0), step = 0.25;
  const int half = static_cast<int>(reach / step);
  const double length = (to - from).norm();
  const int places = std::clamp(static_cast<int>(length), 8, 200);
  std::vector<std::vector<double>> profiles;
  double black = 0, white = 0;
  for (int i = 0; i < places; ++i) {
    const Vec middle = from + along * (length * (0.06 + 0.88 * (i + 0.5) / places));
    std::vector<double>& profile = profiles.emplace_back();
    for (int k = -half; k <= half; ++k) {
      const Vec at = middle + outwards * (k * step);
      profile.push_back(level_at(grey, at.x(), at.y()));
    }
    black += (profile[0] + profile[1]) / 2 / places;
    white += (profile[profile.size() - 1] + profile[profile.size() - 2]) / 2 / places;
  }
  if (white - black < 15) return std::nullopt;
  std::vector<Vec> points;
  for (int i = 0; i < places; ++i) {
    const Vec middle = from + along * (length * (0.06 + 0.88 * (i + 0.5) / places));
    const auto& profile = profiles[static_cast<std::size_t>(i)];
    double bright = 0;  // trapezoidal area over the black level
    for (std::size_t k = 0; k < profile.size(); ++k)
      bright += (k == 0 || k + 1 == profile.size() ? 0.5 : 1.0) * (profile[k] - black);
    points.emplace_back(middle + outwards * (half * step - bright * step / (white - black)));
  }
  return fit_line(std::move(points));
}

std::optional<Vec> crossing(const EdgeLine& a, const EdgeLine& b) {
  const double sine = a.along.x() * b.along.y() - a.along.y() * b.along.x();
  if (std::abs(sine) < 0.2) return std::nullopt;
  const Vec d = b.at - a.at;
  return a.at + a.along * ((d.x() * b.along.y() - d.y() * b.along.x()) / sine);
}

// Moves the corners to where the refined edges cross. The detector's own corners stay when an edge is unclear or the
// result strays.
void refine_corners(const cv::Mat& grey, double (&corners)[4][2]) {
  std::array<Vec, 4> now;
  for (std::size_t i = 0; i < 4; ++i) now[i] = Vec(corners[i][0], corners[i][1]);
  for (int pass = 0; pass < 2; ++pass) {
    const double cell = ((now[1] - now[0]).norm() + (now[2] - now[1]).norm()) / 16;
    std::array<EdgeLine, 4> edges;
    for (std::size_t i = 0; i < 4; ++i) {
      // Corners run counter-clockwise on the screen, where y is down: outwards is to the left of i + 1 -> i.
      const auto edge = refine_edge(grey, now[i], now[(i + 1) % 4], cell);
      if (!edge) return;
      edges[i] = *edge;
    }
    for (std::size_t i = 0; i < 4; ++i) {
      const auto corner = crossing(edges[(i + 3) % 4], edges[i]);
      if (!corner || (*corner - Vec(corners[i][0], corners[i][1])).norm() > 2) return;
      now[i] = *corner;
    }
  }
  for (std::size_t i = 0; i < 4; ++i) corners[i][0] = now[i].x(), corners[i][1] = now[i].y();
}

template <class Frame>
Tag<Frame> tag_of(const apriltag_detection_t& found) {
  Tag<Frame> tag;
  tag.id = found.id;
  for (std::size_t i = 0; i < 4; ++i) tag.corners[i] = point<Frame>(found.p[i][0], found.p[i][1]);
  tag.centre = point<Frame>(found.c[0], found.c[1]);
  tag.decision_margin = found.decision_margin;
  return tag;
}

}  // namespace

template <class Frame>
std::vector<Tag<Frame>> detect_tags(const cv::Mat& picture, const TagOptions& options) {
  cv::Mat grey = grey_of(picture);
  if (grey.empty()) return {};

  // The family outlives the detector that refers to it.
  const std::unique_ptr<apriltag_family_t, FamilyDeleter> family(tag36h11_create());
  const std::unique_ptr<apriltag_detector_t, DetectorDeleter> detector(apriltag_detector_create());
  apriltag_detector_add_family_bits(detector.get(), family.get(), options.corrected_bits);
  detector->quad_decimate = static_cast<float>(options.decimate);
  detector->refine_edges = true;
  // libapriltag 3.3's pool of threads may read a task while the list of tasks moves, and then jumps anywhere
  // (github.com/AprilRobotics/apriltag/pull/339). With one thread there is no pool.
  detector->nthreads = 1;

  image_u8_t view{grey.cols, grey.rows, static_cast<int>(grey.step[0]), grey.data};
  const std::unique_ptr<zarray_t, DetectionsDeleter> found(apriltag_detector_detect(detector.get(), &view));

  std::vector<Tag<Frame>> tags;
  for (int i = 0; i < zarray_size(found.get()); ++i) {
    apriltag_detection_t* detection = nullptr;
    zarray_get(found.get(), i, static_cast<void*>(&detection));
    if (detection->decision_margin < options.min_decision_margin) continue;
    refine_corners(grey, detection->p);
    tags.push_back(tag_of<Frame>(*detection));
  }
  std::stable_sort(tags.begin(), tags.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  return tags;
}

template std::vector<Tag<ScanFrame>> detect_tags<ScanFrame>(const cv::Mat&, const TagOptions&);
template std::vector<Tag<CameraFrame>> detect_tags<CameraFrame>(const cv::Mat&, const TagOptions&);

}  // namespace veneer::calib
