// What a piece tells of its life, through the API and in veneerctl's words.
#include <gmock/gmock.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "cli/render.h"
#include "tests/support/panel_shapes.h"
#include "tests/support/routed_cell.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

using testing::panel_square;

constexpr const char* kPlannedAt = "2026-05-01T07:30:00.000Z";

// A panel that is red on the left and blue on the right, and a job of four squares of 6 mm in two rows: A1 A2 / A3 A4.
// All but A4 have wood; A1 lies in the red, turned by 90 degrees.
class PieceRoutes : public testing::RoutedCell {
 protected:
  PieceRoutes() {
    cv::Mat map(480, 720, CV_8UC3, cv::Scalar(0, 0, 200));
    map(cv::Rect(360, 0, 360, 480)).setTo(cv::Scalar(200, 0, 0));
    db::PanelRecord panel;
    panel.id = {"P-0001"}, panel.name = "walnut", panel.width = 60.96_mm, panel.height = 40.64_mm;
    panel.created_at = kPlannedAt;
    const auto picture = cell->panel_library.store_picture(map, "panels", "map");
    if (!picture) throw std::runtime_error(picture.error().message);
    panel.map_file = panel.mask_file = picture->file, panel.map_hash = picture->sha256;
    db::ScanRecord scan;
    scan.panel = panel.id, scan.device = "twin:1", scan.file = "scan.png", scan.sha256 = "ab12", scan.dpi = 300;
    scan.lattice = "[]", scan.taken_at = kPlannedAt;
    change([&](Repositories& r) { return r.panels.add(panel, {scan}, {}); });
    change([&](Repositories& r) -> Status {
      const auto made = r.jobs.create(plan(), kPlannedAt);
      if (!made) return made.error();
      const auto kerf = r.certificates.issue(
          {{}, db::CertificateKind::kKerf, kPlannedAt, "2027-01-01T00:00:00.000Z", 0.011_mm, "{}"});
      if (!kerf) return kerf.error();
      // The scanner was calibrated before the scan, and once more after it.
      for (const char* at : {"2026-01-01T00:00:00.000Z", "2026-12-01T00:00:00.000Z"}) {
        const auto scanner =
            r.certificates.issue({{}, db::CertificateKind::kScanner, at, "2027-01-01T00:00:00.000Z", 0.021_mm, "{}"});
        if (!scanner) return scanner.error();
      }
      return Ok();
    });
  }

  // Some pieces' cuts begin beside them.
  static Region<PanelFrame> with_lead_in(const Region<PanelFrame>& wood, const Point<PanelFrame>& corner) {
    return unite(
        wood, Region<PanelFrame>(Ring<PanelFrame>{point<PanelFrame>(corner.x.count() - 1.2, corner.y.count() - 0.2),
                                                  point<PanelFrame>(corner.x.count(), corner.y.count() - 0.2),
                                                  point<PanelFrame>(corner.x.count(), corner.y.count() + 0.2),
                                                  point<PanelFrame>(corner.x.count() - 1.2, corner.y.count() + 0.2)}));
  }
  static db::NewPlan plan() {
    db::NewPlan out;
    out.name = "portrait", out.who = "uid 1000", out.plan_json = "{}", out.options_json = "{}";
    out.planned_on = {{PanelId{"P-0001"}, 1}};
    for (int i = 0; i < 4; ++i) {
      db::PlannedPatch& patch = out.pieces.emplace_back();
      patch.mark = "A" + std::to_string(i + 1);
      const double x = i % 2 * 6, y = i < 2 ? 6 : 0;
      for (const auto& p : panel_square(x, y, 6))
        patch.artwork_outline.push_back(point<ArtworkFrame>(p.x.count(), p.y.count()));
      if (i == 3) continue;
      patch.panel = PanelId{"P-0001"};
      // A1 turned about its lower left corner, so that it lies left of where that comes to lie.
      patch.panel_from_artwork =
          i == 0 ? Isometry2<PanelFrame, ArtworkFrame>(degrees(90), point<PanelFrame>(22, 10))
                 : Isometry2<PanelFrame, ArtworkFrame>(Radians(0), point<PanelFrame>(10 + 12 * i - x, 25 - y));
      patch.panel_outline = patch.panel_from_artwork * patch.artwork_outline;
      patch.allocation = offset(Region<PanelFrame>(patch.panel_outline), 0.25_mm);
      if (i != 1) continue;
      patch.lead_in =
          point<PanelFrame>(patch.panel_outline.front().x.count() - 1, patch.panel_outline.front().y.count());
      patch.allocation = with_lead_in(patch.allocation, patch.panel_outline.front());
    }
    return out;
  }

