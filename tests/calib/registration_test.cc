#include "calib/registration.h"

#include <gmock/gmock.h>

#include "calib/point_fit.h"
#include "tests/support/rendered_panel.h"

namespace veneer {
namespace {

using calib::FitResidual;
using calib::PanelFiducials;
using calib::Registration;
using calib::RegistrationOptions;
using calib::ScannerModel;
using calib::TileView;

using GlassFromPanel = Isometry2<GlassFrame, PanelFrame>;

// The scanner's map as a certificate would give it, from two scans of a small AprilGrid sheet.
ScannerModel calibrated(const rendered::Scanner& scanner) {
  calib::AprilGrid grid;
  grid.columns = 7, grid.rows = 5;
  const rendered::PrintedGrid sheet(grid);
  std::vector<calib::GridScan> scans;
  for (const auto& [x, y, angle] : {std::tuple{6.0, 122.0, 0.3}, {22.0, 134.0, -0.5}})
    scans.push_back(calib::grid_scan(
        scan_grid(sheet, Isometry2<GlassFrame, SheetFrame>(degrees(angle), point<GlassFrame>(x, -y)), scanner),
        scanner.nominal(), grid));
  calib::ScannerFitOptions options;
  options.min_tags = 20;
  const auto fit = calib::fit_scanner_model(scans, grid, options);
  EXPECT_TRUE(fit.ok());
  return ScannerModel(fit->model);
}

struct Cell {
  rendered::Panel panel = rendered::sample_panel();
  rendered::Scanner scanner;
  ScannerModel model;

