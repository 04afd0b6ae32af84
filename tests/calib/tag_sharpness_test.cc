// A scan says by its tags how sharp it is.
#include "calib/tag_sharpness.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "tests/calib/scanned_panel.h"

namespace veneer::scanned {
namespace {

// The plain cell's panel, drawn once.
const cv::Mat& sharp_scan() {
  static const cv::Mat scan = [] {
    const Cell& cell = plain_cell();
    return scan_panel(cell.panel, Face::kShow, cell.whole(Face::kShow), cell.scanner);
  }();
  return scan;
}

ScanResolution resolution() { return plain_cell().scanner.nominal(); }

cv::Mat blurred_by(double mm, double mm_along_y) {
  cv::Mat out;
  cv::GaussianBlur(sharp_scan(), out, {}, mm * resolution().px_per_mm, mm_along_y * resolution().px_per_mm);
  return out;
}

std::vector<calib::TagSharpness> look(const cv::Mat& scan) {
  return calib::measure_sharpness(scan, calib::detect_tags<ScanFrame>(scan), resolution());
}

// 150 dpi, optics of 0.6 px; a pixel sees all of its square, and between pixels lies a mean of them.
const double kOwn = std::sqrt(0.6 * 0.6 + 1.0 / 12 + 1.0 / 6) * 25.4 / 150;

TEST(TagSharpness, IsTheBlurThatTheScanHas) {
  const auto sharp = look(sharp_scan());
  ASSERT_GE(sharp.size(), 3U);
  for (const auto& tag : sharp) EXPECT_NEAR(tag.blur.count(), kOwn, 0.1 * kOwn) << tag.id;
  for (const double more : {0.2, 0.3, 0.4}) {
    const auto soft = look(blurred_by(more, more));
    ASSERT_EQ(soft.size(), sharp.size()) << more;
    for (const auto& tag : soft)
      EXPECT_NEAR(tag.blur.count(), std::hypot(kOwn, more), 0.12 * std::hypot(kOwn, more)) << tag.id;
  }
}

TEST(TagSharpness, IsTheWorseOfBothAxes) {
  for (const auto& [x, y] : {std::pair(0.01, 0.3), std::pair(0.3, 0.01)}) {
    const auto soft = look(blurred_by(x, y));
    ASSERT_GE(soft.size(), 3U);
    for (const auto& tag : soft) EXPECT_GT(tag.blur.count(), 0.25) << tag.id;
  }
}

// One corner of the sheet stands off the glass, and a strip of dirt lies along a side of each tag.
TEST(TagSharpness, IsEachTagsOwnAndNotThatOfDirt) {
  const auto tags = calib::detect_tags<ScanFrame>(sharp_scan());
  ASSERT_GE(tags.size(), 3U);
  cv::Mat scan = sharp_scan().clone();
  const auto& lifted = tags.front();
  const cv::Rect around = cv::Rect(static_cast<int>(lifted.centre.x.count()) - 70,
                                   static_cast<int>(lifted.centre.y.count()) - 70, 140, 140) &
                          cv::Rect({}, scan.size());
  blurred_by(0.3, 0.3)(around).copyTo(scan(around));
  for (std::size_t i = 1; i < tags.size(); ++i) {
    const auto &from = tags[i].corners[0], &to = tags[i].corners[1];
    cv::line(scan, cv::Point2d(from.x.count(), from.y.count()), cv::Point2d(to.x.count(), to.y.count()),
             cv::Scalar(110, 120, 130), 5, cv::LINE_AA);
  }
  const auto measured = calib::measure_sharpness(scan, tags, resolution());
  ASSERT_EQ(measured.size(), tags.size());
  for (const auto& tag : measured)
    if (tag.id == lifted.id)
      EXPECT_GT(tag.blur.count(), 0.25);
    else
      EXPECT_LT(tag.blur.count(), 0.15) << tag.id;
}

TEST(TagSharpness, IsNotToldOfWhatIsNoTag) {
  EXPECT_TRUE(calib::measure_sharpness({}, {}, resolution()).empty());
  calib::Tag<ScanFrame> nowhere;
  nowhere.corners = {point<ScanFrame>(10, 90), point<ScanFrame>(90, 90), point<ScanFrame>(90, 10),
                     point<ScanFrame>(10, 10)};
  const cv::Mat grey(100, 100, CV_8UC1, cv::Scalar(120));
  EXPECT_TRUE(calib::measure_sharpness(grey, {nowhere}, resolution()).empty());
}

}  // namespace
}  // namespace veneer::scanned
