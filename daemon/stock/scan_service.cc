#include "daemon/stock/scan_service.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <utility>

#include "base/clock.h"
#include "base/hash.h"
#include "calib/april_grid.h"
#include "daemon/orders/have_done.h"
#include "daemon/orders/scan_json.h"
#include "daemon/stock/plausible_read.h"
#include "daemon/stock/sheet_doubts.h"

namespace veneer::daemon {
namespace {

constexpr const char* kProposals = "proposals";  // their pictures, until they are decided

Error picture_of_series(const std::string& device) {
  return {
      ErrorCode::kRefused,
      fmt::format("{} gives a picture again that is a tile of this series already: move the panel and scan it anew, "
                  "or begin the series anew with veneerctl panel scan --anew",
                  device)};
}

}  // namespace

ScanService::ScanService(ScannerDriver& scanner, DatabaseThread& database, const PanelLibrary& library,
                         WorkRunner& workers, ScanProposals& proposals, const Config& config)
    : scanner_(scanner),
      database_(database),
      library_(library),
      workers_(workers),
      proposals_(proposals),
      config_(config) {}

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
  if (!request.again) {
    auto tile = scan_tile(progress, stop);
    if (!tile) return tile.error();
    // Not before there is a tile to begin with.
    if (request.anew) give_up();
    // Tiles of the other face that were never finished belong to nothing, nor do those of a series that was refused,
    // once another one is begun.
    give_up_kept();
    if (std::exchange(face_of_tiles_, request.face) != request.face) tiles_.clear(), note_kept();
    if (is_there(*tile)) return picture_of_series(tile->device);
    tiles_.push_back(*std::move(tile));
    if (!request.more) return end_series(request, progress, stop);
    note_open(request);
    ScanOutcome outcome;
    outcome.tiles = tiles_.size();
    outcome.face = request.face;
    return outcome;
  }
  const auto whole = as_refused(request);
  if (!whole) return whole.error();
  auto tile = scan_new_tile(progress, stop);
  if (!tile) return tile.error();
  tiles_[static_cast<std::size_t>(*request.again) - 1] = *std::move(tile);
  return end_series(*whole, progress, stop);
}

Result<ScanService::Tile> ScanService::scan_tile(const TaskProgress& progress, const std::stop_token& stop) {
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
  auto view = have_done<ScanView>(workers_, std::move(look), ViewScan{scan->file.string(), scan->device, scan->nominal},
                                  progress, stop);
  if (!view) return view.error();
  if (view->tile.tags.empty())
    return Error{ErrorCode::kRefused,
                 "no fiducials found on the scan: lay a panel on the glass, tags down, and scan again"};
  // A picture that was not made is told once it is to be stored.
  const auto content = sha256_hex_of_file(folder->path() / kMadeScan);
  return Tile{std::move(*folder),
              scan->device,
              scan->make,
              std::move(view->tile),
              std::move(view->warnings),
              content ? *content : std::string(),
              {}};
}

// A scanner that reads a folder gives its pictures in turn: the one that was put there anew comes after the others.
Result<ScanService::Tile> ScanService::scan_new_tile(const TaskProgress& progress, const std::stop_token& stop) {
  std::string device;
  for (std::size_t turn = 0; turn <= tiles_.size(); ++turn) {
    auto tile = scan_tile(progress, stop);
    if (!tile || !is_there(*tile)) return tile;
    device = tile->device;
    if (stop.stop_requested()) return Error{ErrorCode::kCancelled, "the scan was cancelled"};
  }
  return picture_of_series(device);
}

bool ScanService::is_there(const Tile& tile) const {
  return !tile.sha256.empty() && std::ranges::find(tiles_, tile.sha256, &Tile::sha256) != tiles_.end();
}

Result<ScanRequest> ScanService::as_refused(const ScanRequest& request) const {
  if (!refused_)
    return Error{ErrorCode::kNotFound,
                 "no series of several tiles was refused: scan without --again, and the first tile with --more"};
  if (*request.again < 1 || static_cast<std::size_t>(*request.again) > tiles_.size())
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("there is no tile {}: name one from 1 to {}, in the order in which they were scanned",
                             *request.again, tiles_.size())};
  ScanRequest out = *refused_;
  if (request.panel) out.panel = request.panel;
  if (request.part_of) out.part_of = request.part_of;
  out.retag = out.retag || request.retag;
  out.accept = request.accept, out.overrule = request.overrule, out.who = request.who;
  return out;
}