  explicit Cell(bool warped = false, double dpi = 150) {
    if (warped) scanner = rendered::warped_scanner();
    scanner.dpi = dpi;
    scanner.width_mm = 180, scanner.height_mm = 140;
    if (warped) model = calibrated(scanner);
  }
  // The whole panel on the glass.
  GlassFromPanel whole(Face face, double angle_deg = 1.5) const {
    return rendered::lay(75, 55, 90, 70, angle_deg, face);
  }
  TileView scan(Face face, const GlassFromPanel& glass_from_panel, const std::string& name = "scan 1") const {
    return calib::view_tile(scan_panel(panel, face, glass_from_panel, scanner), scanner.nominal(), name);
  }
};

// The perfect cell and its panel, whole on the glass; drawn once.
const Cell& plain_cell() {
  static const Cell cell;
  return cell;
}
const TileView& plain_show() {
  static const TileView view = plain_cell().scan(Face::kShow, plain_cell().whole(Face::kShow), "scan 7");
  return view;
}
PanelFiducials plain_fiducials() {
  static const auto found = register_first_scan(std::span(&plain_show(), 1), ScannerModel());
  EXPECT_TRUE(found.ok());
  return found->fiducials;
}
// The warped cell with its certificate.
const Cell& warped_cell() {
  static const Cell cell(true);
  return cell;
}

// Errors over a 10 mm lattice of true points, after the best isometry on the true fiducials: docs/FRAMES.md.
FitResidual error_of(const Cell& cell, const calib::ScanMap& map, const GlassFromPanel& truth, Face face,
                     const PanelFiducials& found) {
  std::vector<Point<PanelFrame>> is, seems;
  for (const auto& tag : cell.panel.tags) {
    if (tag.face != face || found.tag(tag.id) == nullptr) continue;
    const auto corners = tag.corners();
    for (std::size_t i = 0; i < 4; ++i) {
      is.push_back(corners[i]);
      seems.push_back(found.tag(tag.id)->corners[i]);
    }
  }
  const auto true_from_found = calib::fit_isometry<PanelFrame, PanelFrame>(is, seems);
  is.clear(), seems.clear();
  for (double y = 5; y < cell.panel.height; y += 10)
    for (double x = 5; x < cell.panel.width; x += 10) {
      const Point<ScanFrame> seen = cell.scanner.scan_from_glass(truth * point<PanelFrame>(x, y));
      if (seen.x.count() < 0 || seen.y.count() < 0 || seen.x.count() > cell.scanner.columns() ||
          seen.y.count() > cell.scanner.rows())
        continue;
      is.push_back(point<PanelFrame>(x, y));
      seems.push_back(true_from_found * (map * seen));
    }
  return calib::residual_of(Isometry2<PanelFrame, PanelFrame>(), std::span<const Point<PanelFrame>>(is),
                            std::span<const Point<PanelFrame>>(seems));
}

TEST(Registration, OfALinearScannerIsBelowTenMicrometres) {
  const Cell cell(false, 300);
  const auto pose = cell.whole(Face::kShow);
  const TileView tiles[] = {cell.scan(Face::kShow, pose)};
  const auto found = register_first_scan(tiles, cell.model);
  ASSERT_TRUE(found.ok()) << found.error().message;
  const FitResidual error = error_of(cell, found->tiles[0], pose, Face::kShow, found->fiducials);
  EXPECT_LT(error.rms, 0.010);
  EXPECT_LT(error.max, 0.020);
  EXPECT_FALSE(found->rms.has_value());  // one tile has nothing to disagree with
  EXPECT_EQ(found->fiducials.tags.size(), 5U);
  EXPECT_EQ(found->fiducials.holes.size(), 4U);
}

TEST(Registration, OfAWarpedScannerWithItsCertificateIsBelowThirtyMicrometres) {
  const Cell& cell = warped_cell();
  const auto pose = cell.whole(Face::kShow, 3);
  const TileView tiles[] = {cell.scan(Face::kShow, pose)};
  const auto found = register_first_scan(tiles, cell.model);
  ASSERT_TRUE(found.ok()) << found.error().message;
  const FitResidual error = error_of(cell, found->tiles[0], pose, Face::kShow, found->fiducials);
  EXPECT_LT(error.rms, 0.030);
  EXPECT_LT(error.max, 0.080);
  // Without the certificate the warp stays in.
  const auto naive = register_first_scan(tiles, ScannerModel());
  ASSERT_TRUE(naive.ok());
  EXPECT_GT(error_of(cell, naive->tiles[0], pose, Face::kShow, naive->fiducials).rms, 3 * error.rms);
}

TEST(Registration, PutsTheOriginAtTheSheetsLowerLeftCornerAsItsTagsStand) {
  for (const double angle : {0.0, 2.0, -88.0, 179.0}) {
    Cell cell;
    if (std::abs(angle) > 45 && std::abs(angle) < 135) std::swap(cell.scanner.width_mm, cell.scanner.height_mm);
    const auto pose = rendered::lay(75, 55, cell.scanner.width_mm / 2, cell.scanner.height_mm / 2, angle, Face::kShow);
    const TileView tiles[] = {cell.scan(Face::kShow, pose)};
    const auto found = register_first_scan(tiles, cell.model);
    ASSERT_TRUE(found.ok()) << found.error().message;
    for (const auto& corner : {point<PanelFrame>(0, 0), point<PanelFrame>(150, 110)}) {
      const Point<PanelFrame> seems = found->tiles[0] * cell.scanner.scan_from_glass(pose * corner);
      EXPECT_LT(distance(seems, corner).count(), 0.06) << angle;
    }
    EXPECT_NEAR(found->sheet.width().count(), 150, 0.06);
    EXPECT_NEAR(found->sheet.height().count(), 110, 0.06);
  }
}

TEST(Registration, JoinsTilesAndMeasuresTheirDisagreement) {
  Cell cell(true);
  cell.scanner.width_mm = 120;
  cell.model = calibrated([&] {
    rendered::Scanner whole = cell.scanner;
    whole.width_mm = 180;
    return whole;
  }());
  // The warp is drawn over the scanner's width; the same scanner must be calibrated and used.
  cell.scanner.width_mm = 180;
  cell.panel = rendered::sample_panel(230, 110, 4);
  const auto left = rendered::lay(0, 55, 8, 70, 0.7, Face::kShow),
             right = rendered::lay(230, 55, 172, 71, -1.1, Face::kShow);
  const TileView tiles[] = {cell.scan(Face::kShow, left, "tile 1"), cell.scan(Face::kShow, right, "tile 2")};
  const auto found = register_first_scan(tiles, cell.model);
  ASSERT_TRUE(found.ok()) << found.error().message;
  ASSERT_TRUE(found->rms.has_value());
  EXPECT_LT(found->rms->count(), 0.05);
  EXPECT_GT(found->rms->count(), 0.0005);
  EXPECT_EQ(found->fiducials.tags.size(), 5U);
  EXPECT_EQ(found->fiducials.holes.size(), 4U);
  EXPECT_NEAR(found->sheet.width().count(), 230, 0.15);
  EXPECT_LT(error_of(cell, found->tiles[0], left, Face::kShow, found->fiducials).rms, 0.05);
  EXPECT_LT(error_of(cell, found->tiles[1], right, Face::kShow, found->fiducials).rms, 0.05);
}

TEST(Registration, FitsALaterScanToTheFrozenFiducials) {
  const Cell& cell = plain_cell();
  const PanelFiducials known = plain_fiducials();
  const auto pose = cell.whole(Face::kShow, 178);
  const TileView later[] = {cell.scan(Face::kShow, pose)};
  const auto found = register_scan(later, Face::kShow, known, cell.model);
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_LT(found->rms->count(), 0.01);
  EXPECT_LT(error_of(cell, found->tiles[0], pose, Face::kShow, found->fiducials).rms, 0.010);
  EXPECT_EQ(found->fiducials.tags[0].corners, known.tags[0].corners);
}

// The scan with one of its tags elsewhere by so much, as if it had come loose.
TileView with_moved_tag(TileView view, std::size_t which, double dx_mm, double dy_mm) {
  for (auto& corner : view.tags[which].corners) {
    corner.x += Pixels(dx_mm * view.nominal.px_per_mm);
    corner.y += Pixels(dy_mm * view.nominal.px_per_mm);
  }
  return view;
}

double most_apart(const Registration& a, const Registration& b) {
  double worst = 0;
  for (const auto& p : {point<ScanFrame>(0, 0), point<ScanFrame>(1000, 0), point<ScanFrame>(0, 800)})
    worst = std::max(worst, distance(a.tiles[0] * p, b.tiles[0] * p).count());
  return worst;
}

TEST(Registration, LeavesOutATagThatHasMovedSinceItWasFrozen) {
  const Cell& cell = plain_cell();
  const PanelFiducials known = plain_fiducials();
  const TileView view = cell.scan(Face::kShow, cell.whole(Face::kShow, 178));
  const TileView sound[] = {view};
  const auto untouched = register_scan(sound, Face::kShow, known, cell.model);
  ASSERT_TRUE(untouched.ok()) << untouched.error().message;
  EXPECT_TRUE(untouched->moved.empty());
  // Leave-one-out residuals of everything that was seen before.
  EXPECT_EQ(untouched->left_out.size(), 9U);
  for (const auto& fiducial : untouched->left_out) EXPECT_LT(fiducial.off.count(), 0.03) << name_of(fiducial);
  for (const double by : {0.15, -0.4, 2.5}) {
    for (std::size_t which = 0; which < view.tags.size(); ++which) {
      const TileView later[] = {with_moved_tag(view, which, by, 0.3 * by)};
      const auto found = register_scan(later, Face::kShow, known, cell.model);
      ASSERT_TRUE(found.ok()) << found.error().message;
      ASSERT_EQ(found->moved.size(), 1U);
      EXPECT_EQ(found->moved[0].tag, view.tags[which].id);
      EXPECT_EQ(name_of(found->moved[0]), "tag " + std::to_string(view.tags[which].id));
      EXPECT_NEAR(found->moved[0].off.count(), std::abs(by) * 1.044, 0.03);
      EXPECT_LT(most_apart(*untouched, *found), 0.02);
      EXPECT_EQ(found->fiducials.tags[0].corners, known.tags[0].corners);  // nothing is frozen anew unasked
    }
  }
}

TEST(Registration, TakesNewTagsWhenToldToAndTiesThemToThoseThatStayed) {
  const Cell& cell = plain_cell();
  const PanelFiducials known = plain_fiducials();
  TileView view = with_moved_tag(cell.scan(Face::kShow, cell.whole(Face::kShow, 178)), 1, 4, -2);
  view.tags[2].id = 400;  // where another one had been
  const TileView later[] = {view};
  const auto unasked = register_scan(later, Face::kShow, known, cell.model);
  ASSERT_FALSE(unasked.ok());
  EXPECT_THAT(unasked.error().message, ::testing::HasSubstr("--retag"));
  RegistrationOptions options;
  options.retag = true;
  const auto found = register_scan(later, Face::kShow, known, cell.model, options);
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_THAT(found->new_tags, ::testing::ElementsAre(400));
  ASSERT_NE(found->fiducials.tag(400), nullptr);
  EXPECT_EQ(found->fiducials.tag(view.tags[1].id)->corners, known.tag(view.tags[1].id)->corners);
  const auto again = register_scan(later, Face::kShow, found->fiducials, cell.model);
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->moved.size(), 1U);
  EXPECT_EQ(again->left_out.size(), found->left_out.size() + 1);
  EXPECT_LT(most_apart(*found, *again), 0.01);
  // Nobody can tie new tags to fewer than three old fiducials.
  TileView bare = view;
  bare.holes.clear();
  bare.tags = {view.tags[0], view.tags[2], view.tags[3]};
  const TileView two_old[] = {bare};
  const auto refused = register_scan(two_old, Face::kShow, known, cell.model, options);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr("three are needed to tie new tags to"));
}

