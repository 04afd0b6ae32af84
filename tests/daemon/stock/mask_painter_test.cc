// What people painted on a mask, pixel by pixel.
#include "daemon/stock/mask_painter.h"

#include <rapidcheck/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "daemon/orders/panel_wood.h"

namespace veneer::daemon {
namespace {

constexpr int kPaintColumns = 240, kPaintRows = 160;
constexpr ScanResolution kMaskResolution{4};  // 60 x 40 mm

Raster<PanelFrame> mask_of(unsigned char value) {
  return {cv::Mat(kPaintRows, kPaintColumns, CV_8UC1, cv::Scalar(value)), kMaskResolution, {}};
}

Region<PanelFrame> any_outline() {
  Ring<PanelFrame> ring;
  const auto mm = [](int most) { return *rc::gen::inRange(-2000, most * 1000) / 1000.0; };
  for (int i = 0; i < 5; ++i) ring.push_back({Millimetres(mm(62)), Millimetres(mm(42))});
  return Region<PanelFrame>(ring);
}

bool same(const cv::Mat& a, const cv::Mat& b) { return cv::countNonZero(a != b) == 0; }

// Only the part about an outline is drawn; all else is as if the whole were.
RC_GTEST_PROP(MaskPainter, DrawsAsOnTheWholeSheet, ()) {
  const auto shape = any_outline(), tag = any_outline();
  RC_PRE(!shape.empty() && !tag.empty());
  const auto withheld = painted(mask_of(255), {{{{}, false, shape, "", "", "", {}}}, {tag}, {}});
  RC_ASSERT(same(withheld.pixels, free_wood(mask_of(255), {shape}, Millimetres(0)).pixels));
  const auto given = painted(mask_of(0), {{{{}, true, shape, "", "", "", {}}}, {tag}, {}});
  const Region<PanelFrame> around(Ring<PanelFrame>{point<PanelFrame>(-9, -9), point<PanelFrame>(70, -9),
                                                   point<PanelFrame>(70, 50), point<PanelFrame>(-9, 50)});
  RC_ASSERT(same(given.pixels, free_wood(mask_of(255), {subtract(around, shape), tag}, Millimetres(0)).pixels));
}

// Of two that meet the later one counts.
TEST(MaskPainter, DrawsInTheOrderThatPeoplePaintedIn) {
  const auto square = [](double x) {
    return Region<PanelFrame>(Ring<PanelFrame>{point<PanelFrame>(x, 5), point<PanelFrame>(x + 20, 5),
                                               point<PanelFrame>(x + 20, 25), point<PanelFrame>(x, 25)});
  };
  const db::MaskEdit give{{}, true, square(10), "", "", "", {}}, withhold{{}, false, square(20), "", "", "", {}};
  const auto at = [](const Raster<PanelFrame>& mask, double x) {
    double column = 0, row = 0;
    mask.to_pixels(point<PanelFrame>(x, 15), column, row);
    return mask.pixels.at<unsigned char>(static_cast<int>(row), static_cast<int>(column));
  };
  const auto taken = painted(mask_of(0), {{give, withhold}, {}, {}});
  const auto given = painted(mask_of(0), {{withhold, give}, {}, {}});
  EXPECT_EQ(at(taken, 15), 255);
  EXPECT_EQ(at(taken, 25), 0);
  EXPECT_EQ(at(given, 25), 255);
  EXPECT_EQ(at(given, 35), 0);
}

// Half a minute of work, and half a million corners, of a request of 60 kB.
TEST(MaskPainter, AnOutlineThatIsAllCrossingsIsRefused) {
  Ring<PanelFrame> eight{point<PanelFrame>(0, 0), point<PanelFrame>(10, 10), point<PanelFrame>(10, 0),
                         point<PanelFrame>(0, 10)};
  const auto two = outlined(eight);
  ASSERT_TRUE(two.ok());
  EXPECT_NEAR(two->area().count(), 50, 1e-3);
  Ring<PanelFrame> star;
  for (int i = 0; i < 1500; ++i)
    star.push_back(point<PanelFrame>(150 + 149 * std::cos(i * 2.9), 150 + 149 * std::sin(i * 2.9)));
  const auto refused = outlined(star);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace veneer::daemon
