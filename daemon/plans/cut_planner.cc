#include "daemon/plans/cut_planner.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/asio/post.hpp>
#include <cmath>
#include <map>

#include "base/clock.h"
#include "daemon/orders/toolpath_work.h"
#include "daemon/orders/wood_recipes.h"
#include "daemon/stock/panel_library.h"
#include "daemon/stock/panel_thickness.h"
#include "daemon/store/calibration.h"
#include "daemon/unit/preflight.h"
#include "daemon/unit/setups.h"

namespace veneer::daemon {
namespace {

// Where the middle of a beam may be that burns nothing beside what is booked, but for what the steps of a flattened
// curve and rounding may make of that.
Region<PanelFrame> for_beam(const Region<PanelFrame>& booked, const planner::Recipe& recipe) {
  constexpr Millimetres kSlack{0.05};
  return offset(booked, -std::max(Millimetres(0), recipe.widest_kerf() / 2 - kSlack));
}

std::vector<Point<MachineFrame>> corners(const Box<MachineFrame>& box) {
  return {box.min, {box.max.x, box.min.y}, box.max, {box.min.x, box.max.y}};
}

// The upright box inside a quadrangle that is nearly one.
Box<BedFrame> inner_box(const std::vector<Point<BedFrame>>& quadrangle) {
  std::array<Millimetres, 4> x{}, y{};
  for (std::size_t i = 0; i < 4; ++i) x[i] = quadrangle[i].x, y[i] = quadrangle[i].y;
  std::sort(x.begin(), x.end());
  std::sort(y.begin(), y.end());
  return {{x[1], y[1]}, {x[2], y[2]}};
}

Box<BedFrame> view_of(const calib::CameraModel& camera, Millimetres height) {
  const double w = camera.parameters().width_px, h = camera.parameters().height_px;
  std::vector<Point<BedFrame>> seen;
  for (const auto& [u, v] : {std::pair(0.0, 0.0), std::pair(w, 0.0), std::pair(w, h), std::pair(0.0, h)})
    seen.push_back(camera.bed_from_camera(point<CameraFrame>(u, v), height));
  return inner_box(seen);
}

// Fractions of the picture, to a tenth of a pixel of the pictures people see.
std::array<double, 2> in_picture(const calib::CameraModel& camera, const Point<BedFrame>& place, Millimetres height) {
  const auto seen = camera.camera_from_bed(place, height);
  const auto round = [](double v) { return std::round(v * 1e4) / 1e4; };
  return {round(seen.x.count() / camera.parameters().width_px), round(seen.y.count() / camera.parameters().height_px)};
}

// Where the picture shows a place of the machine: nodes of a grid over all that the camera sees, row by row from the
// lower left. Between them it is as good as straight.
nlohmann::json machine_grid(const BedCalibration& bed, Millimetres height) {
  constexpr int kNodes = 13;
  const auto bed_from_machine = bed.machine_from_bed.inverse();
  const Box<BedFrame> view = view_of(bed.camera, height);
  const auto seen = bed.machine_from_bed * std::vector<Point<BedFrame>>{
                                               view.min, {view.max.x, view.min.y}, view.max, {view.min.x, view.max.y}};
  const Box<MachineFrame> box = bounds(seen);
  nlohmann::json points = nlohmann::json::array();
  for (int row = 0; row < kNodes; ++row)
    for (int column = 0; column < kNodes; ++column) {
      const auto part = [](Millimetres low, Millimetres high, int node) {
        return low + (high - low) * (static_cast<double>(node) / (kNodes - 1));
      };
      const Point<MachineFrame> node{part(box.min.x, box.max.x, column), part(box.min.y, box.max.y, row)};
      points.push_back(in_picture(bed.camera, bed_from_machine * node, height));
    }
  return {{"min_mm", {box.min.x.count(), box.min.y.count()}},
          {"max_mm", {box.max.x.count(), box.max.y.count()}},
          {"columns", kNodes},
          {"rows", kNodes},
          {"points", std::move(points)}};
}

// The panel, what is booked for those of the pieces that lie on it, and its back tags that no cut has touched.
Result<SetupInput> setup_input(Repositories& r, const PanelId& id, const std::vector<db::PieceRecord>& pieces) {
  SetupInput input;
  input.panel = id;
  auto panel = r.panels.find(id);
  if (!panel) return panel.error();
  input.width = panel->width, input.height = panel->height;
  auto live = r.ledger.live_allocations(id);
  if (!live) return live.error();
  std::vector<Region<PanelFrame>> gone;
  for (const auto& allocation : *live)
    if (allocation.state != db::AllocationState::kReserved && allocation.state != db::AllocationState::kLeased)
      gone.push_back(allocation.area);
  for (const auto& piece : pieces)
    for (const auto& allocation : *live)
      if (allocation.id == piece.allocation && !allocation.area.empty())
        input.pieces.push_back({piece.id, allocation.area.rings().front()});
  auto fiducials = r.panels.fiducials(id);
  if (!fiducials) return fiducials.error();
  for (const auto& tag : to_calib(*fiducials).tags) {
    if (tag.face != Face::kBack) continue;
    const Ring<PanelFrame> square(tag.corners.begin(), tag.corners.end());
    const Region<PanelFrame> area(square);
    if (std::none_of(gone.begin(), gone.end(), [&](const auto& cut) { return overlaps(cut, area); }))
      input.fiducials.push_back(square);
  }
  return input;
}

// Where the artwork's up points on the bed: through panel_from_artwork and the (improper) pose.
Radians artwork_up(const ProvenPose& pose, const db::PieceRecord& piece) {
  const auto bed_from_artwork = pose.bed_from_panel * piece.panel_from_artwork;
  const auto from = bed_from_artwork * Point<ArtworkFrame>{}, to = bed_from_artwork * point<ArtworkFrame>(0, 1);
  return Radians(std::atan2((to.y - from.y).count(), (to.x - from.x).count()));
}

// For whoever asks later how a piece was made: docs/openapi.json, PiecePassport, has the same words.
db::RunFacts facts_of(const Calibration& calibration, const WoodRecipes& recipes,
                      const std::map<std::string, std::vector<std::string>>& in_wood) {
  db::RunFacts facts;
  for (const auto kind : {db::CertificateKind::kCamera, db::CertificateKind::kAxes, db::CertificateKind::kKerf})
    if (const auto standing = calibration.standing.find(kind); standing != calibration.standing.end())
      if (standing->second.certificate.value != 0) facts.certificates.push_back(standing->second.certificate);
  auto burnt = nlohmann::json::array();
  for (const auto& [material, marks] : in_wood) {
    const planner::Recipe recipe = recipes.recipe_of(material);
    burnt.push_back({{"material", material.empty() ? nlohmann::json() : nlohmann::json(material)},
                     {"pieces", marks},
                     {"cut",
                      {{"speed_mm_s", recipe.cut_speed.count()},
                       {"power", recipe.cut_power.count()},
                       {"passes", recipe.cut_passes},
                       {"air", recipe.air},
                       {"kerf_back_mm", recipe.kerf_back.count()},
                       {"kerf_show_mm", recipe.kerf_show.count()}}},
                     {"engrave",
                      {{"speed_mm_s", recipe.engrave_speed.count()},
                       {"power", recipe.engrave_power.count()},
                       {"passes", recipe.engrave_passes},
                       {"air", recipe.engrave_air}}}});
  }
  facts.recipes_json = burnt.dump();
  return facts;
}

}  // namespace

CutPlanner::CutPlanner(boost::asio::io_context& reactor, Worker& worker, WorkRunner& workers, DatabaseThread& database,
                       const Config& config, Logger log)
    : reactor_(reactor),
      worker_(worker),
      workers_(workers),
      database_(database),
      config_(config),
      log_(std::move(log)) {}

std::string CutPlanner::toolpath() const {
  const std::lock_guard lock(mutex_);
  return toolpath_;
}

void CutPlanner::prepare(const ProvenPose& pose, std::vector<db::PieceRecord> pieces,
                         const std::optional<LaserMotion>& machine, std::function<void(Result<PreparedRun>)> reply) {
  worker_.post([this, pose, machine, pieces = std::move(pieces), reply = std::move(reply)]() mutable {
    auto run = caught([&] { return prepare_now(pose, pieces, machine); });
    boost::asio::post(reactor_, [run = std::move(run), reply = std::move(reply)]() mutable { reply(std::move(run)); });
  });
}

void CutPlanner::plan_setups(std::vector<db::PieceRecord> pieces, Box<MachineFrame> travel,
                             std::function<void(Result<std::vector<RunSetup>>)> reply) {
  worker_.post([this, travel, pieces = std::move(pieces), reply = std::move(reply)]() mutable {
    auto setups = caught([&] { return plan_setups_now(pieces, travel); });
    boost::asio::post(reactor_,
                      [setups = std::move(setups), reply = std::move(reply)]() mutable { reply(std::move(setups)); });
  });
}

Result<std::vector<RunSetup>> CutPlanner::plan_setups_now(const std::vector<db::PieceRecord>& pieces,
                                                          const Box<MachineFrame>& travel) {
  struct Stock {
    Calibration calibration;
    struct OnBed {
      SetupInput input;
      Millimetres thickness;
    };
    std::map<PanelId, OnBed> panels;
  };
  auto stock = database_.call([&](Repositories& r) -> Result<Stock> {
    Stock out;
    auto calibration = load_calibration(r, utc_timestamp());
    if (!calibration) return calibration.error();
    out.calibration = std::move(*calibration);
    for (const auto& piece : pieces) {
      if (out.panels.contains(*piece.panel)) continue;
      auto input = setup_input(r, *piece.panel, pieces);
      if (!input) return input.error();
      const auto thickness = thickness_of(r, *piece.panel, config_.panel.thickness);
      if (!thickness) return thickness.error();
      out.panels[*piece.panel] = {std::move(*input), *thickness};
    }
    return out;
  });
  if (!stock) return stock.error();
  if (const Status ready = require_cutting(stock->calibration); !ready) return ready.error();
  const BedCalibration& bed = *stock->calibration.bed;
  std::vector<RunSetup> out;
  for (auto& [panel, on_bed] : stock->panels) {
    auto& [input, thickness] = on_bed;
    input.reach = inner_box(bed.machine_from_bed.inverse() * corners(travel));
    input.view = view_of(bed.camera, thickness);
    auto setups = daemon::plan_setups(input);
    if (!setups) return setups.error();
    for (std::size_t i = 0; i < setups->size(); ++i) {
      RunSetup& setup = out.emplace_back();
      setup.panel = panel;
      setup.pieces = std::move((*setups)[i].pieces);
      setup.how = std::move((*setups)[i].how);
      setup.number = static_cast<int>(i) + 1;
      setup.of = static_cast<int>(setups->size());
      if (setup.how.empty()) continue;
      const Millimetres zero;
      const Ring<PanelFrame> sheet{
          {zero, zero}, {input.width, zero}, {input.width, input.height}, {zero, input.height}};
      for (const auto& p : (*setups)[i].bed_from_panel* sheet)
        setup.outline.push_back(in_picture(bed.camera, p, thickness));
    }
  }
  return out;
}

Result<PreparedRun> CutPlanner::prepare_now(const ProvenPose& pose, const std::vector<db::PieceRecord>& pieces,
                                            const std::optional<LaserMotion>& machine) {
  struct Stock {
    Calibration calibration;
    std::optional<WoodRecipes> recipes;
    std::vector<db::AllocationRecord> live;
    Millimetres thickness;
  };
  auto stock = database_.call([&](Repositories& r) -> Result<Stock> {
    Stock out;
    auto calibration = load_calibration(r, utc_timestamp());
    if (!calibration) return calibration.error();
    out.calibration = std::move(*calibration);
    if (const Status ready = require_cutting(out.calibration); !ready) return ready.error();
    auto recipes = WoodRecipes::read(r, config_.recipe, *out.calibration.kerf, pose.panel);
    if (!recipes) return recipes.error();
    out.recipes = std::move(*recipes);
    auto live = r.ledger.live_allocations(pose.panel);
    if (!live) return live.error();
    out.live = std::move(*live);
    const auto thickness = thickness_of(r, pose.panel, config_.panel.thickness);
    if (!thickness) return thickness.error();
    out.thickness = *thickness;
    return out;
  });
  if (!stock) return stock.error();
  const auto* calibration = &stock->calibration;
  const auto& machine_from_bed = calibration->bed->machine_from_bed;

  LayToolpath order;
  order.options = toolpath_options(config_.recipe);
  order.options.kinematics = kinematics_of(machine);
  std::map<PieceId, std::string> marks;
  std::map<PieceId, Region<PanelFrame>> booked;             // where its beam's middle may be
  std::map<std::string, std::vector<std::string>> in_wood;  // marks, by material
  for (const auto& piece : pieces) {
    planner::ToolpathPiece& p = order.pieces.emplace_back();
    p.piece = piece.id;
    p.outline = pose.bed_from_panel * piece.panel_outline;
    p.mark = piece.mark;
    p.artwork_up = artwork_up(pose, piece);
    const std::string material = stock->recipes->material_at(piece.panel_outline);
    p.recipe = stock->recipes->recipe_of(material);
    auto leads = leads_on_bed(piece, *p.recipe, order.options.fit_clearance, pose.bed_from_panel);
    if (!leads) return leads.error();
    p.leads = std::move(*leads);
    const auto wood = std::ranges::find(stock->live, piece.allocation, [](const auto& row) { return row.id; });
    if (wood == stock->live.end())
      return Error{ErrorCode::kConflict,
                   fmt::format("no wood is booked for piece {} any more: start the job again", piece.mark)};
    if (const Status fits = check_booked(piece, material, *p.recipe, order.options.fit_clearance, wood->area); !fits)
      return fits.error();
    booked[piece.id] = for_beam(wood->area, *p.recipe);
    marks[piece.id] = piece.mark;
    in_wood[material].push_back(piece.mark);
  }
  const auto path = have_toolpath_laid(workers_, config_.store.data_dir, order, ending_.get_token());
  if (!path) return path.error();
  const auto panel_from_bed = pose.bed_from_panel.inverse();
  for (const auto& stroke : path->strokes)  // of a piece that was not asked for, too: it has no wood
    if (!booked[stroke.piece].contains(panel_from_bed * stroke.path))
      return Error{ErrorCode::kInternal,
                   fmt::format("the beam's way around piece {} leaves the wood that is booked for it: start the job "
                               "again, and report it when it comes back",
                               marks[stroke.piece])};
  for (const auto& warning : path->warnings) log_->warn("{}", warning);

  nlohmann::json drawn = nlohmann::json::array();
  std::vector<PieceBurn> burns;
  auto stroke = path->strokes.begin();
  for (const auto& summary : path->pieces) {
    PieceBurn& burn = burns.emplace_back(PieceBurn{summary.piece, marks[summary.piece], {}, summary.estimate.count()});
    nlohmann::json lines = nlohmann::json::array();
    for (std::size_t i = 0; i < summary.strokes; ++i, ++stroke) {
      const bool cut = stroke->role == StrokeRole::kCut;
      burn.strokes.strokes.push_back({stroke->piece, stroke->role, machine_from_bed * stroke->path, stroke->speed,
                                      stroke->power, stroke->passes, stroke->air});
      nlohmann::json line = nlohmann::json::array();
      for (const auto& p : stroke->path) line.push_back(in_picture(calibration->bed->camera, p, stock->thickness));
      lines.push_back({{"role", cut ? "cut" : "engrave"}, {"points", std::move(line)}});
    }
    drawn.push_back({{"piece", burn.piece.value}, {"mark", burn.mark}, {"lines", std::move(lines)}});
  }
  keep_toolpath(pose.panel, burns, std::move(drawn), *calibration->bed, stock->thickness);
  return PreparedRun{std::move(burns), facts_of(*calibration, *stock->recipes, in_wood)};
}

// What the console lays over the bed's picture, the frame included.
void CutPlanner::keep_toolpath(const PanelId& panel, const std::vector<PieceBurn>& burns, nlohmann::json pieces,
                               const BedCalibration& bed, Millimetres thickness) {
  nlohmann::json frame = nlohmann::json::array();
  double seconds = 0;
  const auto bed_from_machine = bed.machine_from_bed.inverse();
  for (const auto& stroke : frame_of(burns, config_.framing.speed, PowerFraction(0)).strokes)
    for (const auto& p : stroke.path) frame.push_back(in_picture(bed.camera, bed_from_machine * p, thickness));
  for (std::size_t i = 0; i < burns.size(); ++i) {
    pieces[i]["seconds"] = burns[i].seconds / config_.sim.time_scale;
    seconds += burns[i].seconds / config_.sim.time_scale;
  }
  const nlohmann::json whole{{"schema_version", 1},
                             {"panel", panel.value},
                             {"seconds", seconds},
                             {"frame", std::move(frame)},
                             {"machine", machine_grid(bed, thickness)},
                             {"pieces", std::move(pieces)}};
  auto text = whole.dump();
  const std::lock_guard lock(mutex_);
  toolpath_ = std::move(text);
}

}  // namespace veneer::daemon