  void cut_two() {
    change([&](Repositories& r) -> Status {
      const auto pieces = r.jobs.pieces(JobId{1});
      const db::RunFacts facts{"uid 1000", {CertificateId{1}}, R"([{"material":"walnut","pieces":["A1","A2"],
        "cut":{"speed_mm_s":12.5,"power":0.8,"passes":2,"air":true,"kerf_back_mm":0.2,"kerf_show_mm":0.15},
        "engrave":{"speed_mm_s":80,"power":0.2,"passes":1,"air":false}}])"};
      const auto run = r.jobs.start_run(
          JobId{1}, {"P-0001"},
          Isometry2<BedFrame, PanelFrame>(degrees(178), point<BedFrame>(40, 30), Handedness::kImproper), 0.04_mm,
          "2026-05-01T08:00:00.000Z", facts);
      if (!run) return run.error();
      for (const int i : {0, 1}) {
        if (Status cutting = r.jobs.mark_cutting((*pieces)[i].id, "2026-05-01T08:00:01.000Z"); !cutting) return cutting;
        if (Status cut = r.jobs.book_piece((*pieces)[i].id, "2026-05-01T08:00:09.000Z"); !cut) return cut;
      }
      return r.jobs.finish_run(*run, false, "2026-05-01T08:00:10.000Z");
    });
  }

  template <class F>
  void change(F work) {
    const Status done = cell->database->call([&](Repositories& r) -> Status { return work(r); });
    if (!done) throw std::runtime_error(done.error().message);
  }
  json get(const std::string& path) { return body_of(ask("GET", "/api/v1" + path)); }
};

TEST_F(PieceRoutes, APieceTellsWhereItComesFromAndHowItWasMade) {
  cut_two();
  const json piece = get("/jobs/1/pieces/A1");
  EXPECT_EQ(piece, get("/pieces/1"));
  EXPECT_EQ(piece["state"], "cut");
  EXPECT_THAT(piece["neighbours"], ElementsAre("A2", "A3")) << "not the one it touches with a corner";
  EXPECT_EQ(piece["wood"]["panel"], "P-0001");
  EXPECT_EQ(piece["wood"]["mask_version"], 1);
  EXPECT_EQ(piece["wood"]["scans"][0]["sha256"], "ab12");
  EXPECT_EQ(piece["wood"]["scans"][0]["certificate"]["kind"], "scanner");
  EXPECT_EQ(piece["wood"]["scans"][0]["certificate"]["issued"], "2026-01-01T00:00:00.000Z") << "not the later one";
  EXPECT_NEAR(piece["wood"]["rotation_deg"].get<double>(), 90, 1e-9);
  EXPECT_EQ(piece["run"]["who"], "uid 1000");
  EXPECT_EQ(piece["run"]["recipe"]["cut"]["passes"], 2);
  EXPECT_EQ(piece["run"]["certificates"][0]["kind"], "kerf");
  ASSERT_EQ(piece["history"].size(), 3U);
  EXPECT_EQ(piece["history"][2]["state"], "cut");
  EXPECT_EQ(piece["history"][2]["run"], 1);

  const std::string told = cli::render_passport(piece);
  EXPECT_THAT(told, HasSubstr("Piece A1 of job 1, cut\n"));
  EXPECT_THAT(told, HasSubstr("Wood         panel P-0001, walnut\n"));
  EXPECT_THAT(told, HasSubstr("Outline      4 corners, "));
  EXPECT_THAT(told, HasSubstr("Certificate  2 scanner, issued 2026-01-01 00:00:00 UTC, 0.021 mm\n"));
  EXPECT_THAT(told, HasSubstr("Burnt with   12.5 mm/s, 80 % power, 2 passes, with air\n"));
  EXPECT_THAT(told, HasSubstr("History      2026-05-01 07:30:00 UTC  reserved on panel P-0001\n"));
  EXPECT_THAT(told, HasSubstr("started by uid 1000, 2026-05-01 08:00:00 UTC\n"));
}