// Each tile is fitted alone: what it shows of the panel has to prove where it lies, whatever other tiles show.
TEST(Registration, SaysWhereNobodyCanTellWhetherATagMoved) {
  const Cell& cell = plain_cell();
  const PanelFiducials known = plain_fiducials();
  const TileView whole = cell.scan(Face::kShow, cell.whole(Face::kShow, 178));
  TileView part = whole;
  part.name = "tile 2";
  part.holes.clear();
  part.tags = {whole.tags[0], whole.tags[3]};
  const TileView tiles[] = {whole, part};
  const auto found = register_scan(tiles, Face::kShow, known, cell.model);
  ASSERT_TRUE(found.ok()) << found.error().message;
  ASSERT_EQ(found->agreement.size(), 2U);
  EXPECT_EQ(found->agreement[0].fiducials, 9U);
  EXPECT_TRUE(found->agreement[0].within(Millimetres(0.05)));
  EXPECT_EQ(found->agreement[1].fiducials, 2U);
  EXPECT_FALSE(found->agreement[1].worst) << "two tags agree with anything";
  EXPECT_EQ(found->left_out.size(), 9U);
  // A new tag beside them would be frozen wherever they put it.
  TileView beside = part;
  beside.tags.push_back(whole.tags[2]);
  beside.tags.back().id = 400;
  TileView without = whole;
  std::erase_if(without.tags, [&](const auto& tag) { return tag.id == whole.tags[2].id; });
  RegistrationOptions options;
  options.retag = true;
  const TileView glued[] = {without, beside};
  const auto refused = register_scan(glued, Face::kShow, known, cell.model, options);
  ASSERT_FALSE(refused.ok()) << "the other tile's nine prove nothing here";
  EXPECT_THAT(refused.error().message, ::testing::AllOf(::testing::HasSubstr("tile 2"),
                                                        ::testing::HasSubstr("three are needed to tie new tags")));
}

