#include "daemon/services/panel_label.h"

#include <gmock/gmock.h>
#include <zbar.h>

#include <opencv2/imgproc.hpp>

#include "planner/pictures/pictures.h"

namespace veneer::daemon {
namespace {

using ::testing::HasSubstr;
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
