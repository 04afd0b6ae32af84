#include "drivers/sim/world.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

#include "drivers/sim/bridges.h"
#include "drivers/sim/placing.h"
#include "drivers/sim/random.h"
#include "drivers/sim/sheet_maker.h"
#include "drivers/sim/tag_dirt.h"
#include "drivers/sim/truth_files.h"

namespace veneer::sim {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

bool is_name(const std::string& name) {
  return !name.empty() && name.size() <= 64 && name.front() != '.' &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) {
           return (c < 128 && std::isalnum(c) != 0) || c == '-' || c == '_' || c == '.';
         });
}

json to_json(const std::optional<Placement>& placement) {
  if (!placement) return nullptr;
  return {{"sheet", placement->sheet},
          {"face", to_string(placement->face)},
          {"pose", sim::to_json(placement->pose)},
          {"height_mm", placement->height_mm}};
}

std::optional<Placement> placement_from(const json& value) {
  if (value.is_null()) return std::nullopt;
  return Placement{value.at("sheet").get<std::string>(), face_from(value.at("face")), pose_from(value.at("pose")),
                   value.at("height_mm").get<double>()};
}

}  // namespace

World::World(fs::path state_dir, Logger log) : state_dir_(std::move(state_dir)), log_(std::move(log)) {}

World::~World() {
  const std::lock_guard lock(mutex_);
  end_stroke_locked();
}

Result<std::unique_ptr<World>> World::open(const TwinSettings& settings, fs::path state_dir, Logger log) {
  std::unique_ptr<World> world(new World(std::move(state_dir), std::move(log)));
  const fs::path truth = world->state_dir_ / "truth";
  std::error_code failed;
  fs::create_directories(truth / "sheets", failed);
  fs::create_directories(world->state_dir_ / "captures", failed);
  if (failed) {
    return Error{ErrorCode::kStorage, fmt::format("the twin cannot use {} as its state directory: {}",
                                                  world->state_dir_.string(), failed.message())};
  }
  if (fs::exists(truth / "cell.json")) {
    Result<CellTruth> loaded = load_cell_truth(truth / "cell.json");
    if (!loaded.ok()) return loaded.error();
    world->truth_ = *loaded;
    if (loaded->settings.seed != settings.seed) {
      world->log_->warn("{} was begun with seed {}; seed {} of the configuration is not used", truth.string(),
                        loaded->settings.seed, settings.seed);
    }
    if (loaded->settings.rough != settings.rough) {
      world->log_->warn(
          "{} was begun in a workshop of other roughness; preset and [twin.rough] are not used: name "
          "another state directory to use them",
          truth.string());
    }
  } else {
    world->truth_ = draw_cell_truth(settings);
    if (Status s = save_cell_truth(world->truth_, truth / "cell.json"); !s.ok()) return s.error();
  }
  if (Status s = world->load(); !s.ok()) return s.error();
  world->carriage_ = Carriage(world->truth_.settings.rough, world->truth_.settings.seed);
  return world;
}

Status World::load() {
  const fs::path file = state_dir_ / "truth" / "world.json";
  if (!fs::exists(file)) return Ok();
  const Result<json> read = read_json(file);
  if (!read.ok()) return read.error();
  try {
    for (const json& name : read->at("sheets")) {
      Result<std::shared_ptr<Sheet>> sheet = load_sheet(sheet_dir(name.get<std::string>()));
      if (!sheet.ok()) return sheet.error();
      sheets_[name.get<std::string>()] = *sheet;
    }
    on_scanner_ = placement_from(read->at("scanner"));
    on_bed_ = placement_from(read->at("bed"));
    placements_ = read->at("placements").get<int>();
    next_tag_ = read->at("next_tag").get<int>();
    pictures_ = read->at("pictures").get<std::map<std::string, int>>();
    const json& drift = read->at("axis_drift");
    drift_ = {drift.at(0).get<double>(), drift.at(1).get<double>(), 0};
  } catch (const json::exception& e) {
    return Error{ErrorCode::kStorage, fmt::format("{} cannot be read: {}", file.string(), e.what())};
  }
  return Ok();
}

fs::path World::sheet_dir(const std::string& name) const { return state_dir_ / "truth" / "sheets" / name; }

