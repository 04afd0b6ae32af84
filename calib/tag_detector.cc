#include "calib/tag_detector.h"

#include <apriltag/apriltag.h>
#include <apriltag/common/zarray.h>
#include <apriltag/tag36h11.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <opencv2/imgproc.hpp>

#include "calib/tag_border.h"

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

template <class Frame>
Tag<Frame> tag_of(const apriltag_detection_t& found, const TagCorners& corners) {
  Tag<Frame> tag;
  tag.id = found.id;
  for (std::size_t i = 0; i < 4; ++i) tag.corners[i] = point<Frame>(corners[i].x(), corners[i].y());
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
    TagCorners corners;
    for (std::size_t k = 0; k < 4; ++k) corners[k] = {detection->p[k][0], detection->p[k][1]};
    tags.push_back(tag_of<Frame>(*detection, refine_corners(grey, corners)));
  }
  std::stable_sort(tags.begin(), tags.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  return tags;
}

template std::vector<Tag<ScanFrame>> detect_tags<ScanFrame>(const cv::Mat&, const TagOptions&);
template std::vector<Tag<CameraFrame>> detect_tags<CameraFrame>(const cv::Mat&, const TagOptions&);

}  // namespace veneer::calib
