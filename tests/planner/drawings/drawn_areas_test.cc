// Which pieces a file's areas become: an SVG drawing's regions, or a picture's colours.
#include "planner/drawings/drawn_areas.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <string>
#include <vector>

#include "planner/pictures/png_codec.h"

namespace veneer::planner {
namespace {

using ::testing::HasSubstr;

// A page of 100 x 50 mm in two halves.
std::string halves(const std::string& before = "") {
  return before + R"(<svg width="100mm" height="50mm" viewBox="0 0 100 50"><rect width="50" height="50"/>)"
                  R"(<rect x="50" width="50" height="50"/></svg>)";
}

std::set<std::array<int, 3>> colours_of(const cv::Mat& picture) {
  std::set<std::array<int, 3>> out;
  for (int r = 0; r < picture.rows; ++r) {
    const auto* row = picture.ptr<cv::Vec3b>(r);
    for (int c = 0; c < picture.cols; ++c)
      if (c == 0 || row[c] != row[c - 1]) out.insert({row[c][0], row[c][1], row[c][2]});
  }
  return out;
}

TEST(DrawnAreas, ADrawingIsKnownByItsBytesWhateverItIsCalled) {
  for (const std::string before : {"", "\xef\xbb\xbf", " \n", "<?xml version=\"1.0\"?>\n<!-- ours -->"}) {
    const auto areas = areas_of_file(halves(before), "windows");
    ASSERT_TRUE(areas.ok()) << areas.error().message;
    EXPECT_EQ(areas->cols, 2 * areas->rows);
    EXPECT_EQ(colours_of(*areas).size(), 2U);
  }
}

TEST(DrawnAreas, APictureIsTakenAsItIs) {
  cv::Mat drawn(4, 6, CV_8UC3, cv::Scalar(10, 20, 30));
  drawn.colRange(0, 2).setTo(cv::Scalar(90, 80, 70));
  const auto areas = areas_of_file(*encode_png(drawn), "areas.svg");
  ASSERT_TRUE(areas.ok()) << areas.error().message;
  EXPECT_EQ(cv::norm(*areas, drawn, cv::NORM_INF), 0);
}

// As tones all of them would be black.
TEST(DrawnAreas, LabelsOf16BitsKeepApart) {
  for (const int type : {CV_16UC1, CV_16UC3}) {
    cv::Mat labels(4, 6, type);
    for (int label = 1; label <= 3; ++label) labels.colRange(2 * label - 2, 2 * label).setTo(cv::Scalar(label, 7, 7));
    for (const char* format : {".png", ".tiff"}) {
      std::vector<unsigned char> bytes;
      ASSERT_TRUE(cv::imencode(format, labels, bytes));
      const auto areas = areas_of_file({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, "labels");
      ASSERT_TRUE(areas.ok()) << areas.error().message;
      EXPECT_EQ(colours_of(*areas).size(), 3U) << format;
      EXPECT_EQ(areas->at<cv::Vec3b>(0, 0), areas->at<cv::Vec3b>(3, 1));
      EXPECT_NE(areas->at<cv::Vec3b>(0, 0), areas->at<cv::Vec3b>(0, 2));
    }
  }
}

TEST(DrawnAreas, AFilesEndingIsToldByItsBytes) {
  EXPECT_EQ(ending_of(halves("\xef\xbb\xbf\n")), ".svg");
  EXPECT_EQ(ending_of(*encode_png(cv::Mat(4, 6, CV_8UC3, cv::Scalar::all(9)))), ".png");
  EXPECT_EQ(ending_of("\xff\xd8\xff\xe0"), ".jpg");
  EXPECT_EQ(ending_of("else"), "");
}

TEST(DrawnAreas, RefusalsNameTheFile) {
  const auto refusal = [](const std::string& bytes) {
    const auto areas = areas_of_file(bytes, "lead lines");
    EXPECT_FALSE(areas.ok()) << bytes;
    return areas.ok() ? "" : areas.error().message;
  };
  for (const char* bytes : {"", "no picture", "<html/>", "<svg", "<svg width='9mm' height='9mm'/>"})
    EXPECT_THAT(refusal(bytes), HasSubstr("lead lines")) << bytes;
  EXPECT_THAT(refusal("<svg width='9mm' height='9mm'><path d='M 0 0 H 9 V 9' fill='none'/></svg>"),
              HasSubstr("no closed region"));
  // Each point is a number, and the distance between them is none.
  EXPECT_THAT(refusal("<svg width='1mm' height='1mm' viewBox='0 0 1 1'><path d='M -1.7e308 0 H 1.7e308 V 9 Z'/></svg>"),
              HasSubstr("larger than can be measured"));
}

TEST(DrawnAreas, AFilledPathIsClosedAsAViewerClosesIt) {
  const auto areas = areas_of_file(
      "<svg width='20mm' height='10mm' viewBox='0 0 20 10'><rect width='10' height='10'/>"
      "<path d='M 10 0 H 20 V 10 H 10'/></svg>",
      "windows");
  ASSERT_TRUE(areas.ok()) << areas.error().message;
  EXPECT_EQ(areas->cols, 2 * areas->rows);
  EXPECT_EQ(colours_of(*areas).size(), 2U);
}

TEST(DrawnAreas, AStraightLineThatIsSeenIsAJoint) {
  const auto areas_under = [](const std::string& lines, const std::string& over = "") {
    const auto areas = areas_of_file("<svg width='10mm' height='10mm' viewBox='0 0 10 10'><g stroke='black'>" + over +
                                         "<rect width='10' height='10'/>" + lines + "</g></svg>",
                                     "windows");
    EXPECT_TRUE(areas.ok()) << areas.error().message;
    return areas.ok() ? colours_of(*areas).size() : 0;
  };
  EXPECT_EQ(areas_under("<line y1='5' x2='10' y2='5'/>"), 2U);
  EXPECT_EQ(areas_under("<path d='M 0 5 H 4 H 10'/>"), 2U) << "filled or not: it has no inside";
  EXPECT_EQ(areas_under("<path d='M 0.05 5 H 9.95' fill='none'/>"), 2U) << "to within 0.1 mm";
  EXPECT_EQ(areas_under("<path d='M 0 0 L 10 10 Z'/><path d='M 0 10 L 10 0'/>"), 4U);
  EXPECT_EQ(areas_under("<path d='M 0 5 H 4 H 10' stroke='none'/>"), 1U) << "nobody sees it";
  EXPECT_EQ(areas_under("<path d='M 0 5 H 4 H 7'/>"), 1U) << "it parts nothing";
  EXPECT_EQ(areas_under("", "<line y1='5' x2='10' y2='5'/>"), 1U) << "the square lies over it";
}

TEST(DrawnAreas, OnlyWhatIsFilledHidesAJoint) {
  const auto areas_of = [](const std::string& over) {
    const auto areas = areas_of_file(
        "<svg width='10mm' height='10mm' viewBox='0 0 10 10'><g stroke='black'>"
        "<line y1='5' x2='10' y2='5'/><rect width='10' height='10' " +
            over + "/></g></svg>",
        "windows");
    EXPECT_TRUE(areas.ok()) << areas.error().message;
    return areas.ok() ? colours_of(*areas).size() : 0;
  };
  EXPECT_EQ(areas_of("fill='none'"), 2U);
  EXPECT_EQ(areas_of("fill='red' fill-opacity='0'"), 2U);
  EXPECT_EQ(areas_of("opacity='0'"), 2U);
  EXPECT_EQ(areas_of("fill='red'"), 1U);
}

// It is scaled freely, so that its millimetres say nothing of how fine it is.
TEST(DrawnAreas, ADrawingMayHaveAnyScale) {
  std::string squares;
  for (int row = 0; row < 20; ++row)
    for (int column = 0; column < 20; ++column)
      squares += fmt::format("<rect x='{:.2f}' y='{:.2f}' width='0.05' height='0.05'/>", column * 0.05, row * 0.05);
  const auto areas_with = [&](const std::string& more) {
    const auto areas = areas_of_file("<svg viewBox='0 0 1 1'>" + squares + more + "</svg>", "windows");
    EXPECT_TRUE(areas.ok()) << areas.error().message;
    return areas.ok() ? colours_of(*areas).size() : 0;
  };
  EXPECT_EQ(areas_with(""), 400U);
  // In the middle of a square each, 0.02 from its borders: they part nothing.
  EXPECT_EQ(areas_with("<path stroke='red' d='M 0.02 0.025 H 0.03'/>"), 400U);
  EXPECT_EQ(areas_with("<path stroke='red' d='M 0 0.025 H 0.05'/>"), 401U);
  const auto open = areas_of_file(
      "<svg viewBox='0 0 1 1'>" + squares + "<path fill='none' stroke='red' d='M 0.2 0.2 H 0.3 V 0.3'/></svg>",
      "windows");
  ASSERT_FALSE(open.ok()) << "its ends are far apart in this drawing";
  EXPECT_THAT(open.error().message, HasSubstr("encloses nothing"));
}

TEST(DrawnAreas, ALineFarBeyondAllRegionsIsRefused) {
  const auto areas = areas_of_file(
      "<svg width='10mm' height='10mm' viewBox='0 0 10 10'><rect width='10' height='10'/>"
      "<line y1='5' x2='1e12' y2='5' stroke='red'/></svg>",
      "windows");
  ASSERT_FALSE(areas.ok());
  EXPECT_THAT(areas.error().message, HasSubstr("reaches far beyond its regions"));
}

TEST(DrawnAreas, OpenLinesAreRefusedBesideRegionsUnlessTheyAreStraight) {
  const auto beside_a_region = [](const std::string& line) {
    return areas_of_file(
        "<svg width='10mm' height='10mm' viewBox='0 0 10 10'><rect width='10' height='10'/>" + line + "</svg>",
        "windows");
  };
  for (const char* straight : {"<line x1='3' y1='2' x2='9' y2='8'/>", "<path d='M 3 2 L 9 8 Z'/>"}) {
    const auto areas = beside_a_region(straight);
    ASSERT_TRUE(areas.ok()) << areas.error().message;
    EXPECT_EQ(colours_of(*areas).size(), 1U) << straight;
  }
  const auto refused = beside_a_region("<path d='M 3 2 H 9 V 8' fill='none'/>");
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, HasSubstr("begins at 3.00, 8.00 mm"));
}

}  // namespace
}  // namespace veneer::planner