Status World::save_locked() {
  json names = json::array();
  for (const auto& [name, sheet] : sheets_) names.push_back(name);
  return write_json(state_dir_ / "truth" / "world.json", {{"schema_version", 1},
                                                          {"sheets", names},
                                                          {"scanner", to_json(on_scanner_)},
                                                          {"bed", to_json(on_bed_)},
                                                          {"placements", placements_},
                                                          {"next_tag", next_tag_},
                                                          {"pictures", pictures_},
                                                          {"axis_drift", {drift_.x_scale, drift_.y_scale}}});
}

Status World::check_new(const std::string& name) const {
  if (!is_name(name)) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("\"{}\" cannot name a sheet: use letters, digits, - and _", name)};
  }
  const std::lock_guard lock(mutex_);
  if (sheets_.contains(name)) {
    return Error{ErrorCode::kConflict, fmt::format("there is a sheet {} already: choose another name", name)};
  }
  return Ok();
}

Status World::add(std::shared_ptr<Sheet> sheet) {
  if (Status s = save_sheet(*sheet, sheet_dir(sheet->name)); !s.ok()) return s;
  const std::lock_guard lock(mutex_);
  for (const TrueTag& tag : sheet->tags) next_tag_ = std::max(next_tag_, tag.id + 1);
  sheets_[sheet->name] = std::move(sheet);
  return save_locked();
}

Status World::new_panel(const std::string& name, double width_mm, double height_mm, int strips) {
  const std::lock_guard one_at_a_time(changing_);
  if (Status s = check_new(name); !s.ok()) return s;
  PanelOrder order{name, width_mm, height_mm, strips, 0, truth_.settings.sheet_dpi, 0, truth_.settings.rough};
  {
    const std::lock_guard lock(mutex_);
    order.first_tag = next_tag_;
    order.seed = Random(truth_.settings.seed, "panel", sheets_.size()).next();
  }
  Result<std::shared_ptr<Sheet>> made = make_panel(order);
  return made.ok() ? add(*made) : Status(made.error());
}

Status World::new_grid(const std::string& name) {
  const std::lock_guard one_at_a_time(changing_);
  if (Status s = check_new(name); !s.ok()) return s;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [other, sheet] : sheets_) {
      if (sheet->kind == SheetKind::kGrid) {
        return Error{ErrorCode::kConflict,
                     fmt::format("the AprilGrid sheet {} is there already: its tags are unique", other)};
      }
    }
  }
  return add(make_grid(name, truth_.settings.sheet_dpi, truth_.settings.seed, truth_.settings.rough.grid_print_error));
}

Status World::new_board(const std::string& name, double width_mm, double height_mm) {
  const std::lock_guard one_at_a_time(changing_);
  if (Status s = check_new(name); !s.ok()) return s;
  PanelOrder order{name, width_mm, height_mm, 0, 0, truth_.settings.sheet_dpi, 0, truth_.settings.rough};
  {
    const std::lock_guard lock(mutex_);
    order.seed = Random(truth_.settings.seed, "board", sheets_.size()).next();
  }
  Result<std::shared_ptr<Sheet>> made = make_board(order);
  return made.ok() ? add(*made) : Status(made.error());
}

Result<std::shared_ptr<Sheet>> World::find_locked(const std::string& name) const {
  const auto at = sheets_.find(name);
  if (at != sheets_.end()) return at->second;
  std::string names;
  for (const auto& [other, sheet] : sheets_) names += (names.empty() ? "" : ", ") + other;
  return Error{ErrorCode::kNotFound, names.empty() ? fmt::format("there is no sheet {}: the shelf is empty", name)
                                                   : fmt::format("there is no sheet {}: there are {}", name, names)};
}

Status World::place(const std::string& name, Spot on, SheetFace face, const std::string& part, double height_mm) {
  const std::lock_guard one_at_a_time(changing_);
  if (on == Spot::kShelf) return Error{ErrorCode::kInvalidArgument, "a sheet is placed on the scanner or on the bed"};
  if (height_mm < 0 || height_mm > 50) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("a sheet cannot lie {} mm above the bed: give 0 to 50", height_mm)};
  }
  const auto draw = [&]() -> Result<SheetPose> {
    const std::lock_guard lock(mutex_);
    const Result<std::shared_ptr<Sheet>> sheet = find_locked(name);
    if (!sheet.ok()) return sheet.error();
    Random random(truth_.settings.seed, "placement", static_cast<std::uint64_t>(placements_));
    const ScannerTruth& glass = truth_.scanner;
    return on == Spot::kScanner ? lay_on_glass(**sheet, face, part, glass.width_mm, glass.height_mm, random)
                                : lay_on_bed(**sheet, face, truth_.settings.bed, random);
  };
  const Result<SheetPose> pose = draw();
  if (!pose.ok()) return pose.error();
  return put({name, face, *pose, on == Spot::kBed ? height_mm : 0}, on);
}

