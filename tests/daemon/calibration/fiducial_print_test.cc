#include "daemon/calibration/fiducial_print.h"

#include <gmock/gmock.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "calib/scanner_model.h"
#include "calib/tag_detector.h"
#include "planner/pictures/pictures.h"

namespace veneer::daemon {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr double kPxPerMm = 300 / 25.4;

// Every tag of the sheet is found on the picture of it, upright, its corners within `tolerance` of where the sheet has
// them.
void expect_tags(const cv::Mat& picture, const calib::FiducialSheet& sheet, double tolerance_mm) {
  const auto found = calib::detect_tags<ScanFrame>(picture);
  ASSERT_EQ(found.size(), sheet.tags.size());
  for (const auto& tag : found) {
    const auto printed =
        std::find_if(sheet.tags.begin(), sheet.tags.end(), [&](const auto& t) { return t.id == tag.id; });
    ASSERT_NE(printed, sheet.tags.end()) << tag.id;
    const double half = printed->size.count() / 2;
    const double x[] = {-half, half, half, -half}, y[] = {-half, -half, half, half};
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_NEAR(tag.corners[i].x.count() / kPxPerMm, printed->centre.x.count() + x[i], tolerance_mm) << tag.id;
      EXPECT_NEAR(tag.corners[i].y.count() / kPxPerMm, (sheet.height - printed->centre.y).count() - y[i], tolerance_mm)
          << tag.id;
    }
  }
}

TEST(FiducialPrint, ItsTagsAreFoundWhereTheyArePrinted) {
  const auto pages = calib::panel_sheets(*calib::plan_fiducials(Millimetres(420), Millimetres(280), 120));
  const auto png = print_sheets(pages, planner::PageFormat::kPng);
  ASSERT_TRUE(png.ok());
  const cv::Mat picture = *planner::decode_picture(*png, "sheet");
  EXPECT_EQ(picture.size(), cv::Size(2480, 3508));
  expect_tags(picture, pages.front(), 0.03);
}

TEST(FiducialPrint, TheGridIsReadAsTheScannersCalibrationReadsIt) {
  const auto sheet = calib::grid_sheet();
  const cv::Mat picture = *planner::decode_picture(*print_sheets({sheet}, planner::PageFormat::kPng), "grid");
  expect_tags(picture, sheet, 0.03);
  EXPECT_EQ(calib::grid_scan(picture, ScanResolution::from_dpi(300)).tags.size(), sheet.tags.size());
}

// As another program draws the PDF, and all of its pages.
TEST(FiducialPrint, APdfIsDrawnTrueByAnotherProgram) {
  const auto dir = std::filesystem::path(::testing::TempDir()) / "fiducial-print";
  std::filesystem::create_directories(dir);
  auto pages = calib::panel_sheets(*calib::plan_fiducials(Millimetres(300), Millimetres(200), 200));
  const auto second = calib::panel_sheets(*calib::plan_fiducials(Millimetres(300), Millimetres(200), 300));
  pages.insert(pages.end(), second.begin(), second.end());
  ASSERT_EQ(pages.size(), 2U);
  const auto pdf = print_sheets(pages, planner::PageFormat::kPdf);
  ASSERT_TRUE(pdf.ok());
  EXPECT_THAT(*pdf, StartsWith("%PDF-"));
  std::ofstream(dir / "tags.pdf", std::ios::binary) << *pdf;
  const std::string draw =
      "gs -q -dBATCH -dNOPAUSE -dSAFER -sDEVICE=pnggray -r300 -dGraphicsAlphaBits=4 -sOutputFile='" +
      (dir / "page-%d.png").string() + "' '" + (dir / "tags.pdf").string() + "'";
  ASSERT_EQ(std::system(draw.c_str()), 0) << "ghostscript is needed";  // NOLINT(concurrency-mt-unsafe,cert-env33-c)
  for (int page = 1; page <= 2; ++page)
    expect_tags(cv::imread((dir / ("page-" + std::to_string(page) + ".png")).string()),
                pages[static_cast<std::size_t>(page - 1)], 0.03);
}

TEST(FiducialPrint, AnSvgIsOfThePapersSize) {
  const auto svg = print_sheets({calib::grid_sheet()}, planner::PageFormat::kSvg);
  ASSERT_TRUE(svg.ok());
  EXPECT_THAT(*svg, HasSubstr("width=\"1190.55"));
  auto wrong = calib::grid_sheet();
  wrong.tags[0].id = 900;
  EXPECT_FALSE(print_sheets({wrong}, planner::PageFormat::kSvg).ok());
}

}  // namespace
}  // namespace veneer::daemon
