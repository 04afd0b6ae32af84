// What takes a scan back, and a panel out of stock, through the API.
#include <gmock/gmock.h>

#include <opencv2/imgproc.hpp>

#include "base/polygon_ops.h"
#include "cli/render.h"
#include "tests/support/routed_cell.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kThen = "2026-05-01T07:30:00.000Z";
constexpr int kColumns = 360, kRows = 240;
const SquareMillimetres kWhole(kColumns* kRows / (kMapResolution.px_per_mm * kMapResolution.px_per_mm));

Ring<PanelFrame> square(double x, double y, double side) {
  return {point<PanelFrame>(x, y), point<PanelFrame>(x + side, y), point<PanelFrame>(x + side, y + side),
          point<PanelFrame>(x, y + side)};
}

class PanelRoutes : public testing::RoutedCell {
 protected:
  PanelRoutes() {
    for (const char* id : {"P-0001", "P-0002"}) {
      db::PanelRecord panel;
      panel.id = {id}, panel.name = id, panel.width = 30_mm, panel.height = 20_mm, panel.created_at = kThen;
      const auto picture =
          cell->panel_library.store_picture(cv::Mat(kRows, kColumns, CV_8UC1, cv::Scalar(255)), "panels", "all");
      if (!picture) throw std::runtime_error(picture.error().message);
      panel.map_file = panel.mask_file = picture->file, panel.map_hash = picture->sha256;
      panel.usable = kWhole;
      change([&](Repositories& r) { return r.panels.add(panel, {}, {}); });
    }
    // A second scan of the first one sees half of its wood only.
    const auto less =
        cell->panel_library.store_picture(cv::Mat(kRows, kColumns, CV_8UC1, cv::Scalar(0)), "panels", "less");
    if (!less) throw std::runtime_error(less.error().message);
    change([&](Repositories& r) -> Status {
      const auto version =
          r.panels.add_mask({"P-0001"}, {0, less->file, less->file, less->sha256, kThen, SquareMillimetres(100)}, 1);
      return version ? Ok() : Status(version.error());
    });
  }

  template <class F>
  void change(F work) {
    const Status done = cell->database->call([&](Repositories& r) -> Status { return work(r); });
    if (!done) throw std::runtime_error(done.error().message);
  }
  json get(const std::string& path) { return body_of(ask("GET", "/api/v1" + path)); }
  ApiReply post(const std::string& path, const json& body = json::object()) {
    return ask("POST", "/api/v1" + path, body);
  }
};

TEST_F(PanelRoutes, TakeTheLastScanBack) {
  EXPECT_EQ(get("/panels/P-0001")["usable_mm2"], 100);
  const ApiReply reverted = post("/panels/P-0001/revert");
  ASSERT_EQ(reverted.status, 200) << reverted.body;
  EXPECT_EQ(body_of(reverted)["version"], 3);
  EXPECT_NEAR(get("/panels/P-0001")["usable_mm2"].get<double>(), kWhole.count(), 1e-5);
  const json masks = get("/panels/P-0001/masks");
  ASSERT_EQ(masks["versions"].size(), 3U);
  EXPECT_EQ(masks["versions"][0]["same_as"], 1);
  EXPECT_TRUE(masks["versions"][1]["same_as"].is_null());
  EXPECT_THAT(cli::render_masks(masks), HasSubstr("counts, version 1 again"));

  EXPECT_EQ(post("/panels/P-0001/revert").status, 409) << "not forth again";
  ASSERT_EQ(post("/panels/P-0001/revert", {{"version", 2}}).status, 200) << "and back";
  EXPECT_EQ(get("/panels/P-0001")["usable_mm2"], 100);
  EXPECT_EQ(post("/panels/P-0001/revert", {{"version", 9}}).status, 404);
  EXPECT_EQ(post("/panels/P-0009/revert").status, 404);
  const ApiReply once = post("/panels/P-0002/revert");
  EXPECT_EQ(once.status, 409);
  EXPECT_THAT(once.body, HasSubstr("nothing to go back to"));
}