// Whatever is thrown, the series is over. One that is refused is kept where it is more than the tile that was scanned
// just now, and nobody gave it up.
Result<ScanOutcome> ScanService::end_series(const ScanRequest& request, const TaskProgress& progress,
                                            const std::stop_token& stop) {
  struct Forget {
    ScanService& service;
    bool keep = false;
    ~Forget() {
      if (!keep) service.tiles_.clear();
      service.note_kept();
    }
  } forget{*this};
  refused_.reset();
  note_kept();
  auto outcome = finish(request, progress, stop);
  if (outcome || outcome.error().code == ErrorCode::kStorage) return outcome;
  const auto is_kept = [this](const Tile& one) {
    std::error_code none;
    return std::filesystem::exists(picture_of(one), none);
  };
  if (tiles_.size() < 2 || !std::ranges::all_of(tiles_, is_kept)) return outcome;
  forget.keep = true;
  refused_ = request;
  const bool cancelled = outcome.error().code == ErrorCode::kCancelled;
  return Error{outcome.error().code,
               fmt::format("{}; the {} tiles are kept for a day: {}, the last one by veneerctl panel scan --again {}",
                           outcome.error().message, tiles_.size(),
                           cancelled ? "to have them looked at again, scan one of them anew"
                                     : "once that is seen to, scan the one that was bad anew",
                           tiles_.size())};
}

void ScanService::note_kept() {
  const std::lock_guard lock(kept_mutex_);
  kept_.reset(), open_.reset();
  if (refused_) kept_ = Kept{tiles_.size(), utc_timestamp()};
}

// Whoever scans the next tile is told the panel, and whether new tags are to become its own.
void ScanService::note_open(const ScanRequest& request) {
  const std::lock_guard lock(kept_mutex_);
  const auto panel = request.panel || !open_ ? request.panel : open_->panel;
  open_ = Open{panel, request.face, tiles_.size(), request.retag || (open_ && open_->retag)};
}

std::optional<ScanService::Open> ScanService::open() const {
  const std::lock_guard lock(kept_mutex_);
  return open_;
}

std::optional<ScanService::Kept> ScanService::kept() const {
  const std::lock_guard lock(kept_mutex_);
  return kept_;
}

void ScanService::give_up_kept() {
  if (refused_) give_up();
}

void ScanService::give_up() {
  tiles_.clear();
  refused_.reset();
  note_kept();
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
  for (const PanelId& id : in_stock) known.stock[id] = stock->fiducials[id];
  const calib::AprilGrid grid;
  for (int i = 0; i < grid.tags(); ++i) known.foreign_tags.insert(grid.first_id + i);
  for (const PanelId& id : in_stock)
    if (!known.panel || id != known.panel->id)
      for (const auto& tag : stock->fiducials[id].tags) known.foreign_tags.insert(tag.id);
  return known;
}

// A scanner that reads files gives the same picture until somebody puts another one there, and that shows nothing of
// what was cut since. A device that scans when it is asked gives no two pictures that are alike to the last bit.
// Whether a picture that was never scanned is of today nobody can tell: clocks of scanning computers go as they please.
// A panel that is known is asked for its own scans; a new sheet may have been any panel, until that left the stock.
Status ScanService::require_news(const Known& known) {
  const std::optional<PanelId> panel = known.panel ? std::optional(known.panel->id) : std::nullopt;
  for (std::size_t i = 0; i < tiles_.size(); ++i) {
    const auto before =
        database_.call([&](Repositories& r) { return r.panels.scanned_before(tiles_[i].sha256, panel); });
    if (!before) return before.error();
    if (!*before) continue;
    const std::string which =
        tiles_.size() > 1 ? fmt::format("tile {} of {}", i + 1, tiles_[i].device) : tiles_[i].device;
    return Error{
        ErrorCode::kRefused,
        fmt::format("the picture of {} is the one that was scanned on {} already, and shows nothing of what was "
                    "cut since: scan the panel anew",
                    which, **before)};
  }
  return Ok();
}