Status World::place_at(const Placement& placement, Spot on) {
  const std::lock_guard one_at_a_time(changing_);
  {
    const std::lock_guard lock(mutex_);
    const Result<std::shared_ptr<Sheet>> sheet = find_locked(placement.sheet);
    if (!sheet.ok()) return sheet.error();
  }
  return put(placement, on);
}

// A tag that was badly glued moves when it is first pressed on.
Status World::slip_tags(const Placement& placement) {
  const double amount = truth_.settings.rough.tag_slip_mm;
  std::shared_ptr<Sheet> changed;
  {
    const std::lock_guard lock(mutex_);
    const std::shared_ptr<Sheet>& sheet = sheets_.at(placement.sheet);
    bool& slipped = sheet->slipped[placement.face == SheetFace::kShow ? 0 : 1];
    if (amount <= 0 || slipped || sheet->kind != SheetKind::kPanel) return Ok();
    slipped = true;
    changed = copy_of(*sheet);
  }
  Random random(truth_.settings.seed, "slip " + placement.sheet + to_string(placement.face));
  slip_one_tag(*changed, placement.face, amount, random);
  if (Status s = save_sheet(*changed, sheet_dir(placement.sheet)); !s.ok()) return s;
  const std::lock_guard lock(mutex_);
  sheets_[placement.sheet] = changed;
  return Ok();
}

Status World::put(const Placement& placement, Spot on) {
  if (on == Spot::kBed)
    if (Status s = slip_tags(placement); !s.ok()) return s;
  for (const Spot spot : {Spot::kScanner, Spot::kBed}) {
    const std::optional<Placement>& lies = spot == Spot::kScanner ? on_scanner_ : on_bed_;
    if (!lies || (spot != on && lies->sheet != placement.sheet)) continue;
    if (Status s = take_off(spot, false); !s.ok()) return s;
  }
  const std::lock_guard lock(mutex_);
  (on == Spot::kScanner ? on_scanner_ : on_bed_) = placement;
  ++placements_;
  if (on == Spot::kBed)
    if (Status s = log_load_locked(false); !s.ok()) return s;
  return save_locked();
}

Status World::log_load_locked(bool nudged) {
  const json line = {{"sheet", on_bed_->sheet}, {"nudge", nudged}, {"pose", sim::to_json(on_bed_->pose)}};
  const fs::path file = state_dir_ / "truth" / "bed_loads.jsonl";
  std::ofstream out(file, std::ios::app | std::ios::binary);
  out << line.dump() << "\n" << std::flush;
  if (!out) return Error{ErrorCode::kStorage, fmt::format("cannot append to {}", file.string())};
  return Ok();
}

Status World::lift(Spot from, bool leave_bridges) {
  const std::lock_guard one_at_a_time(changing_);
  return take_off(from, leave_bridges);
}

Status World::take_off(Spot from, bool leave_bridges) {
  std::string name;
  {
    const std::lock_guard lock(mutex_);
    std::optional<Placement>& lies = from == Spot::kScanner ? on_scanner_ : on_bed_;
    if (!lies) {
      return Error{ErrorCode::kNotFound,
                   fmt::format("nothing lies on the {}", from == Spot::kScanner ? "scanner" : "bed")};
    }
    end_stroke_locked();
    name = lies->sheet;
    lies.reset();
    if (Status s = save_locked(); !s.ok()) return s;
  }
  return from == Spot::kBed ? let_pieces_fall(name, leave_bridges) : Ok();
}

Status World::let_pieces_fall(const std::string& name, bool leave_bridges) {
  std::shared_ptr<Sheet> changed;
  {
    const std::lock_guard lock(mutex_);
    const std::shared_ptr<Sheet>& sheet = sheets_.at(name);
    if (!sheet->cut_since_lifted) return Ok();
    changed = copy_of(*sheet);
  }
  const std::size_t burnt = changed->burns.size();
  const int bridges = leave_bridges ? 0 : cut_bridges(*changed);
  for (std::size_t i = burnt; i < changed->burns.size(); ++i)
    if (Status s = append_burn(changed->burns[i], sheet_dir(name)); !s.ok()) return s;
  const int fallen = drop_loose_pieces(*changed);
  changed->cut_since_lifted = leave_bridges;
  log_->info("{} pieces fell out of {}, {} bridges were cut by hand", fallen, name, bridges);
  if (Status s = save_pieces(*changed, sheet_dir(name)); !s.ok()) return s;
  const std::lock_guard lock(mutex_);
  sheets_[name] = changed;
  return Ok();
}

