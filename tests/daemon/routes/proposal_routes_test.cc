// Scans that wait, through the API: looked at, accepted with what is overruled, refused; and masks that are painted on.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <filesystem>

#include "calib/tag_detector.h"
#include "cli/render.h"
#include "daemon/orders/stored_picture.h"
#include "daemon/stock/mask_painter.h"
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

// Strips in doubt are of every day, and left out; what would admit wood or its place against a doubt is not.
TEST_F(ProposalRoutes, AnOperatorOverrulesWhatIsLeftOutAndAMaintainerTheRest) {
  const auto number = propose(301, {{"strip-1", "it looks like the board"}, {"size", "the sheet is not round"}});
  const std::string target = fmt::format("/proposals/{}/accept", number);
  const json told = get(fmt::format("/proposals/{}", number))["warnings"];
  EXPECT_EQ(told[0]["overruled_by"], "operator");
  EXPECT_EQ(told[1]["overruled_by"], "maintainer");
  role = Role::kOperator;
  const ApiReply refused = post(target, {{"override", {"strip-1", "size"}}});
  EXPECT_EQ(refused.status, 403);
  EXPECT_THAT(refused.body, HasSubstr("overruling \\\"size\\\" needs the maintainer role"));
  EXPECT_EQ(post("/scans", {{"accept", true}, {"override", {"size"}}}).status, 403);
  EXPECT_TRUE(get("/panels")["panels"].empty());
  role = Role::kMaintainer;
  EXPECT_EQ(ended(post(target, {{"override", {"strip-1", "size"}}})).state, TaskState::kDone);
  role = Role::kOperator;
  const auto usual = propose(302, {{"strip-1", "it looks like the board"}, {"dust", "a hair"}});
  EXPECT_EQ(ended(post(fmt::format("/proposals/{}/accept", usual), {{"override", {"strip-1", "dust"}}})).state,
            TaskState::kDone);
  const auto sound = propose(303);
  EXPECT_EQ(ended(post(fmt::format("/proposals/{}/accept", sound))).state, TaskState::kDone) << "it warns of nothing";
}