// A scanner that warmed up runs a little longer than it was calibrated: no tag has moved, and none may be blamed.
TEST(Registration, BlamesNoTagForAScannerThatRunsOtherwise) {
  const Cell& cell = plain_cell();
  const PanelFiducials known = plain_fiducials();
  const TileView view = cell.scan(Face::kShow, cell.whole(Face::kShow, 178));
  for (const double drift : {0.0005, 0.001, 0.002}) {
    TileView longer = view;
    for (auto& tag : longer.tags)
      for (auto& corner : tag.corners) corner.y = corner.y * (1 + drift);
    for (auto& hole : longer.holes) hole.centre.y = hole.centre.y * (1 + drift);
    const auto found = register_scan(std::span(&longer, 1), Face::kShow, known, cell.model);
    if (found.ok()) {
      EXPECT_TRUE(found->moved.empty()) << drift;
      continue;
    }
    EXPECT_THAT(found.error().message, ::testing::HasSubstr("calibrate the scanner")) << drift;
  }
}

TEST(Registration, RefusesAndDoesNotRetagWhereThreeDisagree) {
  const Cell& cell = plain_cell();
  const PanelFiducials known = plain_fiducials();
  TileView three = cell.scan(Face::kShow, cell.whole(Face::kShow, 178));
  three.holes.clear();
  const auto fourth = three.tags[3];
  three.tags.resize(3);
  const auto moved_by = [&](double mm) {
    TileView view = with_moved_tag(three, 1, mm, 0);
    view.tags.push_back(fourth);
    view.tags.back().id = 400;
    return view;
  };
  RegistrationOptions retag;
  retag.retag = true;
  TileView a_little = moved_by(0.09);
  const TileView little[] = {a_little};
  const auto not_tied = register_scan(little, Face::kShow, known, cell.model, retag);
  ASSERT_FALSE(not_tied.ok());
  EXPECT_THAT(not_tied.error().message, ::testing::HasSubstr("new tags are tied to such as agree"));
  a_little.tags.pop_back();
  const TileView shown[] = {a_little};
  const auto told = register_scan(shown, Face::kShow, known, cell.model);
  ASSERT_TRUE(told.ok()) << told.error().message;
  ASSERT_TRUE(told->agreement[0].worst);
  EXPECT_GT(told->agreement[0].worst->count(), 0.05);
  TileView much = with_moved_tag(three, 1, 0.25, 0);
  const TileView far[] = {much};
  const auto refused = register_scan(far, Face::kShow, known, cell.model);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr("too few are seen to tell which one has moved"));
}

