#include "daemon/stock/panel_label.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <zbar.h>

#include <opencv2/imgproc.hpp>

#include "calib/tag_detector.h"
#include "daemon/stock/remnants.h"
#include "planner/pictures/pictures.h"
#include "tests/support/label_reader.h"
#include "tests/support/rendered_panel.h"

namespace veneer::daemon {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

PanelLabel label() {
  return {"P-0017",
          {"offcut of the N\u00fcrnberg face", "walnut 212 cm2, maple 96 cm2"},
          cv::Mat(400, 900, CV_8UC3, cv::Scalar(40, 60, 80))};
}

// What a QR code on the picture says, read by another library than the one that drew it.
std::string code_on(const cv::Mat& picture) {
  cv::Mat grey;
  cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
  zbar::zbar_image_scanner_t* const scanner = zbar::zbar_image_scanner_create();
  zbar::zbar_image_t* const image = zbar::zbar_image_create();
  zbar::zbar_image_set_format(image, zbar_fourcc('Y', '8', '0', '0'));
  zbar::zbar_image_set_size(image, static_cast<unsigned>(grey.cols), static_cast<unsigned>(grey.rows));
  zbar::zbar_image_set_data(image, grey.data, grey.total(), nullptr);
  zbar::zbar_scan_image(scanner, image);
  std::string text;
  for (const auto* symbol = zbar::zbar_image_first_symbol(image); symbol != nullptr;
       symbol = zbar::zbar_symbol_next(symbol))
    text += zbar::zbar_symbol_get_data(symbol);
  zbar::zbar_image_destroy(image);
  zbar::zbar_image_scanner_destroy(scanner);
  return text;
}

TEST(PanelLabel, ItsCodeIsReadBackAsThePanelsName) {
  const auto png = draw_label(label(), planner::PageFormat::kPng);
  ASSERT_TRUE(png.ok());
  const auto picture = planner::decode_picture(*png, "label");
  ASSERT_TRUE(picture.ok());
  EXPECT_EQ(picture->size(), cv::Size(1181, 732)) << "100 x 62 mm at 300 dots per inch";
  EXPECT_EQ(code_on(*picture), "P-0017");
  cv::Mat photograph;
  cv::resize(*picture, photograph, {}, 0.3, 0.3, cv::INTER_AREA);
  cv::GaussianBlur(photograph, photograph, {0, 0}, 0.8);
  EXPECT_EQ(code_on(photograph), "P-0017") << "as a telephone sees it";
}

cv::Mat read_back(const PanelLabel& of) {
  const auto picture = planner::decode_picture(*draw_label(of, planner::PageFormat::kPng), "label");
  cv::Mat out;
  cv::cvtColor(*picture, out, cv::COLOR_BGR2GRAY);
  return out;
}
cv::Mat grey_label(const std::string& panel) {
  PanelLabel of = label();
  of.panel = panel;
  return read_back(of);
}

TEST(PanelLabel, ItsTagHasThePanelsNumber) {
  cv::Mat photograph = grey_label("P-0017");
  EXPECT_THAT(tests::label_tags_on(photograph), ElementsAre(17));
  // By a camera for which the code is too small: 4.5 pixels for a cell of the tag, 1.7 for one of the code.
  cv::resize(photograph, photograph, {}, 0.15, 0.15, cv::INTER_AREA);
  cv::GaussianBlur(photograph, photograph, {0, 0}, 0.8);
  EXPECT_THAT(tests::label_tags_on(photograph), ElementsAre(17));
  cv::cvtColor(photograph, photograph, cv::COLOR_GRAY2BGR);
  EXPECT_EQ(code_on(photograph), "");
  EXPECT_THAT(tests::label_tags_on(grey_label("P-2114")), ElementsAre(2114));
  EXPECT_THAT(tests::label_tags_on(grey_label("P-2115")), IsEmpty()) << "the family has no such number";
}

// Beside the panel on the scanner's glass, on the panel, and as a camera sees it aslant over the bed.
TEST(PanelLabel, IsNoFiducialToScannerOrCamera) {
  const rendered::Panel panel = rendered::sample_panel();
  const cv::Mat bare = rendered::scan_panel(panel, Face::kShow, rendered::lay(75, 55, 80, 60, 0, Face::kShow), {});
  const auto ids = [](const auto& tags) {
    std::vector<int> out;
    for (const auto& tag : tags) out.push_back(tag.id);
    return out;
  };
  const std::vector<int> fiducials = ids(calib::detect_tags<ScanFrame>(bare));
  ASSERT_GE(fiducials.size(), 5U);
  // Fiducials and label in one picture, whole, the label's number one that a fiducial has.
  const cv::Mat printed = grey_label(fmt::format("P-{:04d}", fiducials.front()));
  cv::Mat grey;
  cv::cvtColor(bare, grey, cv::COLOR_BGR2GRAY);
  cv::Mat scan(grey.rows + printed.rows + 60, std::max(grey.cols, printed.cols + 60), CV_8UC1, cv::Scalar(244));
  grey.copyTo(scan(cv::Rect(0, 0, grey.cols, grey.rows)));
  printed.copyTo(scan(cv::Rect(30, grey.rows + 30, printed.cols, printed.rows)));
  EXPECT_THAT(tests::label_tags_on(scan), ElementsAre(fiducials.front()));
  EXPECT_EQ(ids(calib::detect_tags<ScanFrame>(scan)), fiducials);
  // 45 % of the size, seen from one side.
  const auto w = static_cast<float>(scan.cols), h = static_cast<float>(scan.rows);
  const std::vector<cv::Point2f> from = {{0, 0}, {w, 0}, {w, h}, {0, h}},
                                 to = {{60, 20}, {0.45F * w, 0}, {0.47F * w, 0.45F * h}, {0, 0.42F * h}};
  cv::Mat photograph;
  cv::warpPerspective(scan, photograph, cv::getPerspectiveTransform(from, to),
                      cv::Size(static_cast<int>(w / 2), static_cast<int>(h / 2)), cv::INTER_AREA);
  EXPECT_THAT(tests::label_tags_on(photograph), ElementsAre(fiducials.front()));
  EXPECT_EQ(ids(calib::detect_tags<CameraFrame>(photograph)), fiducials);
}

// Small as they are there, its tags would be read.
TEST(PanelLabel, ItsPictureOfThePanelShowsNoFiducial) {
  const rendered::Panel panel = rendered::sample_panel();
  const cv::Mat scan = rendered::scan_panel(panel, Face::kShow, rendered::lay(75, 55, 80, 60, 0, Face::kShow), {});
  const Raster<PanelFrame> map{scan, {300 / 25.4}, {}};
  const cv::Rect wood(scan.cols / 4, scan.rows / 4, scan.cols / 2, scan.rows / 2);
  cv::Mat mask(scan.size(), CV_8UC1, cv::Scalar(0));
  mask(wood) = 255;
  for (const Beside beside : {Beside::kPale, Beside::kBlank}) {
    PanelLabel of = label();
    of.picture = draw_remnant(map, mask, {}, {}, beside);
    // As printed, and as a finer scanner reads the paper.
    cv::Mat printed = read_back(of), finer;
    cv::resize(printed, finer, {}, 2, 2, cv::INTER_CUBIC);
    for (const cv::Mat& seen : {printed, finer})
      EXPECT_EQ(calib::detect_tags<ScanFrame>(seen, {1}).empty(), beside == Beside::kBlank);
  }
}

TEST(PanelLabel, ShowsThePictureAndWritesTheLines) {
  const auto shown = [](const PanelLabel& of) {
    return *planner::decode_picture(*draw_label(of, planner::PageFormat::kPng), "");
  };
  const cv::Mat whole = shown(label());
  cv::Mat wood;
  cv::inRange(whole, cv::Scalar(40, 60, 80), cv::Scalar(40, 60, 80), wood);
  EXPECT_GT(cv::countNonZero(wood), 100'000) << "a sixth of it or more";
  PanelLabel silent = label();
  silent.lines[1] = "";
  cv::Mat written;
  cv::cvtColor(whole != shown(silent), written, cv::COLOR_BGR2GRAY);
  const cv::Rect ink = cv::boundingRect(written);
  EXPECT_GT(ink.width, 300);
  EXPECT_GT(ink.x, 350) << "on the right of the code";
  // However long a line is, it stays on the label.
  silent.lines[1] = std::string(200, 'w');
  cv::cvtColor(whole != shown(silent), written, cv::COLOR_BGR2GRAY);
  EXPECT_LT(cv::boundingRect(written).br().x, whole.cols - 30);
}

TEST(PanelLabel, IsAPdfOrAnSvgOfItsSize) {
  const auto pdf = draw_label(label(), planner::PageFormat::kPdf), svg = draw_label(label(), planner::PageFormat::kSvg);
  ASSERT_TRUE(pdf.ok() && svg.ok());
  EXPECT_THAT(*pdf, StartsWith("%PDF-"));
  EXPECT_THAT(*pdf, HasSubstr("[ 0 0 283.464"));
  EXPECT_THAT(*svg, HasSubstr("<svg"));
  EXPECT_THAT(*svg, HasSubstr("width=\"283.46"));
}

TEST(PanelLabel, TextThatIsNoUtf8IsAnErrorAndNotHalfALabel) {
  PanelLabel broken = label();
  broken.lines[0] = "\xff\xfe";
  EXPECT_FALSE(draw_label(broken, planner::PageFormat::kPdf).ok());
}

}  // namespace
}  // namespace veneer::daemon