TEST_F(PieceRoutes, APieceThatIsNotCutYetHasNoRunAndOneWithoutWoodSaysSo) {
  cut_two();
  EXPECT_TRUE(get("/jobs/1/pieces/A3")["run"].is_null());
  const json none = get("/jobs/1/pieces/A4");
  EXPECT_EQ(none["state"], "unfilled");
  EXPECT_TRUE(none["wood"].is_null());
  EXPECT_THAT(cli::render_passport(none), HasSubstr("none was found for it"));
  EXPECT_EQ(ask("GET", "/api/v1/pieces/4/picture.png").status, 404);
  EXPECT_EQ(ask("GET", "/api/v1/jobs/1/pieces/Z9").status, 404);
  EXPECT_EQ(ask("GET", "/api/v1/jobs/7/pieces/A1").status, 404);
  EXPECT_EQ(ask("GET", "/api/v1/pieces/99").status, 404);
  EXPECT_EQ(ask("GET", "/api/v1/pieces/A1").status, 400);
}

// A beam that went astray in another run did not cut the piece.
TEST_F(PieceRoutes, ALaterRunThatPutAPieceInDoubtDidNotCutIt) {
  cut_two();
  change([&](Repositories& r) -> Status {
    const auto pieces = r.jobs.pieces(JobId{1});
    const auto run = r.jobs.start_run(JobId{1}, {"P-0001"}, {}, 0.04_mm, kPlannedAt);
    if (!run) return run.error();
    const PieceId beside = (*pieces)[0].id;
    if (Status ended = r.jobs.abort_run(*run, {}, "off its path", kPlannedAt, {&beside, 1}); !ended) return ended;
    return r.jobs.settle(beside, db::AllocationState::kCut, kPlannedAt, "user anna");
  });
  const json piece = get("/pieces/1");
  EXPECT_EQ(piece["state"], "cut");
  EXPECT_EQ(piece["run"]["who"], "uid 1000");
  EXPECT_EQ(piece["run"]["recipe"]["cut"]["passes"], 2);
}

// A job from before schema 11, or one whose run nobody described.
TEST_F(PieceRoutes, ARunThatNobodyDescribedIsToldWithoutInventions) {
  change([&](Repositories& r) -> Status {
    const auto pieces = r.jobs.pieces(JobId{1});
    const auto run = r.jobs.start_run(JobId{1}, {"P-0001"}, {}, 0.04_mm, kPlannedAt);
    if (!run) return run.error();
    if (Status cutting = r.jobs.mark_cutting((*pieces)[0].id, kPlannedAt); !cutting) return cutting;
    return r.jobs.abort_run(*run, {}, "stop", kPlannedAt);
  });
  const json piece = get("/pieces/1");
  EXPECT_EQ(piece["state"], "suspect");
  EXPECT_TRUE(piece["run"]["who"].is_null());
  EXPECT_TRUE(piece["run"]["recipe"].is_null());
  EXPECT_THAT(cli::render_passport(piece), Not(HasSubstr("started by")));
}