TEST(Registration, TiesTheBackToTheShowFaceByItsHoles) {
  const Cell& cell = warped_cell();
  const TileView show[] = {cell.scan(Face::kShow, cell.whole(Face::kShow))};
  const auto known = register_first_scan(show, cell.model);
  ASSERT_TRUE(known.ok()) << known.error().message;
  const auto pose = cell.whole(Face::kBack, 181);
  const TileView back[] = {cell.scan(Face::kBack, pose)};
  const auto found = register_scan(back, Face::kBack, known->fiducials, cell.model);
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_LT(found->rms->count(), 0.05);
  EXPECT_EQ(found->tiles[0].panel_from_glass().handedness(), Handedness::kImproper);
  EXPECT_EQ(found->fiducials.tags.size(), 10U);
  // Both faces agree: after the best isometry on the show face's tags, the back's tags are where they are.
  std::vector<Point<PanelFrame>> is, seems;
  double worst = 0;
  for (const auto& tag : cell.panel.tags)
    for (std::size_t i = 0; tag.face == Face::kShow && i < 4; ++i)
      is.push_back(tag.corners()[i]), seems.push_back(found->fiducials.tag(tag.id)->corners[i]);
  const auto true_from_found = calib::fit_isometry<PanelFrame, PanelFrame>(is, seems);
  for (const auto& tag : cell.panel.tags)
    for (std::size_t i = 0; tag.face == Face::kBack && i < 4; ++i)
      worst = std::max(worst,
                       distance(true_from_found * found->fiducials.tag(tag.id)->corners[i], tag.corners()[i]).count());
  EXPECT_LT(worst, 0.08);
  // A second look at the back fits its frozen tags.
  const TileView again[] = {cell.scan(Face::kBack, cell.whole(Face::kBack, 2))};
  const auto second = register_scan(again, Face::kBack, found->fiducials, cell.model);
  ASSERT_TRUE(second.ok()) << second.error().message;
  EXPECT_EQ(second->fiducials.tags.size(), 10U);
}

// The second trap: a panel whose tags were printed turned by 180 degrees is self-consistent, and so is its map. But it
// is not what the frozen fiducials say.
TEST(Registration, RefusesTagsTurnedByHalfAgainstTheFrozenOnes) {
  Cell cell;
  const PanelFiducials known = plain_fiducials();
  for (auto& tag : cell.panel.tags) tag.upside_down = true;
  const TileView turned[] = {cell.scan(Face::kShow, cell.whole(Face::kShow))};
  const auto found = register_scan(turned, Face::kShow, known, cell.model);
  ASSERT_FALSE(found.ok());
  EXPECT_EQ(found.error().code, ErrorCode::kRefused);
}

