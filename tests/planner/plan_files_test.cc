#include "planner/plan_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
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
  const auto drawing = cut_svg(plan, plan.panels[0]);
  ASSERT_TRUE(drawing.ok()) << drawing.error().message;
  EXPECT_THAT(drawing->warnings, testing::IsEmpty());
  pugi::xml_document document;
  ASSERT_TRUE(document.load_string(drawing->svg.c_str()));
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

TEST_F(PlanFiles, CutFileTellsInOneSentenceHowManyMarksFoundNoRoom) {
  PlanOptions options;
  options.patch = 5_mm, options.dpi = 50.8, options.rotations = 1, options.threads = 1, options.kerf = 0.2_mm;
  const std::vector<Artwork> artworks{test::blob_artwork("A", 40, 40, 20_mm, 1)};
  const std::vector<StockPanel> stock{test::wood_panel("P-1", 60, 60, 50.8, 2)};
  const Plan plan = make_plan(artworks, stock, options).value();
  const auto drawing = cut_svg(plan, plan.panels[0]);
  ASSERT_TRUE(drawing.ok()) << drawing.error().message;
  ASSERT_EQ(drawing->warnings.size(), 1U);
  const std::size_t unmarked = plan.pieces.size() - unfilled(plan);
  EXPECT_THAT(drawing->warnings[0], testing::StartsWith(std::to_string(unmarked) + " marks do not fit"));
  for (const Piece& piece : plan.pieces) {
    if (!piece.placement) continue;
    EXPECT_THAT(drawing->warnings[0], HasSubstr(piece.mark));
    break;
  }
}

}  // namespace
}  // namespace veneer::planner
