#include "daemon/services/scan_service.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "base/clock.h"
#include "calib/april_grid.h"
#include "daemon/orders/have_done.h"
#include "daemon/services/part_zones.h"
#include "daemon/workers/json_depth.h"

namespace veneer::daemon {
namespace {

// Of what a worker process answers: could it be what was asked for? It is kept, and read again whenever somebody asks.
bool can_be(const PanelRead& read, std::size_t tiles, std::size_t suspects) {
  constexpr std::size_t kMostTags = 2'000, kMostZones = 10'000, kMostPoints = 10'000, kMostDifferences = 10'000;
  constexpr std::size_t kMostWarnings = 1'000, kLongestWarning = 1'000;
  constexpr std::size_t kLongestLattice = 2 << 20;
  constexpr Millimetres kSmallest{1}, kLargest{20'000};
  const auto is_lattice = [](const std::string& text) {
    if (text.size() > kLongestLattice || nested_too_deeply(text)) return false;
    const auto lattice = nlohmann::json::parse(text, nullptr, false);
    return lattice.is_object() && lattice.contains("panel_mm") && lattice["panel_mm"].is_array();
  };
  constexpr std::size_t kMostCorners = 1'000'000;  // of all shapes together
  std::size_t corners = 0;
  const auto is_near = [&](const calib::Difference& difference) {
    const auto near = [&](const Point<PanelFrame>& p) {
      return p.x >= -kLargest && p.x <= kLargest && p.y >= -kLargest && p.y <= kLargest;
    };
    const auto rings = difference.shape.rings();
    for (const auto& ring : rings) corners += ring.size();
    return near(difference.place) && !rings.empty() && corners <= kMostCorners &&
           std::ranges::all_of(rings, [&](const auto& ring) { return std::ranges::all_of(ring, near); });
  };
  const auto is_side = [&](Millimetres side) { return side >= kSmallest && side <= kLargest; };
  return read.lattices.size() == tiles && std::ranges::all_of(read.lattices, is_lattice) &&
         (read.sheet.empty() || (is_side(read.sheet.width()) && is_side(read.sheet.height()))) &&
         read.fiducials.tags.size() + read.fiducials.holes.size() <= kMostTags && read.zones.size() <= kMostZones &&
         std::ranges::all_of(read.zones, [](const auto& zone) { return zone.outline.size() <= kMostPoints; }) &&
         read.usable >= SquareMillimetres(0) && read.usable <= kLargest * kLargest &&
         (!read.differences ||
          (read.differences->size() <= kMostDifferences && std::ranges::all_of(*read.differences, is_near))) &&
         read.suspects_gone.size() == suspects &&
         std::ranges::all_of(read.suspects_gone, [](double share) { return share >= 0 && share <= 1; }) &&
         read.warnings.size() <= kMostWarnings &&
         std::ranges::all_of(read.warnings, [](const auto& text) { return text.size() <= kLongestWarning; });
}

const char* in_words(calib::DifferenceKind kind) {
  return kind == calib::DifferenceKind::kGoneNotBooked ? "wood is gone that is not booked as cut"
                                                       : "booked as cut, and still in the panel";
}

Box<PanelFrame> bounds_of(const Region<PanelFrame>& region) {
  Box<PanelFrame> out;
  for (const auto& ring : region.rings())
    for (const auto& point : ring) out.add(point);
  return out;
}

bool touch(const Box<PanelFrame>& a, const Box<PanelFrame>& b) {
  return a.min.x <= b.max.x && b.min.x <= a.max.x && a.min.y <= b.max.y && b.min.y <= a.max.y;
}

// Whose wood each difference is; nobody's when it is free.
Result<std::vector<FoundDifference>> with_pieces(Repositories& r, const PanelId& panel,
                                                 const std::vector<calib::Difference>& differences) {
  std::vector<FoundDifference> out;
  const auto live = r.ledger.live_allocations(panel);
  if (!live) return live.error();
  std::vector<Box<PanelFrame>> boxes;
  boxes.reserve(live->size());
  for (const auto& allocation : *live) boxes.push_back(bounds_of(allocation.area));
  for (const calib::Difference& difference : differences) {
    FoundDifference& found = out.emplace_back(FoundDifference{difference, {}});
    // Of rings that a worker may have let cross each other.
    const auto& shape = found.seen.shape = unite(difference.shape, {});
    const Box<PanelFrame> box = bounds_of(shape);
    for (std::size_t i = 0; i < live->size(); ++i) {
      const auto& allocation = (*live)[i];
      const bool cut = allocation.state == db::AllocationState::kCut || allocation.state == db::AllocationState::kScrap;
      const bool booked = difference.kind == calib::DifferenceKind::kBookedNotGone;
      if (allocation.piece.value == 0 || cut != booked || !touch(boxes[i], box)) continue;
      if (!overlaps(allocation.area, shape)) continue;
      const auto piece = r.jobs.find_piece(allocation.piece);
      if (!piece) return piece.error();
      found.pieces.push_back({allocation.job, piece->mark, allocation.state});
    }
  }
  return out;
}

// Of a piece that was cut out nothing is left; a few pixels at the border of another hole are noise.
db::Seen what_was_seen(double share_gone) {
  constexpr double kOut = 0.9, kNoise = 0.05;
  return share_gone >= kOut ? db::Seen::kCut : share_gone <= kNoise ? db::Seen::kStillThere : db::Seen::kUnclear;
}

// What the scan saw of wood that is suspect is noted until somebody says what became of it; nothing is decided.
Result<std::vector<SeenSuspect>> note_suspects(Repositories& r, const std::vector<db::AllocationRecord>& suspects,
                                               const std::vector<double>& gone, int mask_version,
                                               const std::string& at) {
  std::vector<SeenSuspect> out;
  std::vector<std::pair<db::AllocationId, db::Sighting>> seen;
  for (std::size_t i = 0; i < suspects.size(); ++i) {
    const auto piece = r.jobs.find_piece(suspects[i].piece);
    if (!piece) return piece.error();
    // Somebody said it while the scan was being looked at.
    if (piece->state != db::PieceState::kSuspect || piece->allocation != suspects[i].id) continue;
    const db::Sighting sighting{what_was_seen(gone[i]), gone[i], mask_version, at};
    seen.emplace_back(suspects[i].id, sighting);
    out.push_back({piece->job, piece->mark, sighting});
  }
  if (const Status noted = r.jobs.note_sightings(seen); !noted) return noted.error();
  return out;
}

std::vector<db::DifferenceRecord> to_records(const std::vector<FoundDifference>& differences) {
  std::vector<db::DifferenceRecord> out;
  for (const FoundDifference& difference : differences) {
    db::DifferenceRecord& record = out.emplace_back();
    record.gone = difference.seen.kind == calib::DifferenceKind::kGoneNotBooked;
    record.place = difference.seen.place;
    record.shape = difference.seen.shape;
    record.area = difference.seen.area;
    auto pieces = nlohmann::json::array();
    for (const auto& piece : difference.pieces)
      pieces.push_back({{"job", piece.job.value}, {"mark", piece.mark}, {"state", db::to_string(piece.state)}});
    record.pieces_json = pieces.dump();
  }
  return out;
}

}  // namespace

ScanService::ScanService(ScannerDriver& scanner, DatabaseThread& database, const PanelLibrary& library,
                         WorkRunner& workers, const Config& config, Logger log)
    : scanner_(scanner),
      database_(database),
      library_(library),
      workers_(workers),
      config_(config),
      log_(std::move(log)) {}

WorkOrder ScanService::order(const char* kind, const char* what, const WorkFolder& folder) const {
  WorkOrder out;
  out.kind = kind;
  out.what = what;
  out.folder = folder.path();
  out.deadline = std::chrono::seconds(config_.workers.scan_limit_s);
  return out;
}

Result<ScanOutcome> ScanService::add_tile(const ScanRequest& request, const TaskProgress& progress,
                                          const std::stop_token& stop) {
  progress(0.02, "scanning");
  auto scan = scanner_.scan(
      ScanResolution::from_dpi(config_.scanner.dpi),
      [&](double f, const std::string& doing) { progress(0.02 + 0.33 * f, doing.empty() ? "scanning" : doing); }, stop);
  if (!scan) return scan.error();
  progress(0.35, "looking for tags and holes");
  auto folder = WorkFolder::make(library_.data_dir());
  if (!folder) return folder.error();
  WorkOrder look = order(ViewScan::kKind, "looking at the scan", *folder);
  look.readable = {scan->file};
  auto view = have_done<calib::TileView>(workers_, std::move(look),
                                         ViewScan{scan->file.string(), scan->device, scan->nominal}, progress, stop);
  if (!view) return view.error();
  if (view->tags.empty())
    return Error{ErrorCode::kRefused,
                 "no fiducials found on the scan: lay a panel on the glass, tags down, and scan again"};
  // Tiles of the other face that were never finished belong to nothing.
  if (std::exchange(face_of_tiles_, request.face) != request.face) tiles_.clear();
  tiles_.push_back({std::move(*folder), scan->device, scan->make, std::move(*view)});
  if (request.more) {
    ScanOutcome outcome;
    outcome.tiles = tiles_.size();
    outcome.face = request.face;
    return outcome;
  }
  // Good or bad, this series of tiles is over, whatever is thrown; a refused one is scanned anew.
  struct Forget {
    std::vector<Tile>& tiles;
    ~Forget() { tiles.clear(); }
  } const forget{tiles_};
  return finish(request, progress, stop);
}

Result<ScanService::Stock> ScanService::read_stock() {
  return database_.call([](Repositories& r) -> Result<Stock> {
    // A retired panel is not looked for: its sheet can be scanned anew, as another one, or is a part of it.
    auto panels = r.panels.in_stock();
    if (!panels) return panels.error();
    auto sawn = r.panels.sawn();
    if (!sawn) return sawn.error();
    Stock out{std::move(*panels), std::move(*sawn), {}};
    std::vector<PanelId> all = out.sawn;
    for (const auto& panel : out.panels) all.push_back(panel.id);
    for (const PanelId& panel : all) {
      auto fiducials = r.panels.fiducials(panel);
      if (!fiducials) return fiducials.error();
      out.fiducials[panel] = to_calib(*fiducials);
    }
    return out;
  });
}

// How many tags on the glass each face of these panels has.
std::map<std::pair<PanelId, Face>, int> ScanService::count_tags(const Stock& stock,
                                                                const std::vector<PanelId>& panels) const {
  std::map<std::pair<PanelId, Face>, int> votes;
  for (const auto& tile : tiles_)
    for (const auto& tag : tile.view.tags)
      for (const PanelId& id : panels)
        if (const auto* t = stock.fiducials.at(id).tag(tag.id)) ++votes[{id, t->face}];
  return votes;
}

// Of a sheet that is none in stock. A part of a part carries tags of both: it comes from the one that was sawn last.
Result<std::optional<PanelId>> ScanService::parent_of(const ScanRequest& request, const Stock& stock) const {
  if (request.part_of) {
    if (std::ranges::count(stock.sawn, *request.part_of) > 0) return request.part_of;
    return Error{ErrorCode::kNotFound, fmt::format("no panel {0} was sawn apart: run veneerctl panel split {0} first",
                                                   request.part_of->value)};
  }
  const auto votes = count_tags(stock, stock.sawn);
  std::optional<PanelId> parent;
  int most = 0;
  for (const PanelId& id : stock.sawn)
    if (const auto counted = votes.find({id, Face::kShow}); counted != votes.end() && counted->second > most)
      most = counted->second, parent = id;
  if (!parent && !votes.empty())
    return Error{ErrorCode::kRefused,
                 fmt::format("these are tags of the back of panel {}, which was sawn apart: scan the show face of each "
                             "part first",
                             votes.begin()->first.first.value)};
  return parent;
}

Result<ScanService::Known> ScanService::identify(const ScanRequest& request) {
  auto stock = read_stock();
  if (!stock) return stock.error();

  Known known;
  known.face = request.face;
  std::vector<PanelId> in_stock;
  for (const auto& panel : stock->panels) in_stock.push_back(panel.id);
  // The tags say which panel and which face this is, where they are known.
  std::optional<PanelId> wanted = request.panel;
  int most = 0;
  for (const auto& [where, count] : count_tags(*stock, in_stock))
    if (count > most) {
      most = count;
      if (!request.panel) wanted = where.first;
      if (!request.panel || *request.panel == where.first) known.face = where.second;
    }
  for (const auto& panel : stock->panels)
    if (wanted && panel.id == *wanted) known.panel = panel;
  if (wanted && !known.panel)
    return Error{
        ErrorCode::kNotFound,
        fmt::format("there is no panel {} in stock: see veneerctl panel list --all, and veneerctl panel restore "
                    "for one that was retired",
                    wanted->value)};
  if (known.panel && request.part_of)
    return Error{ErrorCode::kConflict, fmt::format("the tags are those of panel {}, which is in stock: scan it without "
                                                   "saying of which panel it is a part",
                                                   known.panel->id.value)};
  if (!known.panel && request.face == Face::kBack)
    return Error{
        ErrorCode::kInvalidArgument,
        "these back tags are new: name the panel they belong to, as in veneerctl panel scan --face back --panel "
        "P-0001"};
  if (known.panel) {
    known.fiducials = stock->fiducials[known.panel->id];
  } else {
    auto parent = parent_of(request, *stock);
    if (!parent) return parent.error();
    known.parent = std::move(*parent);
    if (known.parent) known.parent_fiducials = stock->fiducials[*known.parent];
  }
  const calib::AprilGrid grid;
  for (int i = 0; i < grid.tags(); ++i) known.foreign_tags.insert(grid.first_id + i);
  for (const PanelId& id : in_stock)
    if (!known.panel || id != known.panel->id)
      for (const auto& tag : stock->fiducials[id].tags) known.foreign_tags.insert(tag.id);
  return known;
}

Result<ScanOutcome> ScanService::finish(const ScanRequest& request, const TaskProgress& progress,
                                        const std::stop_token& stop) {
  auto calibration = database_.call([](Repositories& r) { return load_calibration(r, utc_timestamp()); });
  if (!calibration) return calibration.error();
  if (const Status ready = require_scanner(*calibration); !ready) return ready.error();
  for (const auto& tile : tiles_) {
    if (const Status same = require_make(*calibration, tile.make); !same) return same.error();
    if (const Status same = require_scan_size(*calibration, tile.view.width_px, tile.view.height_px); !same)
      return same.error();
  }
  auto known = identify(request);
  if (!known) return known.error();

  auto folder = WorkFolder::make(library_.data_dir());
  if (!folder) return folder.error();
  WorkOrder work = order(RegisterScans::kKind, "registering the scan", *folder);
  RegisterScans wanted;
  for (const auto& tile : tiles_) {
    wanted.views.push_back(tile.view);
    wanted.files.push_back((tile.folder.path() / kMadeScan).string());
    work.readable.emplace_back(wanted.files.back());
  }
  wanted.scanner = calibration->scanner->data();
  wanted.face = known->face;
  wanted.foreign_tags = known->foreign_tags;
  if (known->panel) wanted.known = known->fiducials;
  if (known->panel && known->face == Face::kShow) {
    const auto masks = database_.call([&](Repositories& r) { return r.panels.masks(known->panel->id); });
    if (!masks) return masks.error();
    // A cell that was restored may have lost the old ones: then the oldest that is left, since a later one shows what
    // is gone by then as if it had never been there.
    const auto is_left = [&](const db::MaskRecord& mask) {
      std::error_code none;
      return std::filesystem::exists(library_.path_of(mask.map_file), none);
    };
    const auto oldest = std::find_if(masks->rbegin(), masks->rend(), is_left);
    const std::string& first = oldest == masks->rend() ? known->panel->map_file : oldest->map_file;
    known->later_map = first != masks->back().map_file;
    wanted.first_map = library_.path_of(first).string();
    wanted.earlier_map = library_.path_of(known->panel->map_file).string();
    wanted.earlier_mask = library_.path_of(known->panel->mask_file).string();
    work.readable.insert(work.readable.end(), {wanted.first_map, wanted.earlier_map, wanted.earlier_mask});
    const auto live = database_.call([&](Repositories& r) { return r.ledger.live_allocations(known->panel->id); });
    if (!live) return live.error();
    for (const auto& allocation : *live) {
      if (allocation.state == db::AllocationState::kCut || allocation.state == db::AllocationState::kScrap)
        wanted.gone.push_back(allocation.area);
      if (allocation.state != db::AllocationState::kSuspect) continue;
      known->suspects.push_back(allocation);
      wanted.suspects.emplace_back(allocation.outline);
    }
  }
  const auto read = have_done<PanelRead>(workers_, std::move(work), wanted, progress, stop);
  if (!read) return read.error();
  if (!can_be(*read, tiles_.size(), known->suspects.size()))
    return Error{ErrorCode::kInternal, "the scan came back unreadable: scan again, and report it when it comes back"};
  progress(0.92, "entering stock");
  if (!known->panel) return add_panel(*known, *read, *folder);
  if (known->face == Face::kBack) return add_back(*known, *read);
  return scan_again(*known, *read, *folder);
}

Result<std::vector<db::ScanRecord>> ScanService::store_scans(const PanelId& panel, Face face, const PanelRead& read) {
  std::vector<db::ScanRecord> records;
  for (std::size_t i = 0; i < tiles_.size(); ++i) {
    const Tile& tile = tiles_[i];
    auto stored = library_.adopt(tile.folder.path() / kMadeScan, "scans", to_string(face), kMostPixelsScanned);
    if (!stored) return stored.error();
    db::ScanRecord& record = records.emplace_back();
    record.panel = panel;
    record.face = face;
    record.device = tile.device;
    record.file = stored->file;
    record.sha256 = stored->sha256;
    record.dpi = tile.view.nominal.dpi();
    record.rms = read.rms;
    record.max = read.max;
    record.lattice = read.lattices.at(i);
    record.taken_at = utc_timestamp();
  }
  return records;
}

Result<ScanOutcome> ScanService::add_panel(const Known& known, const PanelRead& read, const WorkFolder& folder) {
  std::optional<db::PartRecord> part;
  if (known.parent) {
    const auto related = calib::relate_part(read.fiducials, known.parent_fiducials, read.sheet);
    if (!related)
      return Error{related.error().code,
                   fmt::format("this is a part of panel {}, and {}", known.parent->value, related.error().message)};
    part = db::PartRecord{related->part_from_parent, related->fiducials, related->rms};
  }
  auto id = database_.call([](Repositories& r) { return r.panels.next_panel_id(); });
  if (!id) return id.error();
  auto map_file = library_.adopt(folder.path() / kMadeMap, "panels/" + id->value, "map");
  if (!map_file) return map_file.error();
  auto mask_file = library_.adopt(folder.path() / kMadeMask, "panels/" + id->value, "mask");
  if (!mask_file) return mask_file.error();
  auto scans = store_scans(*id, Face::kShow, read);
  if (!scans) return scans.error();
  db::PanelRecord panel;
  panel.id = *id;
  panel.name = id->value;
  panel.width = read.sheet.width();
  panel.height = read.sheet.height();
  panel.map_file = map_file->file;
  panel.mask_file = mask_file->file;
  panel.map_hash = map_file->sha256;
  panel.usable = read.usable;
  panel.created_at = utc_timestamp();
  panel.parent = known.parent;
  const auto fiducials = to_records(read.fiducials, Face::kShow);
  std::size_t carried = 0;
  std::vector<db::ZoneRecord> zones = read.zones;
  const Status added = database_.call([&](Repositories& r) -> Status {
    if (!part) {
      if (Status entered = r.panels.add(panel, *scans, fiducials); !entered) return entered;
      return r.materials.add_zones(panel.id, zones);
    }
    if (Status entered = r.panels.add_part(panel, *scans, fiducials, *part); !entered) return entered;
    const auto live = r.ledger.live_states(panel.id);
    if (!live) return live.error();
    carried = live->size();
    const auto before = r.materials.zones(*panel.parent);
    if (!before) return before.error();
    zones = zones_of_part(read.zones, *before, part->part_from_parent, read.sheet);
    return r.materials.add_zones(panel.id, zones);
  });
  if (!added) return added.error();
  library_.make_small(map_file->file, mask_file->file);
  ScanOutcome outcome;
  outcome.tiles = tiles_.size();
  outcome.panel = *id;
  outcome.is_new = true;
  outcome.part_of = known.parent;
  outcome.carried = carried;
  outcome.rms = read.rms;
  outcome.max = read.max;
  outcome.usable = read.usable;
  outcome.zones = zones.size();
  outcome.warnings = read.warnings;
  log_->info("panel {} entered stock: {:.0f} x {:.0f} mm, {} zones", id->value, panel.width.count(),
             panel.height.count(), outcome.zones);
  if (part)
    log_->info(
        "panel {} is a part of panel {}: {} tags and holes in common, rms {:.3f} mm; {} allocations carried over",
        id->value, known.parent->value, part->fiducials, part->rms.count(), carried);
  for (const std::string& warning : outcome.warnings) log_->warn("panel {}: {}", id->value, warning);
  return outcome;
}

Result<ScanOutcome> ScanService::add_back(const Known& known, const PanelRead& read) {
  const PanelId& id = known.panel->id;
  auto scans = store_scans(id, Face::kBack, read);
  if (!scans) return scans.error();
  // Back tags are frozen once; a later look at the back adds its scans only.
  std::vector<db::FiducialRecord> fiducials;
  if (!known.fiducials.knows(Face::kBack)) fiducials = to_records(read.fiducials, Face::kBack);
  const Status added = database_.call([&](Repositories& r) { return r.panels.add_scans(id, *scans, fiducials); });
  if (!added) return added.error();
  ScanOutcome outcome;
  outcome.tiles = tiles_.size();
  outcome.panel = id;
  outcome.face = Face::kBack;
  outcome.rms = read.rms;
  outcome.max = read.max;
  return outcome;
}

Result<ScanOutcome> ScanService::scan_again(const Known& known, const PanelRead& read, const WorkFolder& folder) {
  const db::PanelRecord& panel = *known.panel;
  auto map_file = library_.adopt(folder.path() / kMadeMap, "panels/" + panel.id.value, "map");
  if (!map_file) return map_file.error();
  auto mask_file = library_.adopt(folder.path() / kMadeMask, "panels/" + panel.id.value, "mask");
  if (!mask_file) return mask_file.error();
  auto scans = store_scans(panel.id, Face::kShow, read);
  if (!scans) return scans.error();
  ScanOutcome outcome;
  std::optional<std::vector<FoundDifference>> differences;
  const Status written = database_.call([&](Repositories& r) -> Status {
    if (read.differences) {
      auto named = with_pieces(r, panel.id, *read.differences);
      if (!named) return named.error();
      differences = std::move(*named);
    }
    const auto version = r.panels.add_mask(
        panel.id, {0, map_file->file, mask_file->file, map_file->sha256, utc_timestamp(), read.usable},
        panel.mask_version);
    if (!version) return version.error();
    // A panel from before zones were kept gets them now.
    if (Status zoned = r.materials.add_zones(panel.id, read.zones); !zoned) return zoned;
    if (differences)
      if (Status told = r.differences.found(panel.id, to_records(*differences), utc_timestamp(), known.later_map);
          !told)
        return told;
    auto suspects = note_suspects(r, known.suspects, read.suspects_gone, *version, utc_timestamp());
    if (!suspects) return suspects.error();
    outcome.suspects = std::move(*suspects);
    // Those that it had, whatever strips the eye makes of wood that pieces were cut from.
    const auto zones = r.materials.zones(panel.id);
    if (!zones) return zones.error();
    outcome.zones = zones->size();
    // Last, since a panel that was scanned counts as seen: a kill before this leaves it unseen.
    return r.panels.add_scans(panel.id, *scans, {});
  });
  if (!written) return written.error();
  library_.drop_index(panel.id);
  library_.make_small(map_file->file, mask_file->file);
  outcome.tiles = tiles_.size();
  outcome.panel = panel.id;
  outcome.rms = read.rms;
  outcome.max = read.max;
  outcome.usable = read.usable;
  if (differences) {
    outcome.differences = std::move(differences);
    for (const FoundDifference& difference : *outcome.differences) {
      std::string pieces;
      for (const auto& piece : difference.pieces)
        pieces += fmt::format(", piece {} of job {}", piece.mark, piece.job.value);
      log_->warn("panel {}: {} at {:.1f}, {:.1f} mm, {:.1f} mm2{}", panel.id.value, in_words(difference.seen.kind),
                 difference.seen.place.x.count(), difference.seen.place.y.count(), difference.seen.area.count(),
                 pieces);
    }
  }
  outcome.warnings = read.warnings;
  return outcome;
}

}  // namespace veneer::daemon
