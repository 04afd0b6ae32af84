#include "tests/support/played_sight.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "calib/bed_pose.h"
#include "calib/camera_fit.h"
#include "calib/machine_axes.h"
#include "calib/point_fit.h"
#include "drivers/sim/carriage.h"
#include "drivers/sim/cell_truth.h"
#include "drivers/sim/panel_layout.h"
#include "drivers/sim/placing.h"
#include "planner/cutting/calibration_pattern.h"

namespace veneer::tests {
namespace {

using sim::Vec2;

constexpr double kCornerNoisePx = 0.05, kRingNoisePx = 0.03;
constexpr double kUsualThickness = 2.1;
constexpr double kBoardWidth = 490, kBoardHeight = 290;

struct Played {
  sim::CellTruth truth;
  Vec2 stretch;  // of the AprilGrid sheet
  sim::Random noise;

  Played(std::uint64_t seed, const sim::Roughness& rough) : noise(seed, "played noise") {
    sim::TwinSettings settings;
    settings.seed = seed, settings.rough = rough;
    truth = sim::draw_cell_truth(settings);
    sim::Random printer(seed, "printer");
    stretch = {1 + printer.spread(rough.grid_print_error), 1 + printer.spread(rough.grid_print_error)};
  }
  std::uint64_t seed() const { return truth.settings.seed; }
  sim::Random stream(const char* what, std::uint64_t index) const { return {seed(), what, index}; }