Status World::nudge() {
  const std::lock_guard one_at_a_time(changing_);
  const std::lock_guard lock(mutex_);
  if (!on_bed_) return Error{ErrorCode::kNotFound, "nothing lies on the bed that could be nudged"};
  end_stroke_locked();
  Random random(truth_.settings.seed, "nudge", static_cast<std::uint64_t>(placements_++));
  on_bed_->pose.angle_rad += random.error(0.008);
  on_bed_->pose.shift = on_bed_->pose.shift + Vec2{random.error(3), random.error(3)};
  if (Status s = log_load_locked(true); !s.ok()) return s;
  return save_locked();
}

void World::drift_axes(double scale) {
  const std::lock_guard lock(mutex_);
  drift_.x_scale += scale, drift_.y_scale += scale;
  if (Status s = save_locked(); !s.ok()) log_->error("{}", s.error().message);
}

MachineAxes World::axes() const {
  const std::lock_guard lock(mutex_);
  return {truth_.axes.x_scale + drift_.x_scale, truth_.axes.y_scale + drift_.y_scale, truth_.axes.skew};
}

std::vector<SheetSummary> World::sheets() const {
  const std::lock_guard lock(mutex_);
  std::vector<SheetSummary> out;
  for (const auto& [name, sheet] : sheets_) {
    SheetSummary one{name, sheet->kind, Spot::kShelf, SheetFace::kShow};
    if (on_scanner_ && on_scanner_->sheet == name) one.where = Spot::kScanner, one.face = on_scanner_->face;
    if (on_bed_ && on_bed_->sheet == name) one.where = Spot::kBed, one.face = on_bed_->face;
    out.push_back(one);
  }
  return out;
}

std::vector<BurnSummary> World::burn_summary() const {
  const std::lock_guard lock(mutex_);
  std::vector<BurnSummary> out;
  for (const auto& [name, sheet] : sheets_) {
    BurnSummary one{name, 0, sheet->pieces.size(), 0, 0};
    const auto count = [&one](const TrueBurn& burn) {
      ++one.strokes;
      double& sum = burn.depth == BurnDepth::kThrough ? one.through_mm : one.engraved_mm;
      for (std::size_t i = 1; i < burn.points.size(); ++i) sum += length(burn.points[i] - burn.points[i - 1]);
    };
    for (const TrueBurn& burn : sheet->burns)
      if (!burn.by_hand) count(burn);
    if (stroke_ && stroke_->sheet == sheet) count(stroke_->burn);
    out.push_back(one);
  }
  return out;
}

std::optional<PlacedSheet> World::snapshot(Spot spot) {
  const std::lock_guard lock(mutex_);
  const std::optional<Placement>& lies = spot == Spot::kScanner ? on_scanner_ : on_bed_;
  if (!lies) return std::nullopt;
  end_stroke_locked();
  return PlacedSheet{*lies, copy_of(*sheets_.at(lies->sheet))};
}

Result<std::shared_ptr<const Sheet>> World::sheet(const std::string& name) {
  const std::lock_guard lock(mutex_);
  const Result<std::shared_ptr<Sheet>> found = find_locked(name);
  if (!found.ok()) return found.error();
  end_stroke_locked();
  return std::shared_ptr<const Sheet>(copy_of(**found));
}

std::shared_ptr<Sheet> World::copy_of(const Sheet& sheet) {
  auto copy = std::make_shared<Sheet>(sheet);
  copy->material = sheet.material.clone();
  copy->engraved_front = sheet.engraved_front.clone();
  copy->engraved_back = sheet.engraved_back.clone();
  return copy;
}

int World::next_picture(const std::string& kind) {
  const std::lock_guard lock(mutex_);
  const int number = ++pictures_[kind];
  if (Status s = save_locked(); !s.ok()) log_->error("{}", s.error().message);
  return number;
}

}  // namespace veneer::sim
