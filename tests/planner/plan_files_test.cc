#include "planner/plan_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <pugixml.hpp>

#include "tests/support/synthetic_wood.h"

namespace veneer::planner {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

class PlanFiles : public ::testing::Test {
 protected:
  PlanFiles() : folder_(fs::temp_directory_path() / ("plan_files_test_" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
  }
  ~PlanFiles() override {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  fs::path file(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }
  fs::path picture(const std::string& name, const cv::Mat& pixels) const {
    cv::imwrite((folder_ / name).string(), pixels);
    return folder_ / name;
  }

  fs::path folder_;
};

Plan small_plan() {
  PlanOptions options;
  options.patch = 10_mm, options.dpi = 50.8, options.rotations = 5, options.threads = 1, options.kerf = 0.2_mm;
  const std::vector<Artwork> artworks{test::blob_artwork("A", 40, 40, 50_mm, 1)};
  const std::vector<StockPanel> stock{test::wood_panel("P-1", 60, 60, 50.8, 2), test::wood_panel("Q", 50, 40, 50.8, 3)};
  return make_plan(artworks, stock, options).value();
}

TEST_F(PlanFiles, APlanComesBackAsItWasWritten) {
  const Plan plan = small_plan();
  ASSERT_GT(unfilled(plan), 0U);
  ASSERT_LT(unfilled(plan), plan.pieces.size());
  ASSERT_TRUE(write_plan(plan, folder_ / "plan.json").ok());
  const auto back = read_plan(folder_ / "plan.json");
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(plan_to_json(*back), plan_to_json(plan));
  EXPECT_EQ(cost_total(*back), cost_total(plan));
  for (std::size_t i = 0; i < plan.pieces.size(); ++i) {
    ASSERT_EQ(back->pieces[i].placement.has_value(), plan.pieces[i].placement.has_value());
    if (!plan.pieces[i].placement) continue;
    EXPECT_EQ(back->pieces[i].placement->panel_outline, plan.pieces[i].placement->panel_outline);
    EXPECT_EQ(back->pieces[i].placement->panel_from_artwork * plan.pieces[i].artwork_outline,
              plan.pieces[i].placement->panel_from_artwork * plan.pieces[i].artwork_outline);
  }
}

TEST_F(PlanFiles, PlanJsonHasTheContractsFields) {
  const auto plan = nlohmann::json::parse(plan_to_json(small_plan()));
  EXPECT_EQ(plan["schema_version"], 1);
  EXPECT_EQ(plan["artworks"][0]["target"], "blobs A");
  EXPECT_EQ(plan["panels"][0]["id"], "P-1");
  bool placed = false, open = false;
  for (const auto& piece : plan["pieces"]) {
    for (const char* name : {"id", "artwork", "row", "col", "panel", "rotation_deg", "cost", "pixels",
                             "artwork_outline_mm", "panel_outline_mm"})
      EXPECT_TRUE(piece.contains(name)) << name;
    if (piece["panel"].is_null()) {
      open = true;
      EXPECT_TRUE(piece["panel_outline_mm"].is_null());
      EXPECT_EQ(piece["cost"], 0);
    } else {
      placed = true;
      EXPECT_EQ(piece["panel_outline_mm"].size(), piece["artwork_outline_mm"].size());
    }
  }
  EXPECT_TRUE(placed && open);
}

TEST_F(PlanFiles, BrokenPlansAreRefusedByName) {
  auto good = nlohmann::json::parse(plan_to_json(small_plan()));
  EXPECT_THAT(plan_from_json("{").error().message, HasSubstr("not a JSON object"));
  EXPECT_THAT(plan_from_json("[1]").error().message, HasSubstr("not a JSON object"));
  auto bad = good;
  bad["schema_version"] = 7;
  EXPECT_THAT(plan_from_json(bad.dump()).error().message, HasSubstr("schema_version"));
  bad = good, bad["pieces"][0].erase("cost");
  EXPECT_THAT(plan_from_json(bad.dump()).error().message, HasSubstr("\"cost\" is missing"));
  bad = good, bad["pieces"][0]["artwork"] = 3;
  EXPECT_THAT(plan_from_json(bad.dump()).error().message, HasSubstr("artwork"));
  bad = good, bad["pieces"] = "none";
  EXPECT_THAT(plan_from_json(bad.dump()).error().message, HasSubstr("not a list"));
  bad = good, bad["pieces"][0]["artwork_outline_mm"] = {{0, 0}, {1}};
  EXPECT_THAT(plan_from_json(bad.dump()).error().message, HasSubstr("points"));
  EXPECT_EQ(read_plan(folder_ / "none.json").error().code, ErrorCode::kNotFound);
}

TEST_F(PlanFiles, ReportSumsUpThePlan) {
  const Plan plan = small_plan();
  const auto report = nlohmann::json::parse(report_to_json(plan, {0.5, 2.5}, 1234, 3));
  EXPECT_EQ(report["pieces"], plan.pieces.size());
  EXPECT_EQ(report["unfilled"], unfilled(plan));
  EXPECT_EQ(report["cost_total"], cost_total(plan));
  EXPECT_EQ(report["peak_rss_bytes"], 1234);
  EXPECT_EQ(report["threads"], 3);
  for (const char* name : {"load", "features", "match", "refine", "total"})
    EXPECT_TRUE(report["seconds"].contains(name));
}

TEST_F(PlanFiles, CutFileShowsTheBackWithTheBeamsPath) {
  const Plan plan = small_plan();
  const auto svg = cut_svg(plan, plan.panels[0]);
  ASSERT_TRUE(svg.ok()) << svg.error().message;
  pugi::xml_document document;
  ASSERT_TRUE(document.load_string(svg->c_str()));
  const pugi::xml_node root = document.child("svg");
  EXPECT_THAT(root.attribute("width").value(), HasSubstr("mm"));
  const pugi::xml_node cut = root.find_child_by_attribute("id", "cut");
  const pugi::xml_node engrave = root.find_child_by_attribute("id", "engrave");
  ASSERT_TRUE(cut && engrave);
  std::size_t cuts = 0;
  for (const pugi::xml_node path : cut.children("path")) {
    ++cuts;
    const std::string mark = path.attribute("data-piece").value();
    const auto piece =
        std::find_if(plan.pieces.begin(), plan.pieces.end(), [&](const Piece& p) { return p.mark == mark; });
    ASSERT_TRUE(piece != plan.pieces.end() && piece->placement);
    // The outline grown by half the kerf, mirrored: compare bounding boxes and area.
    Ring<PanelFrame> ring;
    std::istringstream data(path.attribute("d").value());
    for (std::string word; data >> word;) {
      double x = 0, y = 0;
      if (std::sscanf(word.c_str() + 1, "%lf,%lf", &x, &y) == 2)
        ring.push_back(point<PanelFrame>(plan.panels[0].width.count() - x, plan.panels[0].height.count() - y));
    }
    const auto& outline = piece->placement->panel_outline;
    const Box<PanelFrame> want = bounds(outline), got = bounds(ring);
    const double side = distance(outline[0], outline[1]).count(), other = distance(outline[1], outline[2]).count();
    EXPECT_NEAR(std::abs(signed_area(ring)), (side + 0.2) * (other + 0.2), 0.05);
    EXPECT_NEAR((got.min.x + got.max.x).count(), (want.min.x + want.max.x).count(), 0.01);
    EXPECT_NEAR((got.min.y + got.max.y).count(), (want.min.y + want.max.y).count(), 0.01);
  }
  EXPECT_EQ(cuts, static_cast<std::size_t>(std::count_if(plan.pieces.begin(), plan.pieces.end(), [&](const Piece& p) {
              return p.placement && p.placement->panel == plan.panels[0].id;
            })));
  EXPECT_TRUE(engrave.child("path"));
}

TEST_F(PlanFiles, PicturesOfAllKindsBecomeEightBitColour) {
  cv::Mat grey(4, 6, CV_8UC1, cv::Scalar(77)), deep(4, 6, CV_16UC3, cv::Scalar(257 * 10, 257 * 20, 257 * 30));
  cv::Mat alpha(4, 6, CV_8UC4, cv::Scalar(10, 20, 30, 0)), deep_grey(4, 6, CV_16UC1, cv::Scalar(65535));
  alpha.at<cv::Vec4b>(0, 0) = {10, 20, 30, 255};
  auto loaded = load_picture(picture("grey.png", grey));
  ASSERT_TRUE(loaded.ok());
  EXPECT_EQ(loaded->at<cv::Vec3b>(1, 1), cv::Vec3b(77, 77, 77));
  loaded = load_picture(picture("deep.png", deep));
  ASSERT_TRUE(loaded.ok());
  EXPECT_EQ(loaded->at<cv::Vec3b>(1, 1), cv::Vec3b(10, 20, 30));
  loaded = load_picture(picture("alpha.png", alpha));
  ASSERT_TRUE(loaded.ok());
  EXPECT_EQ(loaded->at<cv::Vec3b>(0, 0), cv::Vec3b(10, 20, 30));
  EXPECT_EQ(loaded->at<cv::Vec3b>(1, 1), cv::Vec3b(255, 255, 255));
  loaded = load_picture(picture("deep_grey.png", deep_grey));
  ASSERT_TRUE(loaded.ok());
  EXPECT_EQ(loaded->at<cv::Vec3b>(1, 1), cv::Vec3b(255, 255, 255));
}

TEST_F(PlanFiles, ExifOrientationTurnsThePictureUpright) {
  // A JPEG whose EXIF block says "turned a quarter to the right": 6 columns of 4 rows are to be shown 4 x 6.
  cv::Mat pixels(40, 60, CV_8UC3, cv::Scalar(200, 200, 200));
  pixels(cv::Rect(0, 0, 20, 20)).setTo(cv::Scalar(0, 0, 0));
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", pixels, jpeg);
  const std::string exif(
      "\xff\xe1\x00\x22"
      "Exif\x00\x00"
      "MM\x00\x2a\x00\x00\x00\x08\x00\x01\x01\x12\x00\x03\x00\x00\x00\x01\x00\x06\x00\x00\x00\x00\x00\x00",
      36);
  std::string bytes(jpeg.begin(), jpeg.end());
  bytes.insert(2, exif);
  const auto loaded = decode_picture(bytes, "turned.jpg");
  ASSERT_TRUE(loaded.ok());
  EXPECT_EQ(loaded->cols, 40);
  EXPECT_EQ(loaded->rows, 60);
  EXPECT_LT(loaded->at<cv::Vec3b>(5, 35)[0], 50);  // upper left became upper right
}

TEST_F(PlanFiles, UnusablePicturesAreRefusedInWords) {
  EXPECT_EQ(load_picture(folder_ / "none.png").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(load_picture(folder_).error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(load_picture(file("text.png", "not a picture")).error().message, HasSubstr("not a picture"));
  EXPECT_THAT(load_picture(file("empty.png", "")).error().message, HasSubstr("empty"));
}

TEST_F(PlanFiles, MasksAreNonZeroWhereAnyColourIs) {
  cv::Mat mask(2, 3, CV_8UC4, cv::Scalar(0, 0, 0, 255));
  mask.at<cv::Vec4b>(1, 2) = {0, 1, 0, 255};
  const auto loaded = load_mask(picture("mask.png", mask));
  ASSERT_TRUE(loaded.ok());
  EXPECT_EQ(cv::countNonZero(*loaded), 1);
  EXPECT_EQ(loaded->at<std::uint8_t>(1, 2), 255);
}

}  // namespace
}  // namespace veneer::planner