// What the worker is told; of a panel that is known also what the ledger holds of it.
Result<RegisterScans> ScanService::ask_of(Known& known, const calib::ScannerModelData& scanner, WorkOrder& work) {
  RegisterScans wanted;
  for (const auto& tile : tiles_) {
    wanted.views.push_back(tile.view);
    wanted.files.push_back(picture_of(tile).string());
    work.readable.emplace_back(wanted.files.back());
  }
  wanted.scanner = scanner;
  wanted.face = known.face;
  wanted.edge_margin = config_.mask.edge_margin, wanted.round_margin = config_.mask.round_margin;
  wanted.foreign_tags = known.foreign_tags;
  if (known.panel) wanted.known = known.fiducials;
  if (!known.panel || known.face != Face::kShow) return wanted;

  const auto masks = database_.call([&](Repositories& r) { return r.panels.masks(known.panel->id); });
  if (!masks) return masks.error();
  // A cell that was restored may have lost the old ones: then the oldest that is left, since a later one shows what
  // is gone by then as if it had never been there. What is left may be spoilt: then the next one.
  for (auto mask = masks->rbegin(); mask != masks->rend(); ++mask) {
    std::error_code none;
    const auto map = library_.path_of(mask->map_file);
    if (std::ranges::count(wanted.maps, map.string()) == 0 && std::filesystem::exists(map, none))
      wanted.maps.push_back(map.string());
  }
  known.later_map = wanted.maps.empty() || wanted.maps.front() != library_.path_of(masks->back().map_file);
  wanted.width = known.panel->width, wanted.height = known.panel->height;
  wanted.earlier_map = library_.path_of(known.panel->map_file).string();
  // What people painted is a layer over what scans see.
  wanted.earlier_mask = library_.path_of(masks->front().seen_file).string();
  work.readable.insert(work.readable.end(), wanted.maps.begin(), wanted.maps.end());
  work.readable.insert(work.readable.end(), {wanted.earlier_map, wanted.earlier_mask});
  // What was wood at first stays to be asked after, though a later scan did not see it any more; the newest has what
  // people gave back since.
  wanted.wood_masks = {library_.path_of(masks->back().mask_file).string()};
  if (masks->front().mask_file != masks->back().mask_file)
    wanted.wood_masks.push_back(library_.path_of(masks->front().mask_file).string());
  work.readable.insert(work.readable.end(), wanted.wood_masks.begin(), wanted.wood_masks.end());
  // Wood that is told as gone is in no later mask, and is told until it is booked.
  const auto told = database_.call([&](Repositories& r) { return r.differences.of(known.panel->id); });
  if (!told) return told.error();
  for (const db::DifferenceRecord& difference : *told)
    if (difference.gone && (!difference.decision || difference.decision->verdict == db::DifferenceVerdict::kAccepted))
      wanted.told_gone.push_back(difference.shape);
  const auto live = database_.call([&](Repositories& r) { return r.ledger.live_allocations(known.panel->id); });
  if (!live) return live.error();
  for (const auto& allocation : *live) {
    const bool gone = allocation.state == db::AllocationState::kCut || allocation.state == db::AllocationState::kScrap;
    (gone ? wanted.gone : wanted.held).push_back(allocation.area);
    if (allocation.state != db::AllocationState::kSuspect) continue;
    known.suspects.push_back({allocation.id.value, allocation.piece.value});
    wanted.suspects.emplace_back(allocation.outline);
  }
  return wanted;
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
  if (const Status news = require_news(*known); !news) return news.error();

  auto folder = WorkFolder::make(library_.data_dir());
  if (!folder) return folder.error();
  WorkOrder work = order(RegisterScans::kKind, "registering the scan", *folder);
  auto wanted = ask_of(*known, calibration->scanner->data(), work);
  if (!wanted) return wanted.error();
  wanted->retag = request.retag;
  if (request.retag && !known->fiducials.knows(known->face))
    return Error{ErrorCode::kInvalidArgument,
                 "tags can be added to a face that is known already: scan it without --retag, its tags are all new"};
  auto read = have_done<PanelRead>(workers_, std::move(work), *wanted, progress, stop);
  if (!read) return read.error();
  // Of several tiles that are doubted for one thing the first one is told. A back is bare: nothing of it is missed
  // where it is blurred, and its tags are judged by how they fit.
  for (const Tile& tile : tiles_)
    for (const ScanWarning& warning : tile.warnings)
      if (!(known->face == Face::kBack && is_of_sharpness(warning.name)) &&
          std::ranges::find(read->warnings, warning.name, &ScanWarning::name) == read->warnings.end())
        read->warnings.push_back(warning);
  if (!is_plausible(*read, tiles_.size(), known->suspects.size()))
    return Error{ErrorCode::kInternal, "the scan came back unreadable: scan again, and report it when it comes back"};
  progress(0.92, "noting what was seen");
  if (known->face == Face::kBack) return add_back(*known, *read);
  return propose(request, *known, std::move(*read), *folder);
}