// Somebody has to look at just these; where nobody was told that the mask is lost, green and red are not left out.
TEST_F(ProposalRoutes, OfAPanelWhoseMaskIsLostAreShownWhereTheySaySo) {
  ASSERT_EQ(ended(post(fmt::format("/proposals/{}/accept", propose(301)))).state, TaskState::kDone);
  const auto panel = cell->database->call([](Repositories& r) { return r.panels.find(PanelId{"P-0001"}); });
  const auto mask = cell->panel_library.path_of(panel->mask_file);
  int width = 300;  // another one each time, or it is known
  const auto picture_of = [&](const std::string& warning) {
    SeenSheet again = seen(301, {{"unproven-1", "nobody could tell"}, {warning, "somebody looks"}});
    again.panel = PanelId{"P-0001"}, again.after = 1;
    const auto waiting = cell->proposals->propose(std::move(again), "uid 1000");
    if (!waiting || !waiting->proposal) throw std::runtime_error("it does not wait");
    std::filesystem::remove_all(cell->panel_library.small_dir());
    return ask("GET", fmt::format("/api/v1/proposals/{}/picture.png?width={}", waiting->proposal->value, ++width))
        .status;
  };
  EXPECT_EQ(picture_of("light"), 200);
  ASSERT_TRUE(write_stored_picture(cv::Mat(kRows, kColumns, CV_8UC3, cv::Scalar(1, 2, 3)), mask));
  EXPECT_EQ(picture_of("light"), 500);
  EXPECT_EQ(picture_of("lost-mask"), 200);
  ASSERT_TRUE(std::filesystem::remove(mask));
  EXPECT_EQ(picture_of("light"), 500);
  for (const char* told : {"unproven-mask", "lost-mask"}) EXPECT_EQ(picture_of(told), 200) << told;
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
        json{{"strokes_mm", {1, 2}}, {"stroke_points", {1}}, {"width_mm", 0.4}},
        json{{"strokes_mm", {1, 2}}, {"stroke_points", {1}}, {"width_mm", 61}},
        json{{"strokes_mm", std::vector<int>(1002, 3)}, {"stroke_points", {500, 1}}, {"width_mm", 4}},
        json{{"strokes_mm", {1, 2}}, {"stroke_points", {1}}, {"width_mm", 4}, {"outline_mm", {1, 2, 3, 4, 5, 9}}},
        json{{"outline_mm", {1, 2, 3, 4, 5, 9}}, {"width_mm", 4}}}) {
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
  EXPECT_EQ(edits["edits"][1]["box_mm"], json({0, 0, 5, 20}));
  EXPECT_EQ(edits["edits"][1]["corners"], 4);
  EXPECT_FALSE(edits["edits"][1].contains("shape_mm")) << "up to thousands of corners: each tells its own";
  const json stain = get("/panels/P-0001/mask-edits/2");
  EXPECT_EQ(stain["shape_mm"][0].size(), 4U);
  EXPECT_THAT(cli::render_edit(stain), HasSubstr("5,20"));
  EXPECT_EQ(ask("GET", "/api/v1/panels/P-0001/mask-edits/7").status, 404);
  const json first = get("/panels/P-0001/mask-edits?limit=1");
  ASSERT_TRUE(first.contains("next")) << first;
  const json second = get(fmt::format("/panels/P-0001/mask-edits?limit=1&cursor={}", first["next"].get<int>()));
  EXPECT_EQ(first["edits"].size(), 1U);
  EXPECT_EQ(second["edits"][0], edits["edits"][1]);
  EXPECT_TRUE(second["next"].is_null());
  EXPECT_THAT(cli::render_edits(edits), HasSubstr("withhold"));
  EXPECT_EQ(get("/panels/P-0001/masks")["versions"][0]["painted"], true);
  EXPECT_EQ(post("/panels/P-0001/revert").status, 409) << "there is one scan";
  ASSERT_EQ(ask("DELETE", "/api/v1/panels/P-0001/mask-edits/1").status, 200);
  expect_book(300 - 100, 50);
  EXPECT_EQ(get("/panels/P-0001/mask-edits?counting=true")["edits"].size(), 1U);
  EXPECT_EQ(get("/panels/P-0001/mask-edits")["edits"].size(), 2U);
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

// A mask of hundreds of strokes costs each new one no more than the first: the file that the scan saw is not even read.
TEST_F(ProposalRoutes, AStrokeIsDrawnOverTheMaskThatHasAllOthers) {
  ASSERT_EQ(ended(post(fmt::format("/proposals/{}/accept", propose(301)))).state, TaskState::kDone);
  const auto stroke = [&](const char* kind, double x) {
    return post("/panels/P-0001/mask-edits",
                {{"kind", kind}, {"strokes_mm", {x, 2, x, 18}}, {"stroke_points", {2}}, {"width_mm", 2}});
  };
  ASSERT_EQ(stroke("withhold", 5).status, 200);
  const auto masks = cell->database->call([](Repositories& r) { return r.panels.masks({"P-0001"}); });
  const std::string seen = masks->front().seen_file;
  const auto aside = cell->panel_library.path_of(seen + ".aside");
  std::filesystem::rename(cell->panel_library.path_of(seen), aside);
  EXPECT_EQ(stroke("give", 14.5).status, 200);
  const ApiReply third = stroke("withhold", 10);
  ASSERT_EQ(third.status, 200) << third.body;
  const ApiReply back = ask("DELETE", "/api/v1/panels/P-0001/mask-edits/3");
  EXPECT_EQ(back.status, 200) << back.body << ", and it was drawn without it before";
  EXPECT_NE(ask("DELETE", "/api/v1/panels/P-0001/mask-edits/1").status, 200) << "here all is drawn anew";
  std::filesystem::rename(aside, cell->panel_library.path_of(seen));
  ASSERT_EQ(stroke("withhold", 10).status, 200);

  // The same as all of it drawn at once, by whoever remembers nothing.
  const auto paint = cell->database->call([](Repositories& r) { return paint_of(r, {"P-0001"}); });
  ASSERT_EQ(paint->edits.size(), 3U);
  const auto anew = painted_mask(PanelLibrary(config.store.data_dir), {"P-0001"}, seen, *paint);
  ASSERT_TRUE(anew.ok()) << anew.error().message;
  const auto panel = cell->database->call([](Repositories& r) { return r.panels.find({"P-0001"}); });
  EXPECT_EQ(anew->file, panel->mask_file) << "files are named by their content";
}

TEST_F(ProposalRoutes, AMaskTakesSoManyEditsAndSaysWhatToDoThen) {
  ASSERT_EQ(ended(post(fmt::format("/proposals/{}/accept", propose(301)))).state, TaskState::kDone);
  const auto add = [&](const Region<PanelFrame>& shape, std::size_t times) {
    return cell->database->call([&](Repositories& r) -> Status {
      const auto masks = r.panels.masks({"P-0001"});
      if (!masks) return masks.error();
      db::MaskRecord made = masks->front();
      for (std::size_t i = 0; i < times; ++i) {
        const int after = masks->front().version + static_cast<int>(i);
        if (const auto added =
                r.masks.add({"P-0001"}, {{}, false, shape, "uid 1000", "", made.made_at, {}}, made, after);
            !added)
          return added.error();
      }
      return Ok();
    });
  };
  const auto corner = [](double side) {
    return Region<PanelFrame>(
        {point<PanelFrame>(1, 1), point<PanelFrame>(1 + side, 1), point<PanelFrame>(1, 1 + side)});
  };
  const json edit = {{"kind", "withhold"}, {"outline_mm", {1, 1, 4, 1, 4, 4}}};
  ASSERT_TRUE(add(corner(1), db::kMostMaskEdits - 1).ok());
  ASSERT_EQ(post("/panels/P-0001/mask-edits", edit).status, 200);
  const ApiReply full = post("/panels/P-0001/mask-edits", edit);
  EXPECT_EQ(full.status, 409);
  EXPECT_THAT(full.body, HasSubstr("takes 200 edits in all"));
  EXPECT_THAT(full.body, HasSubstr("take some back"));
  for (const char* number : {"1", "2"})
    ASSERT_EQ(ask("DELETE", std::string("/api/v1/panels/P-0001/mask-edits/") + number).status, 200);
  MicroRing comb{{0, 0}};
  while (comb.size() < db::kMostMaskEditCorners) {
    const auto x = static_cast<std::int64_t>(comb.size() / 4);
    comb.insert(comb.end(), {{x, 1000}, {x + 1, 2000}});
  }
  ASSERT_TRUE(add(Region<PanelFrame>(MicroArea{{comb}}), 1).ok());
  const ApiReply intricate = post("/panels/P-0001/mask-edits", edit);
  EXPECT_EQ(intricate.status, 409);
  EXPECT_THAT(intricate.body, HasSubstr("edits of 100000 corners in all"));
}

// Whoever paints looks at a picture, and another scan or another hand may have changed the mask meanwhile.
TEST_F(ProposalRoutes, StrokesBelongToTheVersionThatTheyWerePaintedOn) {
  ASSERT_EQ(ended(post(fmt::format("/proposals/{}/accept", propose(301)))).state, TaskState::kDone);
  EXPECT_EQ(get("/panels/P-0001")["mask_version"], 1);
  json strokes = {{"kind", "withhold"}, {"strokes_mm", {2, 10, 10, 10}}, {"stroke_points", {2}}, {"width_mm", 2}};
  strokes["version"] = 1;
  const ApiReply first = post("/panels/P-0001/mask-edits", strokes);
  ASSERT_EQ(first.status, 200) << first.body;
  EXPECT_EQ(body_of(first)["version"], 2);
  EXPECT_EQ(get("/panels/P-0001")["mask_version"], 2);
  const ApiReply late = post("/panels/P-0001/mask-edits", strokes);
  EXPECT_EQ(late.status, 409) << late.body;
  EXPECT_THAT(late.body, HasSubstr("painted on version 1 of the mask of panel P-0001, and version 2 counts by now"));
  EXPECT_EQ(get("/panels/P-0001/mask-edits")["edits"].size(), 1U);
  strokes["version"] = 2;
  EXPECT_EQ(post("/panels/P-0001/mask-edits", strokes).status, 200) << "once somebody has looked";
  strokes["version"] = 0;
  EXPECT_EQ(post("/panels/P-0001/mask-edits", strokes).status, 400);
}

// An outline is drawn by the same picture, with the other strips in it.
TEST_F(ProposalRoutes, AnOutlineBelongsToThePanelAsItWasDrawnOn) {
  ASSERT_EQ(ended(post(fmt::format("/proposals/{}/accept", propose(301)))).state, TaskState::kDone);
  const auto newest = [&] {
    int version = 1;
    const json panel = get("/panels/P-0001");
    for (const json& zone : panel["zones"]) version = std::max(version, zone["version"].get<int>());
    return version;
  };
  const auto drawn = [&](double from, int mask, int zones) {
    const json outline = {from, 4, from + 8, 4, from + 8, 12, from, 12};
    return post("/panels/P-0001/zones", {{"outline_mm", outline}, {"mask_version", mask}, {"zones_version", zones}});
  };
  ASSERT_EQ(newest(), 1);
  ASSERT_EQ(drawn(4, 1, 1).status, 200);
  ASSERT_EQ(newest(), 2);
  const auto zones = get("/panels/P-0001")["zones"].size();
  const ApiReply beside = drawn(8, 1, 1);
  EXPECT_EQ(beside.status, 409) << beside.body;
  EXPECT_THAT(
      beside.body,
      HasSubstr("drawn over version 1 of the outlines on panel P-0001, and version 2 counts by now: look whether "
                "it still fits, then send it again with `zones_version` 2"));
  const json withheld = {{"kind", "withhold"}, {"outline_mm", {2, 10, 10, 10, 10, 14}}};
  ASSERT_EQ(post("/panels/P-0001/mask-edits", withheld).status, 200);
  const ApiReply late = drawn(8, 1, 2);
  EXPECT_EQ(late.status, 409) << late.body;
  EXPECT_THAT(late.body,
              HasSubstr("drawn on version 1 of the mask of panel P-0001, and version 2 counts by now: look whether it "
                        "still fits, then send it again with `mask_version` 2"));
  EXPECT_EQ(get("/panels/P-0001")["zones"].size(), zones);
  EXPECT_EQ(newest(), 2) << "nothing of what was refused is drawn";
  EXPECT_EQ(drawn(8, 2, 2).status, 200) << "once somebody has looked";
  EXPECT_EQ(drawn(8, 0, 3).status, 400);
  EXPECT_EQ(drawn(8, 2, 0).status, 400);
  EXPECT_EQ(post("/panels/P-0001/zones", {{"outline_mm", {20, 4, 28, 4, 28, 12}}}).status, 200)
      << "whoever has looked at no picture says no version";
}

TEST_F(ProposalRoutes, ABrushGivesBackNoTagAndNothingThatIsBooked) {
  ASSERT_EQ(ended(post(fmt::format("/proposals/{}/accept", propose(301)))).state, TaskState::kDone);
  const char* const at = "2026-05-01T07:30:00.000Z";
  const auto booked = cell->database->call([&](Repositories& r) -> Status {
    db::NewPlan plan;
    plan.name = "portrait", plan.plan_json = "{}", plan.options_json = "{}";
    for (const double y : {2.0, 12.0}) {
      db::PlannedPatch& patch = plan.pieces.emplace_back();
      patch.mark = y < 10 ? "A1" : "A2";
      patch.artwork_outline = {point<ArtworkFrame>(0, 0), point<ArtworkFrame>(4, 0), point<ArtworkFrame>(4, 4),
                               point<ArtworkFrame>(0, 4)};
      patch.panel = PanelId{"P-0001"};
      patch.panel_outline = {point<PanelFrame>(5, y), point<PanelFrame>(9, y), point<PanelFrame>(9, y + 4),
                             point<PanelFrame>(5, y + 4)};
      patch.allocation = offset(Region<PanelFrame>(patch.panel_outline), 0.25_mm);
      patch.panel_from_artwork = Isometry2<PanelFrame, ArtworkFrame>(Radians(0), point<PanelFrame>(5, y));
    }
    plan.planned_on = {{PanelId{"P-0001"}, 1}};
    const auto job = r.jobs.create(plan, at);
    if (!job) return job.error();
    const auto pieces = r.jobs.pieces(*job);
    if (!pieces) return pieces.error();
    const auto run = r.jobs.start_run(
        *job, PanelId{"P-0001"},
        Isometry2<BedFrame, PanelFrame>(degrees(178), point<BedFrame>(40, 30), Handedness::kImproper), 0.04_mm, at);
    if (!run) return run.error();
    if (Status cutting = r.jobs.mark_cutting(pieces->front().id, at); !cutting) return cutting;
    if (Status cut = r.jobs.book_piece(pieces->front().id, at); !cut) return cut;
    return r.jobs.finish_run(*run, false, at);
  });
  ASSERT_TRUE(booked.ok()) << booked.error().message;
  // All of the panel, by the widest brush, and over its rim. First all is withheld, so that all is to be given.
  json strokes = {{"kind", "withhold"}, {"strokes_mm", {-5, 10, 35, 10}}, {"stroke_points", {2}}, {"width_mm", 60}};
  const ApiReply withheld = post("/panels/P-0001/mask-edits", strokes);
  ASSERT_EQ(withheld.status, 200) << withheld.body;
  EXPECT_EQ(body_of(withheld)["usable_mm2"], 0);
  EXPECT_EQ(body_of(withheld)["reserved"].size(), 1U) << "one is cut, one is still to be";
  strokes["kind"] = "give";
  const ApiReply given = post("/panels/P-0001/mask-edits", strokes);
  ASSERT_EQ(given.status, 200) << given.body;
  const double usable = body_of(given)["usable_mm2"];
  EXPECT_LE(usable, 600 - 8 * 8) << "the tag and 1.5 mm about it";
  EXPECT_GE(usable, 600 - 8.4 * 8.4 - 20);
  const json panel = get("/panels/P-0001");
  EXPECT_LE(panel["free_mm2"].get<double>(), usable - 2 * 4.5 * 4.5 + 1e-6) << "what is cut, and what is reserved";
  EXPECT_NEAR(panel["area_book_mm2"]["cut"].get<double>(), 16, 0.01);
  EXPECT_NEAR(panel["area_book_mm2"]["reserved"].get<double>(), 4.5 * 4.5, 0.01);

  // Who did it, and how much it was.
  ASSERT_EQ(ask("DELETE", "/api/v1/panels/P-0001/mask-edits/2").status, 200);
  std::vector<std::string> told;
  const json log = get("/audit?panel=P-0001");
  for (const json& row : log["entries"])
    if (row["what"].get<std::string>().starts_with("mask.")) {
      EXPECT_EQ(row["who"], "uid 1000");
      told.push_back(row["what"].get<std::string>() + " " + row["detail"].get<std::string>());
    }
  ASSERT_EQ(told.size(), 3U);
  EXPECT_THAT(told[2], HasSubstr("mask.withhold panel P-0001, version 2: edit 1, 600.00 mm2 painted, "));
  EXPECT_THAT(told[2], HasSubstr("mm2 less usable"));
  EXPECT_THAT(told[1], HasSubstr("mask.give panel P-0001, version 3: edit 2, 600.00 mm2 painted, "));
  EXPECT_THAT(told[1], HasSubstr("mm2 more usable"));
  EXPECT_THAT(told[0], HasSubstr("mask.take_back panel P-0001, version 4: edit 2 (600.00 mm2 given by uid 1000)"));
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