// The first trap: tags and holes counted by two conventions, half a pixel apart, disagree across a half turn.
TEST(Registration, SeesHalfAPixelOfOffset) {
  const Cell& cell = plain_cell();
  const PanelFiducials known = plain_fiducials();
  TileView shifted = cell.scan(Face::kShow, cell.whole(Face::kShow, 179));
  ASSERT_TRUE(register_scan(std::span(&shifted, 1), Face::kShow, known, cell.model).ok());
  for (auto& hole : shifted.holes) hole.centre.x += Pixels(0.5), hole.centre.y += Pixels(0.5);
  const auto found = register_scan(std::span(&shifted, 1), Face::kShow, known, cell.model);
  ASSERT_FALSE(found.ok());
  EXPECT_EQ(found.error().code, ErrorCode::kRefused);
}

// The third trap: the back must be mirrored, and that is measured.
TEST(Registration, RefusesTheWrongFace) {
  const Cell& cell = plain_cell();
  const TileView show[] = {plain_show()};
  const PanelFiducials known = plain_fiducials();
  const auto wrong = register_scan(show, Face::kBack, known, cell.model);
  ASSERT_FALSE(wrong.ok());
  EXPECT_THAT(wrong.error().message, ::testing::HasSubstr("show face lies on the glass"));

  // A "back" whose holes lie as on the show face is no back.
  TileView fake = show[0];
  for (auto& tag : fake.tags) tag.id += 20;
  const auto unmirrored = register_scan(std::span(&fake, 1), Face::kBack, known, cell.model);
  ASSERT_FALSE(unmirrored.ok());
  EXPECT_THAT(unmirrored.error().message, ::testing::HasSubstr("not mirrored"));
}

TEST(Registration, RefusesSymmetricHolesAndTooFew) {
  Cell cell;
  cell.panel.holes = {{40, 7}, {110, 7}, {40, 103}, {110, 103}};
  const TileView show[] = {cell.scan(Face::kShow, cell.whole(Face::kShow))};
  const auto known = register_first_scan(show, cell.model);
  ASSERT_TRUE(known.ok());
  const TileView back[] = {cell.scan(Face::kBack, cell.whole(Face::kBack))};
  const auto symmetric = register_scan(back, Face::kBack, known->fiducials, cell.model);
  ASSERT_FALSE(symmetric.ok());
  EXPECT_THAT(symmetric.error().message, ::testing::HasSubstr("symmetry"));
  PanelFiducials few = known->fiducials;
  few.holes.resize(2);
  const auto starved = register_scan(back, Face::kBack, few, cell.model);
  ASSERT_FALSE(starved.ok());
  EXPECT_THAT(starved.error().message, ::testing::HasSubstr("fewer than 3"));
}

TileView with_spoiled_tag(TileView view, std::size_t which) {
  auto& corners = view.tags.at(which).corners;
  const Point<ScanFrame> centre = view.tags[which].centre;
  for (auto& corner : corners)
    corner = {centre.x + (corner.x - centre.x) * 1.012, centre.y + (corner.y - centre.y) * 1.012};
  return view;
}

// A stain on its rim: the others are as good as before.
TEST(Registration, ATagThatMeasuresOtherwiseThanItsNeighboursIsLeftOutAndNamed) {
  const Cell& cell = plain_cell();
  const TileView spoiled = with_spoiled_tag(plain_show(), 1);
  const int id = spoiled.tags[1].id;
  const auto has = [&](const PanelFiducials& fiducials) {
    return std::ranges::any_of(fiducials.tags, [&](const auto& tag) { return tag.id == id; });
  };
  const auto first = register_first_scan(std::span(&spoiled, 1), cell.model);
  ASSERT_TRUE(first.ok()) << first.error().message;
  ASSERT_EQ(first->spoiled.size(), 1U);
  EXPECT_EQ(first->spoiled[0].tag.id, id);
  EXPECT_NEAR(first->spoiled[0].side.count(), 14 * 1.012, 0.01);
  EXPECT_FALSE(has(first->fiducials));
  const auto whole = register_first_scan(std::span(&plain_show(), 1), cell.model);
  ASSERT_TRUE(whole.ok());
  const auto* there = whole->fiducials.tag(id);
  ASSERT_NE(there, nullptr);
  EXPECT_LT(distance(first->spoiled[0].tag.corners[0], there->corners[0]).count(), 0.2) << "no wood";

  ASSERT_TRUE(has(plain_fiducials()));
  const auto later = register_scan(std::span(&spoiled, 1), Face::kShow, plain_fiducials(), cell.model);
  ASSERT_TRUE(later.ok()) << later.error().message;
  ASSERT_EQ(later->spoiled.size(), 1U);
  EXPECT_TRUE(has(later->fiducials)) << "it stays the panel's";
  EXPECT_LT(later->max->count(), 0.02);

  TileView three = plain_show();
  three.tags.resize(3);
  const TileView too_few = with_spoiled_tag(three, 2);
  const auto refused = register_first_scan(std::span(&too_few, 1), cell.model);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr("without it 2 of at least 3 tags are left"));
}