TEST_F(PanelRoutes, ARetiredPanelIsOutOfStockUntilItIsRestored) {
  ASSERT_EQ(post("/panels/P-0002/retire", {{"reason", "the wrong face was scanned"}}).status, 200);
  EXPECT_EQ(get("/panels/P-0002")["retired"]["reason"], "the wrong face was scanned");
  const json all = get("/panels");
  EXPECT_TRUE(all["panels"][0]["retired"].is_null());
  EXPECT_THAT(cli::render_panels(all), HasSubstr("P-0002 is retired: the wrong face was scanned"));
  EXPECT_EQ(post("/panels/P-0002/retire", {{"reason", "again"}}).status, 409);
  EXPECT_EQ(post("/panels/P-0001/retire").status, 400) << "without a reason";
  EXPECT_EQ(post("/panels/P-0001/retire", {{"reason", std::string(501, 'x')}}).status, 400);
  std::string umlauts;
  for (int i = 0; i < 500; ++i) umlauts += "\xC3\xBC";
  EXPECT_EQ(post("/panels/P-0001/retire", {{"reason", umlauts}}).status, 200) << "characters, not bytes";
  ASSERT_EQ(post("/panels/P-0001/restore").status, 200);
  ASSERT_EQ(post("/panels/P-0002/restore").status, 200);
  EXPECT_THAT(cli::render_panels(get("/panels")), Not(HasSubstr("retired")));
}

// It rose while pieces were cut, and counted what was cut until the next scan.
TEST_F(PanelRoutes, FreeWoodIsWhatNothingIsBookedOn) {
  EXPECT_EQ(get("/panels/P-0002")["free_mm2"], get("/panels/P-0002")["usable_mm2"]);
  db::NewPlan plan;
  plan.name = "portrait", plan.who = "local:1000", plan.plan_json = "{}", plan.options_json = "{}";
  for (const double x : {5.0, 15.0}) {
    db::PlannedPatch& patch = plan.pieces.emplace_back();
    patch.mark = x < 10 ? "A1" : "A2";
    for (const auto& p : square(0, 0, 6))
      patch.artwork_outline.push_back(point<ArtworkFrame>(p.x.count(), p.y.count()));
    patch.panel = PanelId{"P-0002"};
    patch.panel_outline = square(x, 5, 6);
    patch.allocation = offset(Region<PanelFrame>(patch.panel_outline), 0.25_mm);
    patch.panel_from_artwork = Isometry2<PanelFrame, ArtworkFrame>(Radians(0), point<PanelFrame>(x, 5));
  }
  plan.planned_on = {{PanelId{"P-0002"}, 1}};
  std::vector<db::PieceRecord> pieces;
  change([&](Repositories& r) -> Status {
    const auto job = r.jobs.create(plan, kThen);
    if (!job) return job.error();
    auto all = r.jobs.pieces(*job);
    if (!all) return all.error();
    pieces = std::move(*all);
    return Ok();
  });
  // A pixel that is touched is not free, all around: 0.085 mm of 6.5 each.
  const double reserved = get("/panels/P-0002")["free_mm2"];
  EXPECT_NEAR(reserved, kWhole.count() - 2 * 6.5 * 6.5, 2 * 4 * 6.7 * 0.17);
  EXPECT_LE(reserved, kWhole.count() - 2 * 6.5 * 6.5);
  change([&](Repositories& r) -> Status {
    const auto run = r.jobs.start_run(
        pieces[0].job, PanelId{"P-0002"},
        Isometry2<BedFrame, PanelFrame>(degrees(178), point<BedFrame>(40, 30), Handedness::kImproper), 0.04_mm, kThen);
    if (!run) return run.error();
    if (Status cutting = r.jobs.mark_cutting(pieces[0].id, kThen); !cutting) return cutting;
    if (Status cut = r.jobs.book_piece(pieces[0].id, kThen); !cut) return cut;
    return r.jobs.finish_run(*run, false, kThen);
  });
  EXPECT_EQ(get("/panels/P-0002")["free_mm2"], reserved) << "what was cut is as little free as what is to be cut";
  change([&](Repositories& r) { return r.jobs.cancel(pieces[0].job, kThen); });
  EXPECT_NEAR(get("/panels/P-0002")["free_mm2"].get<double>(), (kWhole.count() + reserved) / 2, 1e-6);
}

// One file that is lost must not hide the whole stock.
TEST_F(PanelRoutes, AMaskThatCannotBeReadLeavesNothingFreeAndTheOthersListed) {
  change([](Repositories& r) {
    return r.ledger.write_off({"P-0001"}, Region<PanelFrame>(square(5, 5, 6)), "burnt", kThen);
  });
  std::filesystem::remove(cell->panel_library.path_of(
      cell->database->call([](Repositories& r) { return r.panels.find({"P-0001"}); })->mask_file));
  const json all = get("/panels");
  ASSERT_EQ(all["panels"].size(), 2U) << all.dump();
  EXPECT_EQ(all["panels"][0]["free_mm2"], 0);
  EXPECT_GT(all["panels"][1]["free_mm2"], 0);
}

}  // namespace
}  // namespace veneer::daemon
