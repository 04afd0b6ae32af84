// Scans that wait, through the API: looked at, accepted with what is overruled, refused; and masks that are painted on.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include "calib/tag_detector.h"
#include "cli/render.h"
#include "planner/pictures/pictures.h"
#include "tests/support/routed_cell.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

constexpr int kColumns = 354, kRows = 236;  // 30 x 20 mm

class ProposalRoutes : public testing::RoutedCell {
 protected:
  SeenSheet seen(int tag, std::vector<ScanWarning> warnings = {}) {
    const auto stored = [&](const char* folder, const cv::Mat& picture, const char* what) {
      const auto file = cell->panel_library.store_picture(picture, folder, what);
      if (!file) throw std::runtime_error(file.error().message);
      return *file;
    };
    cv::Mat mask(kRows, kColumns, CV_8UC1, cv::Scalar(0));
    mask.colRange(0, kColumns / 2).setTo(255);
    const auto map = stored("proposals", cv::Mat(kRows, kColumns, CV_8UC3, cv::Scalar(60, 90, 120 + tag % 100)), "map");
    const auto scan = stored("scans", cv::Mat(20, 20, CV_8UC3, cv::Scalar(tag % 250, 2, 3)), "show");
    SeenSheet out;
    out.map_file = map.file, out.map_sha256 = map.sha256;
    out.mask_file = stored("proposals", mask, "mask").file;
    out.tiles = {{scan.file, scan.sha256, "test:0", "2026-05-01T07:30:00.000Z", 300}};
    out.read.sheet.add(point<PanelFrame>(0, 0));
    out.read.sheet.add(point<PanelFrame>(30, 20));
    out.read.lattices = {"{}"};
    out.read.usable = SquareMillimetres(300);
    calib::PanelTag glued;
    glued.id = tag;
    glued.corners = {point<PanelFrame>(20, 5), point<PanelFrame>(25, 5), point<PanelFrame>(25, 10),
                     point<PanelFrame>(20, 10)};
    out.read.fiducials.tags = {glued};
    out.read.warnings = std::move(warnings);
    return out;
  }
  std::int64_t propose(int tag, std::vector<ScanWarning> warnings = {}) {
    const auto outcome = cell->proposals->propose(seen(tag, std::move(warnings)), "uid 1000");
    if (!outcome) throw std::runtime_error(outcome.error().message);
    return outcome->proposal->value;
  }
  json get(const std::string& path) { return body_of(ask("GET", "/api/v1" + path)); }
  ApiReply post(const std::string& path, const json& body = json::object()) {
    return ask("POST", "/api/v1" + path, body);
  }
};

TEST_F(ProposalRoutes, AreLookedAtAndAccepted) {
  const auto number = propose(301, {{"size", "the sheet is not round"}});
  const json list = get("/proposals");
  ASSERT_EQ(list["proposals"].size(), 1U);
  EXPECT_EQ(list["proposals"][0]["warnings"][0]["name"], "size");
  EXPECT_THAT(cli::render_proposals(list), HasSubstr("30.0 x 20.0 mm"));
  EXPECT_THAT(cli::render_proposal(get(fmt::format("/proposals/{}", number))), HasSubstr("--override size"));
  const ApiReply picture = ask("GET", fmt::format("/api/v1/proposals/{}/picture.png?width=200", number));
  ASSERT_EQ(picture.status, 200) << picture.body;
  EXPECT_EQ(planner::decode_picture(picture.body, "picture")->cols, 200);

  const std::string target = fmt::format("/proposals/{}/accept", number);
  const TaskView unsaid = ended(post(target));
  EXPECT_EQ(unsaid.state, TaskState::kFailed);
  EXPECT_THAT(unsaid.error->message, HasSubstr("--override size"));
  EXPECT_TRUE(get("/panels")["panels"].empty());
  const TaskView taken = ended(post(target, {{"override", {"size"}}}));
  ASSERT_EQ(taken.state, TaskState::kDone) << taken.error->message;
  EXPECT_EQ(get("/panels")["panels"][0]["id"], "P-0001");
  const json decided = get(fmt::format("/proposals/{}", number))["decided"];
  EXPECT_EQ(decided["overruled"], json({"size"}));
  EXPECT_EQ(decided["who"], "uid 1000");
  EXPECT_TRUE(get("/proposals")["proposals"].empty());
  EXPECT_EQ(get("/proposals?all=true")["proposals"].size(), 1U);
  EXPECT_EQ(ask("GET", fmt::format("/api/v1/proposals/{}/picture.png", number)).status, 404);
  EXPECT_EQ(get("/proposals/9")["error"]["code"], "not_found");
}

TEST_F(ProposalRoutes, AreRefused) {
  const auto number = propose(301);
  EXPECT_EQ(post(fmt::format("/proposals/{}/refuse", number), {{"note", std::string(501, 'x')}}).status, 400);
  const TaskView dropped = ended(post(fmt::format("/proposals/{}/refuse", number), {{"note", "dust"}}));
  ASSERT_EQ(dropped.state, TaskState::kDone);
  EXPECT_EQ(get(fmt::format("/proposals/{}", number))["decided"]["note"], "dust");
  EXPECT_EQ(ended(post(fmt::format("/proposals/{}/accept", number))).state, TaskState::kFailed);
  EXPECT_TRUE(get("/panels")["panels"].empty());
}