TEST(Registration, NamesWhatIsWrongInOneSentence) {
  const Cell& cell = plain_cell();
  const TileView& good = plain_show();
  const PanelFiducials known = plain_fiducials();

  TileView bare = good;
  bare.tags.clear();
  auto answer = register_first_scan(std::span(&bare, 1), cell.model);
  ASSERT_FALSE(answer.ok());
  EXPECT_EQ(answer.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(answer.error().message, ::testing::HasSubstr("no fiducials found on scan 7"));

  TileView few = good;
  few.tags.resize(2);
  answer = register_first_scan(std::span(&few, 1), cell.model);
  ASSERT_FALSE(answer.ok());
  EXPECT_THAT(answer.error().message, ::testing::HasSubstr("2 of at least 3 tags"));

  RegistrationOptions options;
  options.foreign_tags = {203};
  answer = register_first_scan(std::span(&good, 1), cell.model, options);
  ASSERT_FALSE(answer.ok());
  EXPECT_THAT(answer.error().message, ::testing::HasSubstr("tag 203 on scan 7 belongs to another sheet"));

  TileView stranger = good;
  for (auto& tag : stranger.tags) tag.id += 100;
  answer = register_scan(std::span(&stranger, 1), Face::kShow, known, cell.model);
  ASSERT_FALSE(answer.ok());
  EXPECT_THAT(answer.error().message, ::testing::HasSubstr("another panel lies on the glass"));

  stranger = good;
  stranger.tags.back().id = 300;
  answer = register_scan(std::span(&stranger, 1), Face::kShow, known, cell.model);
  ASSERT_FALSE(answer.ok());
  EXPECT_THAT(answer.error().message, ::testing::HasSubstr("tag 300 does not belong"));

  TileView stretched = good;
  stretched.nominal = ScanResolution::from_dpi(290);
  answer = register_first_scan(std::span(&stretched, 1), cell.model);
  ASSERT_FALSE(answer.ok());
  EXPECT_THAT(answer.error().message, ::testing::HasSubstr("instead of 14.00"));

  TileView warped = good;  // everything moved, as no glue does
  for (auto& tag : warped.tags)
    for (auto& corner : tag.corners) corner.x = corner.x * 1.003;
  warped.holes.clear();
  answer = register_scan(std::span(&warped, 1), Face::kShow, known, cell.model);
  ASSERT_FALSE(answer.ok());
  EXPECT_THAT(answer.error().message, ::testing::HasSubstr("calibrate the scanner"));

  TileView apart = good;
  apart.name = "scan 8";
  for (auto& tag : apart.tags) tag.id += 100;
  const TileView tiles[] = {good, apart};
  answer = register_first_scan(tiles, cell.model);
  ASSERT_FALSE(answer.ok());
  EXPECT_THAT(answer.error().message, ::testing::HasSubstr("scan 8 shares no tag"));
}

TEST(ScanMap, UndoesItself) {
  const Cell& cell = warped_cell();
  const auto pose = cell.whole(Face::kBack);
  const calib::ScanMap map(pose.inverse(), cell.model, cell.scanner.nominal());
  for (double x = 3; x < 2000; x += 311)
    for (double y = 3; y < 1500; y += 217) {
      const Point<ScanFrame> p = point<ScanFrame>(x, y);
      EXPECT_LT(distance(map.inverse(map * p), p).count(), 1e-6);
    }
}

}  // namespace
}  // namespace veneer