TEST_F(PieceRoutes, ItsPictureIsTheWoodAsItLiesInTheArtwork) {
  const auto picture = [&](int id) {
    const ApiReply reply = ask("GET", "/api/v1/pieces/" + std::to_string(id) + "/picture.png?width=200");
    EXPECT_EQ(reply.status, 200) << reply.body;
    const std::vector<unsigned char> bytes(reply.body.begin(), reply.body.end());
    return cv::imdecode(bytes, cv::IMREAD_COLOR);
  };
  // A2's corner lies at 22, 25 mm: in the red, but for its wood beyond 30.48 mm, at the right border of the margin.
  const cv::Mat a2 = picture(2);
  ASSERT_FALSE(a2.empty());
  EXPECT_LE(a2.cols, 200);
  EXPECT_EQ(a2.cols, a2.rows);
  EXPECT_EQ(a2.at<cv::Vec3b>(a2.rows / 2, a2.cols / 2), cv::Vec3b(0, 0, 200));
  const auto pale = a2.at<cv::Vec3b>(a2.rows / 2, 2);
  EXPECT_GT(pale[0], 100) << "what is around it steps back";
  EXPECT_LT(pale[0], pale[2]);
  // The blue wood is on A2's right in the panel; A1 is turned by 90 degrees, so that what was right of it is above.
  const cv::Mat a1 = picture(1);
  EXPECT_EQ(a1.at<cv::Vec3b>(a1.rows / 2, a1.cols / 2), cv::Vec3b(0, 0, 200));
}

TEST_F(PieceRoutes, APlaceOfAPanelTellsWhatBecameOfIt) {
  cut_two();
  change([](Repositories& r) {
    return r.ledger.write_off({"P-0001"}, Region<PanelFrame>(panel_square(45, 5, 4)), "a burn", kPlannedAt);
  });
  const json here = get("/panels/P-0001/place?x=24&y=28");
  ASSERT_EQ(here["allocations"].size(), 1U);
  EXPECT_EQ(here["allocations"][0]["mark"], "A2");
  EXPECT_EQ(here["allocations"][0]["kerf"], false);
  EXPECT_EQ(cli::render_place(here),
            "Piece A2 of job 1, cut since 2026-05-01 08:00:09 UTC: `veneerctl piece show 2`\n");
  EXPECT_EQ(here["allocations"][0]["lead_in"], false);
  const json band = get("/panels/P-0001/place?x=21.9&y=28");
  EXPECT_EQ(band["allocations"][0]["kerf"], true);
  EXPECT_EQ(band["allocations"][0]["lead_in"], false);
  EXPECT_THAT(cli::render_place(band), HasSubstr("In the kerf of piece A2 of job 1"));
  const json lead_in = get("/panels/P-0001/place?x=21.2&y=25");
  ASSERT_EQ(lead_in["allocations"].size(), 1U);
  EXPECT_EQ(lead_in["allocations"][0]["kerf"], false) << "kerf is the band around the piece";
  EXPECT_EQ(lead_in["allocations"][0]["lead_in"], true);
  EXPECT_THAT(cli::render_place(lead_in), HasSubstr("In the lead-in of piece A2 of job 1"));
  EXPECT_THAT(cli::render_place(get("/panels/P-0001/place?x=46&y=6")), HasSubstr("Written off since"));
  EXPECT_EQ(cli::render_place(get("/panels/P-0001/place?x=2&y=2")), "Nothing is booked there.\n");
  EXPECT_EQ(ask("GET", "/api/v1/panels/P-0001/place?x=2").status, 400);

  change([](Repositories& r) { return r.jobs.cancel({1}, kPlannedAt); });
  change([](Repositories& r) -> Status {
    auto part = r.panels.find({"P-0001"});
    if (!part) return part.error();
    if (Status split = r.panels.split(part->id, "test", "sawn apart", kPlannedAt); !split) return split;
    part->id = {"P-0002"}, part->parent = PanelId{"P-0001"};
    return r.panels.add_part(*part, {}, {}, {Isometry2<PanelFrame, PanelFrame>(), 4, 0.02_mm});
  });
  EXPECT_EQ(cli::render_place(get("/panels/P-0002/place?x=24&y=28")),
            "Piece A2 of job 1, of panel P-0001, cut before this panel was sawn off on 2026-05-01 07:30:00 UTC: "
            "`veneerctl piece show 2`\n");
  EXPECT_EQ(ask("GET", "/api/v1/panels/P-0009/place?x=2&y=2").status, 404);
}

}  // namespace
}  // namespace veneer::daemon
