#include "tests/support/label_reader.h"

#include <apriltag/apriltag.h>
#include <apriltag/common/zarray.h>
#include <apriltag/tagStandard41h12.h>

#include <algorithm>
#include <memory>

namespace veneer::tests {

std::vector<int> label_tags_on(const cv::Mat& grey) {
  const std::unique_ptr<apriltag_family_t, decltype(&tagStandard41h12_destroy)> family(tagStandard41h12_create(),
                                                                                       tagStandard41h12_destroy);
  const std::unique_ptr<apriltag_detector_t, decltype(&apriltag_detector_destroy)> detector(apriltag_detector_create(),
                                                                                            apriltag_detector_destroy);
  apriltag_detector_add_family_bits(detector.get(), family.get(), 1);
  detector->nthreads = 1;
  image_u8_t view{grey.cols, grey.rows, static_cast<int>(grey.step[0]), grey.data};
  const std::unique_ptr<zarray_t, decltype(&apriltag_detections_destroy)> found(
      apriltag_detector_detect(detector.get(), &view), apriltag_detections_destroy);
  std::vector<int> numbers;
  for (int i = 0; i < zarray_size(found.get()); ++i) {
    apriltag_detection_t* detection = nullptr;
    zarray_get(found.get(), i, static_cast<void*>(&detection));
    numbers.push_back(detection->id);
  }
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

}  // namespace veneer::tests
