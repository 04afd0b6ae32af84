#include "planner/files/plan_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <span>

#include "base/hash.h"
#include "planner/files/plan_report.h"
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

Plan small_plan(int rotations = 5) {
  PlanOptions options;
  options.patch = 10_mm, options.dpi = 50.8, options.rotations = rotations, options.threads = 1, options.kerf = 0.2_mm;
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
    EXPECT_EQ(back->pieces[i].panel_outline(), plan.pieces[i].panel_outline());
    EXPECT_EQ(back->pieces[i].placement->panel_from_artwork * plan.pieces[i].artwork_outline,
              plan.pieces[i].placement->panel_from_artwork * plan.pieces[i].artwork_outline);
  }
}

TEST_F(PlanFiles, OnePieceIsPickedWithoutTheOthers) {
  Plan plan = small_plan();
  const auto placed = std::find_if(plan.pieces.begin(), plan.pieces.end(), [](const Piece& p) { return p.placement; });
  placed->alternatives = {{*placed->placement, 7.5}, {*placed->placement, 8}};
  const std::string text = plan_to_json(plan);
  const auto picked = pick_piece(text, placed->mark);
  ASSERT_TRUE(picked.ok()) << picked.error().message;
  EXPECT_EQ(picked->kerf, plan.kerf);
  EXPECT_EQ(picked->placed, plan.pieces.size() - unfilled(plan));
  const auto worse = [&](const Piece& p) {
    return p.placement && p.cost / static_cast<double>(p.pixels) > placed->cost / static_cast<double>(placed->pixels);
  };
  EXPECT_EQ(picked->worse, static_cast<std::size_t>(std::count_if(plan.pieces.begin(), plan.pieces.end(), worse)));
  Plan alone = plan, picked_alone = plan;
  alone.pieces = {*placed}, picked_alone.pieces = {picked->piece};
  EXPECT_EQ(plan_to_json(picked_alone), plan_to_json(alone));
  EXPECT_EQ(pick_piece(text, "Z9-9").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(pick_piece("{}", "A1-1").error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(pick_piece("[", "A1-1").error().code, ErrorCode::kInvalidArgument);
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

// Counter-clockwise with +y up, from the artwork to the panel.
TEST_F(PlanFiles, RotationsAreThoseOfTheOutlines) {
  const auto plan = nlohmann::json::parse(plan_to_json(small_plan(15)));
  const auto direction = [](const nlohmann::json& outline) {
    return std::atan2(outline[1][1].get<double>() - outline[0][1].get<double>(),
                      outline[1][0].get<double>() - outline[0][0].get<double>()) *
           180 / std::numbers::pi;
  };
  const auto whole_turns = [](double degrees) { return degrees / 360 - std::round(degrees / 360); };
  bool turned = false;
  for (const auto& piece : plan["pieces"]) {
    if (piece["panel"].is_null()) continue;
    const double turn = piece["rotation_deg"];
    EXPECT_NEAR(whole_turns(direction(piece["panel_outline_mm"]) - direction(piece["artwork_outline_mm"]) - turn), 0,
                1e-6);
    EXPECT_NEAR(turn / 24, std::round(turn / 24), 1e-9);
    turned = turned || std::abs(whole_turns(turn)) > 0.01;
  }
  EXPECT_TRUE(turned);
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
  bad = good;
  for (auto& piece : bad["pieces"]) {
    if (piece["panel"].is_null()) continue;
    piece["panel_outline_mm"][2][0] = piece["panel_outline_mm"][2][0].get<double>() + 0.002;
    EXPECT_THAT(plan_from_json(bad.dump()).error().message,
                HasSubstr("the panel_outline_mm of piece " + piece["id"].get<std::string>()));
    break;
  }
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

TEST_F(PlanFiles, AReportTellsWhichPlanMayTakeAnothersPlace) {
  const fs::path path = folder_ / "report.json";
  const auto reread = [&](const Plan& plan, const std::string& inputs) {
    EXPECT_TRUE(write_text(report_to_json(plan, {}, 1, 1, {}, {inputs, sha256_hex({})}), path).ok());
    return read_report(path);
  };
  EXPECT_FALSE(read_report(path)) << "there is none";
  Plan plan = small_plan();
  EXPECT_FALSE(reread(plan, "")) << "of what inputs it is, is not told";
  plan.stopped = true;
  plan.global = GlobalReport{};
  plan.global->stopped = true, plan.global->cost = 0.1;
  const auto told = reread(plan, "these");
  ASSERT_TRUE(told);
  EXPECT_EQ(told->hashes.inputs, "these");
  EXPECT_EQ(told->hashes.plan, sha256_hex({}));
  EXPECT_TRUE(told->figures.stopped);
  EXPECT_EQ(told->figures.unfilled, unfilled(plan));
  EXPECT_EQ(told->figures.cost_total, cost_total(plan));
  ASSERT_TRUE(told->figures.together);
  EXPECT_TRUE(told->figures.together->stopped);
  EXPECT_EQ(told->figures.together->cost, 0.1);
  for (const char* text :
       {"", "{", "[]", R"({"inputs_sha256": 3, "stopped": false, "unfilled": 0, "cost_total": 1})"}) {
    ASSERT_TRUE(write_text(text, path).ok());
    EXPECT_FALSE(read_report(path)) << text;
  }
}

// A run that is killed between the two, or a hand, leaves a plan that the report does not tell of.
TEST_F(PlanFiles, AReportKnowsThePlanThatItTellsOf) {
  const Plan plan = small_plan();
  const std::string text = plan_to_json(plan);
  const fs::path file = folder_ / "plan.json";
  ASSERT_TRUE(write_text_whole(text, file).ok());
  const std::string hash = sha256_hex(std::as_bytes(std::span(text)));
  ASSERT_TRUE(write_text_whole(report_to_json(plan, {}, 1, 1, {}, {"these", hash}), folder_ / "report.json").ok());
  const auto told = read_report(folder_ / "report.json");
  ASSERT_TRUE(told);
  EXPECT_TRUE(is_of(*told, file));
  ASSERT_TRUE(write_text_whole(text + " ", file).ok());
  EXPECT_FALSE(is_of(*told, file));
  EXPECT_FALSE(is_of(*told, folder_ / "none.json"));
}

TEST_F(PlanFiles, ATextThatIsWrittenWholeIsReadByWhoMayReadTheOthers) {
  const fs::path whole = folder_ / "whole", other = folder_ / "other";
  ASSERT_TRUE(write_text_whole("a", whole).ok() && write_text("a", other).ok());
  EXPECT_EQ(fs::status(whole).permissions(), fs::status(other).permissions());
  EXPECT_EQ(write_text_whole("a", other / "x").error().code, ErrorCode::kStorage);
  fs::create_directories(folder_ / "taken" / "by a folder");
  const Status refused = write_text_whole("a", folder_ / "taken");
  EXPECT_EQ(refused.error().code, ErrorCode::kStorage);
  EXPECT_EQ(refused.error().message,
            (folder_ / "taken").string() + " cannot be written: look at its folder and the room on its disk");
  EXPECT_FALSE(fs::exists(folder_ / "taken.new"));
}

TEST(PlanFigures, PutWholePlansFirstThenPiecesWithWoodThenWhatWasLowered) {
  const PlanFigures whole{false, 3, 9, {}}, stopped{true, 2, 5, {}};
  EXPECT_TRUE(is_worse(stopped, whole));
  EXPECT_FALSE(is_worse(whole, stopped));
  EXPECT_FALSE(is_worse(stopped, stopped));
  PlanFigures fuller = stopped;
  fuller.unfilled = 1, fuller.cost_total = 8;  // more pieces cost more
  EXPECT_TRUE(is_worse(stopped, fuller));
  EXPECT_FALSE(is_worse(fuller, stopped));
  PlanFigures cheaper = stopped;
  cheaper.cost_total = 4;
  EXPECT_TRUE(is_worse(stopped, cheaper));
  EXPECT_FALSE(is_worse(cheaper, stopped));

  // Calmer grain, which makes single pieces dearer, is what choosing together was on its way to.
  PlanFigures early = stopped, late = stopped;
  early.together = {true, 7}, late.together = {true, 6}, late.cost_total = 6;
  EXPECT_TRUE(is_worse(early, late));
  EXPECT_FALSE(is_worse(late, early));
  late.together = {false, 6};
  EXPECT_TRUE(is_worse(early, late));
  early.together = {true, 6};  // no dearer together: the pieces' own costs tell
  EXPECT_TRUE(is_worse(late, early));
  EXPECT_FALSE(is_worse(early, late));
  early.together = late.together;  // both have chosen: what follows lowers the pieces' own costs
  EXPECT_TRUE(is_worse(late, early));
  EXPECT_FALSE(is_worse(early, late));
}

TEST(PlanFigures, AStoppedPlanLeavesABetterOneOfTheSameInputsWhereItIs) {
  const PlanFigures whole{false, 0, 5, {}}, stopped{true, 0, 6, {}}, later{true, 0, 4, {}};
  const auto there = [](const PlanFigures& figures) { return ReportedPlan{{"these", "its hash"}, figures}; };
  EXPECT_TRUE(stays(there(whole), stopped, "these"));
  EXPECT_TRUE(stays(there(whole), later, "these")) << "cheaper so far, but not the whole";
  EXPECT_TRUE(stays(there(later), stopped, "these"));
  EXPECT_FALSE(stays(there(stopped), later, "these"));
  EXPECT_FALSE(stays(there(stopped), stopped, "these")) << "no better";
  EXPECT_FALSE(stays(there(later), whole, "these"));
  EXPECT_FALSE(stays(there(later), PlanFigures{false, 2, 9, {}}, "these")) << "a whole plan is what was asked for";
  EXPECT_FALSE(stays(there(whole), stopped, "others"));
  EXPECT_FALSE(stays({{"", "its hash"}, whole}, stopped, "")) << "nobody knows of what it is";
}

}  // namespace
}  // namespace veneer::planner