// Of a series that was refused late it is in the data folder already.
std::filesystem::path ScanService::picture_of(const Tile& tile) const {
  return tile.stored ? library_.path_of(tile.stored->file) : tile.folder.path() / kMadeScan;
}

Result<std::vector<TakenTile>> ScanService::store_tiles(Face face) {
  std::vector<TakenTile> out;
  for (Tile& tile : tiles_) {
    if (!tile.stored) {
      auto stored = library_.adopt(picture_of(tile), "scans", to_string(face), kMostPixelsScanned);
      if (!stored) return stored.error();
      tile.stored = *std::move(stored);
    }
    out.push_back({tile.stored->file, tile.stored->sha256, tile.device, tile.taken_at, tile.view.nominal.dpi()});
  }
  return out;
}

Result<ScanOutcome> ScanService::propose(const ScanRequest& request, const Known& known, PanelRead read,
                                         const WorkFolder& folder) {
  const std::string pictures = known.panel ? "panels/" + known.panel->id.value : kProposals;
  auto map_file = library_.adopt(folder.path() / kMadeMap, pictures, "map");
  if (!map_file) return map_file.error();
  auto mask_file = library_.adopt(folder.path() / kMadeMask, pictures, "mask");
  if (!mask_file) return mask_file.error();
  auto tiles = store_tiles(Face::kShow);
  if (!tiles) return tiles.error();
  const bool later_map = known.later_map || std::ranges::any_of(read.warnings, is_lost_map);
  // A saw cuts where it has to.
  if (known.parent) std::erase_if(read.warnings, [](const ScanWarning& warning) { return warning.name == "size"; });
  SeenSheet seen{std::move(read), std::move(*tiles), map_file->file,         map_file->sha256, mask_file->file, {}, 0,
                 later_map,       known.parent,      known.parent_fiducials, known.suspects};
  if (known.panel) {
    seen.panel = known.panel->id, seen.after = known.panel->mask_version;
    // The first scan fixed its frame.
    seen.read.sheet = {};
    seen.read.sheet.add({});
    seen.read.sheet.add({known.panel->width, known.panel->height});
  }
  if (!known.panel && !known.parent) {
    auto doubts = doubts_about_sheet(seen.read.fiducials, known.stock);
    seen.read.warnings.insert(seen.read.warnings.end(), doubts.begin(), doubts.end());
  }
  auto outcome = proposals_.propose(std::move(seen), request.who);
  if (!outcome || !outcome->proposal || !request.accept) return outcome;
  const auto overruled = [&](const ScanWarning& warning) {
    return std::ranges::count(request.overrule, warning.name) > 0;
  };
  // Then it waits, and what it waits for is told.
  if (!std::ranges::all_of(outcome->warnings, overruled)) return outcome;
  std::vector<std::string> names;
  for (const ScanWarning& warning : outcome->warnings) names.push_back(warning.name);
  // What is refused now waits as a proposal, and needs no tile anew.
  tiles_.clear();
  return proposals_.accept(*outcome->proposal, names, request.who);
}

Result<ScanOutcome> ScanService::add_back(const Known& known, const PanelRead& read) {
  const PanelId& id = known.panel->id;
  const auto tiles = store_tiles(Face::kBack);
  if (!tiles) return tiles.error();
  const auto scans = scan_records(id, Face::kBack, *tiles, read);
  // Back tags are frozen once; a later look at the back adds its scans only.
  std::vector<db::FiducialRecord> fiducials;
  if (!known.fiducials.knows(Face::kBack)) fiducials = to_records(read.fiducials, Face::kBack);
  const auto new_tags = new_tag_records(read, Face::kBack);
  const Status added =
      database_.call([&](Repositories& r) { return r.panels.add_scans(id, scans, fiducials, new_tags); });
  if (!added) return added.error();
  ScanOutcome outcome;
  outcome.tiles = tiles_.size();
  outcome.panel = id;
  outcome.face = Face::kBack;
  outcome.rms = read.rms;
  outcome.max = read.max;
  outcome.left_out = read.left_out, outcome.new_tags = read.new_tags;
  outcome.warnings = read.warnings;
  return outcome;
}

}  // namespace veneer::daemon