  Point<CameraFrame> seen(Vec2 bed, double height, double noise_px) {
    const Vec2 px = truth.camera.pixel(bed, height);
    const double y = px.y + noise_px * noise.normal(), x = px.x + noise_px * noise.normal();
    return point<CameraFrame>(x, y);
  }
};

sim::Sheet sheet_of(double width, double height) {
  sim::Sheet sheet;
  sheet.width_mm = width, sheet.height_mm = height;
  return sheet;
}

void warp(sim::Sheet& sheet, const sim::Roughness& rough, sim::Random random) {
  sheet.thickness_mm = kUsualThickness + random.spread(rough.thickness_mm);
  sheet.relief = {random.spread(rough.bow_mm), random.spread(rough.bow_mm / 2)};
}

// How high the upper face lies at a place of the sheet.
double height_at(const sim::Sheet& sheet, Vec2 on_sheet, sim::SheetFace up) {
  return sheet.thickness_mm + sheet.relief.lift(on_sheet.x / sheet.width_mm, on_sheet.y / sheet.height_mm, up);
}

Result<calib::CameraFit> play_camera(Played& cell) {
  constexpr double kEdge = 9;
  constexpr int kViews = 6;
  const calib::AprilGrid grid;
  const sim::Sheet sheet = sheet_of(11 * 24 + 18 + 2 * kEdge, 9 * 24 + 18 + 2 * kEdge);
  std::vector<calib::GridView> views;
  for (int view = 0; view < kViews; ++view) {
    const double height = view % 2 == 0 ? 0 : 12;
    sim::Random hand = cell.stream("played view", static_cast<std::uint64_t>(view));
    const auto pose = sim::lay_on_bed(sheet, sim::SheetFace::kShow, cell.truth.settings.bed, hand);
    if (!pose) return pose.error();
    calib::GridView seen{Millimetres(height), {}};
    for (int id = 0; id < grid.tags(); ++id) {
      calib::Tag<CameraFrame> tag;
      tag.id = id;
      const auto corners = grid.corners(id);
      for (std::size_t i = 0; i < 4; ++i)
        tag.corners[i] = cell.seen(
            pose->place({kEdge + corners[i].x.count() * cell.stretch.x, kEdge + corners[i].y.count() * cell.stretch.y}),
            height, kCornerNoisePx);
      seen.tags.push_back(tag);
    }
    views.push_back(std::move(seen));
  }
  return calib::fit_camera_model(views, cell.truth.camera.width_px, cell.truth.camera.height_px);
}

// The middle of a ring as it is burnt: of the carriage's way around it.
Vec2 burnt_ring(sim::Carriage& carriage, const sim::MachineAxes& axes, Vec2& head, const PatternRing& ring) {
  constexpr int kSides = 48;
  const Vec2 centre{ring.centre.x.count(), ring.centre.y.count()};
  const double r = ring.diameter.count() / 2;
  Vec2 sum;
  for (int i = 0; i <= kSides; ++i) {
    const double a = 2 * kPi * i / kSides;
    const Vec2 to = centre + Vec2{r * std::cos(a), r * std::sin(a)};
    const Vec2 bed = carriage.follow(axes, head, to).back().bed;
    head = to;
    if (i > 0) sum = sum + bed;
  }
  return sum * (1.0 / kSides);
}

struct KnownCamera {
  calib::CameraModel model;
  Millimetres off{0};  // as its certificate says
};

// The twin's camera as it truly is, in calib's words.
KnownCamera exact_camera(const sim::CameraTruth& truth) {
  calib::CameraParameters p;
  p.width_px = truth.width_px, p.height_px = truth.height_px;
  p.fx = truth.fx, p.fy = truth.fy, p.cx = truth.cx, p.cy = truth.cy;
  p.k1 = truth.k1, p.k2 = truth.k2, p.p1 = truth.p1, p.p2 = truth.p2;
  const Eigen::Matrix3d rotation =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(truth.rotation.data());
  const Eigen::AngleAxisd turn(rotation);
  const Eigen::Vector3d w = turn.axis() * turn.angle();
  const Eigen::Vector3d t = -(rotation * Eigen::Vector3d(truth.position[0], truth.position[1], truth.position[2]));
  p.camera_from_bed_rotation = {w.x(), w.y(), w.z()}, p.camera_from_bed_translation = {t.x(), t.y(), t.z()};
  return {calib::CameraModel(p)};
}

Result<calib::MachineAxes> play_axes(Played& cell, const KnownCamera& camera, const PlayedHands& hands,
                                     RingSpacing spacing, SightFigures& figures) {
  const calib::CameraModel& provisional = camera.model;
  const auto& bed = cell.truth.settings.bed;
  sim::Sheet board = sheet_of(kBoardWidth, kBoardHeight);
  warp(board, cell.truth.settings.rough, cell.stream("played board", 0));
  figures.board_thickness_mm = board.thickness_mm;
  figures.board_bow_x_mm = board.relief.bow_x_mm, figures.board_bow_y_mm = board.relief.bow_y_mm;
  sim::Random hand = cell.stream("played laying", 0);
  const auto pose = sim::lay_on_bed(board, sim::SheetFace::kShow, bed, hand);
  if (!pose) return pose.error();

  PatternLayout layout{{}, spacing};
  const double half_w = kBoardWidth / 2 - 25 - kBoardHeight * 0.035,
               half_h = kBoardHeight / 2 - 25 - kBoardWidth * 0.035;
  layout.area.add(point<MachineFrame>(bed.width_mm / 2 - half_w, bed.height_mm / 2 - half_h));
  layout.area.add(point<MachineFrame>(bed.width_mm / 2 + half_w, bed.height_mm / 2 + half_h));
  const auto pattern = planner::make_pattern(layout);
  if (!pattern) return pattern.error();

  sim::Carriage carriage(cell.truth.settings.rough, cell.seed());
  carriage.homed(1);
  Vec2 head{bed.width_mm, bed.height_mm};
  const double told = hands.measures_board ? board.thickness_mm + hand.spread(hands.caliper_mm) : kUsualThickness;
  std::vector<calib::FoundRing> rings;
  for (std::size_t i = 0; i < pattern->rings.size(); ++i) {
    const PatternRing& ring = pattern->rings[i];
    const Vec2 at = burnt_ring(carriage, cell.truth.axes, head, ring);
    const auto px = cell.seen(at, height_at(board, pose->back_to_sheet(at), sim::SheetFace::kShow), kRingNoisePx);
    rings.push_back({i, ring.centre, provisional.bed_from_camera(px, Millimetres(told)), ring.diameter, {}});
  }
  return calib::fit_machine_axes(rings, provisional, Millimetres(told), camera.off);
}

// A panel as its scans say it is: true but for the sheet they were measured by.
struct PlayedPanel {
  sim::Sheet sheet;
  calib::PanelCandidate known;
  std::vector<std::pair<int, std::array<Vec2, 4>>> back_tags;