TEST_F(ProposalRoutes, MasksArePaintedOnAndTheAreaBookStaysTrue) {
  ASSERT_EQ(ended(post(fmt::format("/proposals/{}/accept", propose(301)))).state, TaskState::kDone);
  // Pixels that an outline cuts through are withheld, and not given: at most two for each along all borders. Half of
  // the panel is 299.4 mm2 of whole pixels.
  constexpr double kWholePixels = 1;
  const auto expect_book = [&](double usable, double borders_mm) {
    const json panel = get("/panels/P-0001");
    double sum = 0;
    for (const auto& [name, area] : panel["area_book_mm2"].items())
      if (name != "panel") sum += area.get<double>();
    EXPECT_NEAR(sum, panel["area_book_mm2"]["panel"].get<double>(), 1e-6);
    const double free = panel["area_book_mm2"]["free"];
    EXPECT_LE(free, usable + kWholePixels);
    EXPECT_GE(free, usable - kWholePixels - borders_mm * 2 / kMapResolution.px_per_mm);
  };
  expect_book(300, 0);
  EXPECT_EQ(post("/panels/P-0001/mask-edits", {{"kind", "give"}}).status, 400);
  EXPECT_EQ(post("/panels/P-0001/mask-edits", {{"kind", "give"}, {"outline_mm", {1, 2, 3, 4}}}).status, 400);
  for (const json& strokes :
       {json{{"strokes_mm", {1, 2}}, {"stroke_points", {1}}},
        json{{"strokes_mm", {1, 2}}, {"stroke_points", {2}}, {"width_mm", 4}},
        json{{"strokes_mm", {1, 2, 3, 4}}, {"stroke_points", {1}}, {"width_mm", 4}},
        json{{"strokes_mm", {1, 2, 3, 4}}, {"stroke_points", {1.5}}, {"width_mm", 4}},
        json{{"strokes_mm", {1, 2}}, {"stroke_points", {1}}, {"width_mm", 4}, {"outline_mm", {1, 2, 3, 4, 5, 9}}}}) {
    json body = strokes;
    body["kind"] = "give";
    EXPECT_EQ(post("/panels/P-0001/mask-edits", body).status, 400) << body;
  }
  EXPECT_EQ(post("/panels/P-0009/mask-edits", {{"kind", "give"}, {"outline_mm", {1, 2, 3, 4, 5, 9}}}).status, 404);
  // Half of it is usable already; the tag is spared.
  const ApiReply given =
      post("/panels/P-0001/mask-edits", {{"kind", "give"}, {"outline_mm", {10, 0, 30, 0, 30, 20, 10, 20}}});
  ASSERT_EQ(given.status, 200) << given.body;
  EXPECT_GT(body_of(given)["changed_mm2"].get<double>(), 200);
  expect_book(600 - 64, 80 + 32);
  const ApiReply withheld =
      post("/panels/P-0001/mask-edits",
           {{"kind", "withhold"}, {"outline_mm", {0, 0, 5, 0, 5, 20, 0, 20}}, {"note", "a stain"}});
  ASSERT_EQ(withheld.status, 200) << withheld.body;
  expect_book(600 - 64 - 100, 80 + 32 + 50);
  EXPECT_THAT(cli::render_edited(body_of(withheld)), HasSubstr("--remove 2"));
  const json edits = get("/panels/P-0001/mask-edits");
  ASSERT_EQ(edits["edits"].size(), 2U);
  EXPECT_EQ(edits["edits"][1]["note"], "a stain");
  EXPECT_THAT(cli::render_edits(edits), HasSubstr("withhold"));
  EXPECT_EQ(get("/panels/P-0001/masks")["versions"][0]["painted"], true);
  EXPECT_EQ(post("/panels/P-0001/revert").status, 409) << "there is one scan";
  ASSERT_EQ(ask("DELETE", "/api/v1/panels/P-0001/mask-edits/1").status, 200);
  expect_book(300 - 100, 50);
  EXPECT_EQ(ask("DELETE", "/api/v1/panels/P-0001/mask-edits/1").status, 409);
  EXPECT_EQ(ask("DELETE", "/api/v1/panels/P-0001/mask-edits/7").status, 404);
  // Back to how the scan saw it first, and no further: what is withheld stays so.
  ASSERT_EQ(post("/panels/P-0001/revert", {{"version", 1}}).status, 200);
  expect_book(300 - 100, 50);
  // By brush, from one side to the other: 2 mm of 20 that half of the panel is high.
  const ApiReply brushed =
      post("/panels/P-0001/mask-edits",
           {{"kind", "withhold"}, {"strokes_mm", {0, 10, 30, 10, 3, 3}}, {"stroke_points", {2, 1}}, {"width_mm", 2}});
  ASSERT_EQ(brushed.status, 200) << brushed.body;
  EXPECT_LT(body_of(brushed)["changed_mm2"].get<double>(), -15);
  EXPECT_GT(body_of(brushed)["changed_mm2"].get<double>(), -70);
}

TEST_F(ProposalRoutes, SheetsThatNothingShowsToBeOneAreNotMerged) {
  for (const int tag : {301, 302})
    ASSERT_EQ(ended(post(fmt::format("/proposals/{}/accept", propose(tag)))).state, TaskState::kDone);
  const ApiReply refused = post("/panels/P-0001/merge", {{"merged", "P-0002"}});
  EXPECT_EQ(refused.status, 422) << refused.body;
  EXPECT_THAT(refused.body, HasSubstr("panel retire P-0002"));
  EXPECT_EQ(post("/panels/P-0001/merge", {{"merged", "P-0009"}}).status, 404);
  EXPECT_EQ(post("/panels/P-0001/merge").status, 400);
}

}  // namespace
}  // namespace veneer::daemon