  PlayedPanel(const Played& cell, double width, double height, std::uint64_t number) : sheet(sheet_of(width, height)) {
    warp(sheet, cell.truth.settings.rough, cell.stream("played panel", number));
    const auto layout = sim::draw_layout(width, height, 0, cell.stream("played layout", number).next());
    known.panel = PanelId{"P-0001"};
    int id = 200;
    for (const sim::TagPlace& place : layout.tags) {
      if (place.face != sim::SheetFace::kBack) continue;
      std::array<Vec2, 4> corners;
      const double h = place.square_mm / 2, c = std::cos(place.angle_rad), s = std::sin(place.angle_rad);
      const std::array<Vec2, 4> own = {Vec2{-h, -h}, Vec2{h, -h}, Vec2{h, h}, Vec2{-h, h}};
      calib::PanelTag tag{id, Face::kBack, {}};
      for (std::size_t i = 0; i < 4; ++i) {
        corners[i] = place.centre + Vec2{-(c * own[i].x - s * own[i].y), s * own[i].x + c * own[i].y};
        tag.corners[i] = point<PanelFrame>(corners[i].x / cell.stretch.x, corners[i].y / cell.stretch.y);
      }
      back_tags.emplace_back(id++, corners);
      known.fiducials.tags.push_back(tag);
    }
  }
  // panel_from_sheet as the proof ties it: by the tags, without stretching anything.
  Isometry2<PanelFrame, SheetFrame> tie() const {
    std::vector<Point<PanelFrame>> to;
    std::vector<Point<SheetFrame>> from;
    for (std::size_t t = 0; t < back_tags.size(); ++t)
      for (std::size_t i = 0; i < 4; ++i) {
        to.push_back(known.fiducials.tags[t].corners[i]);
        from.push_back(point<SheetFrame>(back_tags[t].second[i].x, back_tags[t].second[i].y));
      }
    return calib::fit_isometry<PanelFrame, SheetFrame>(to, from);
  }
};

template <class Visit>
void over_grid(const sim::Sheet& sheet, Visit visit) {
  for (double y = 5; y < sheet.height_mm; y += 10)
    for (double x = 5; x < sheet.width_mm; x += 10) visit(Vec2{x, y});
}

struct Rms {
  double sum = 0;
  int count = 0;
  void add(double d) { sum += d * d, ++count; }
  double value() const { return count == 0 ? 0 : std::sqrt(sum / count); }
};

Status play_look(Played& cell, const calib::MachineAxes& axes, std::uint64_t number, double width, double height,
                 Rms& frame, SightFigures& figures) {
  const PlayedPanel panel(cell, width, height, number);
  sim::Random hand = cell.stream("played look", number);
  const auto lies = sim::lay_on_bed(panel.sheet, sim::SheetFace::kBack, cell.truth.settings.bed, hand);
  if (!lies) return lies.error();
  std::vector<calib::Tag<CameraFrame>> seen;
  for (const auto& [id, corners] : panel.back_tags) {
    calib::Tag<CameraFrame> tag;
    tag.id = id;
    for (std::size_t i = 0; i < 4; ++i)
      tag.corners[i] =
          cell.seen(lies->place(corners[i]), height_at(panel.sheet, corners[i], sim::SheetFace::kBack), kCornerNoisePx);
    seen.push_back(tag);
  }
  const std::vector<calib::PanelCandidate> candidates = {panel.known};
  const auto pose = calib::locate_panel(seen, axes.model, Millimetres(kUsualThickness), candidates);
  if (!pose) return pose.error();
  const auto panel_from_sheet = panel.tie();
  sim::Carriage carriage(cell.truth.settings.rough, cell.seed());
  carriage.homed(2 + static_cast<int>(number));
  Rms off, cut;
  over_grid(panel.sheet, [&](Vec2 at) {
    const Vec2 truly = lies->place(at);
    const auto said = pose->bed_from_panel * (panel_from_sheet * point<SheetFrame>(at.x, at.y));
    off.add(std::hypot(said.x.count() - truly.x, said.y.count() - truly.y));
    // The scans see all of the panel in the sheet's millimetres.
    const auto to = axes.machine_from_bed *
                    (pose->bed_from_panel * point<PanelFrame>(at.x / cell.stretch.x, at.y / cell.stretch.y));
    const Vec2 goal{to.x.count(), to.y.count()};
    const Vec2 goes = carriage.follow(cell.truth.axes, goal, goal).back().bed;
    cut.add(sim::length(goes - truly));
    const Vec2 px = cell.truth.camera.pixel(truly, kUsualThickness);
    const auto flat = axes.model.bed_from_camera(point<CameraFrame>(px.x, px.y), Millimetres(kUsualThickness));
    frame.add(std::hypot(flat.x.count() - truly.x, flat.y.count() - truly.y));
  });
  figures.pose_rms_mm = std::max(figures.pose_rms_mm, off.value());
  figures.cut_rms_mm = std::max(figures.cut_rms_mm, cut.value());
  return Ok();
}

}  // namespace

Result<SightFigures> play_sight(std::uint64_t seed, const sim::Roughness& rough, const PlayedHands& hands) {
  Played cell(seed, rough);
  SightFigures figures;
  const auto camera = play_camera(cell);
  if (!camera) return camera.error();
  const auto axes = play_axes(cell, {camera->model, camera->leave_out_rms}, hands, RingSpacing::kUneven, figures);
  if (!axes) return axes.error();
  figures.axes_rms_mm = axes->rms.count();
  Rms frame;
  for (std::uint64_t i = 0; i < 4; ++i) {
    const bool large = i % 2 == 0;
    if (const Status looked = play_look(cell, *axes, i, large ? 420 : 290, large ? 280 : 210, frame, figures); !looked)
      return looked.error();
  }
  figures.frame_rms_mm = frame.value();
  return figures;
}

double PredictedFigures::true_mm() const { return std::sqrt(squares_sum / places); }

Result<AxesFigures> play_axes_certificate(std::uint64_t seed, const sim::Roughness& rough, RingSpacing spacing) {
  Played cell(seed, rough);
  SightFigures ignored;
  const auto axes = play_axes(cell, exact_camera(cell.truth.camera), {}, spacing, ignored);
  if (!axes) return axes.error();
  AxesFigures out;
  out.said_mm = axes->leave_out_rms.count();
  sim::Carriage carriage(rough, seed);
  carriage.homed(1);
  const auto bed_from_machine = axes->machine_from_bed.inverse();
  const auto& bed = cell.truth.settings.bed;
  const Box<MachineFrame> reach{{}, point<MachineFrame>(bed.width_mm, bed.height_mm)};
  const auto predicted = calib::predict_axes_error(*axes, reach);
  if (!predicted) return Error{ErrorCode::kInternal, "nothing is predicted"};
  Rms off;
  for (double y = 0; y <= bed.height_mm; y += 7)
    for (double x = 0; x <= bed.width_mm; x += 7) {
      const Vec2 goes = carriage.follow(cell.truth.axes, {x, y}, {x, y}).back().bed;
      const Vec2 px = cell.truth.camera.pixel(goes, kUsualThickness);
      const auto seen = axes->model.bed_from_camera(point<CameraFrame>(px.x, px.y), Millimetres(kUsualThickness));
      const double d = distance(seen, bed_from_machine * point<MachineFrame>(x, y)).count();
      off.add(d);
      ++out.places, out.within_two_sigma += d <= 2 * out.said_mm ? 1 : 0;
      const auto there = calib::predicted_error(*predicted, seen.x.count(), seen.y.count());
      if (!there) continue;
      (there->to_measured.count() <= predicted->near_mm ? out.measured : out.beyond)
          .add(d, there->sigma.count(), axes->rms.count());
    }
  out.true_mm = off.value();
  return out;
}

}  // namespace veneer::tests
