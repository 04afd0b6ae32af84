#include "daemon/stock/scan_service.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "base/clock.h"
#include "base/hash.h"
#include "daemon/orders/have_done.h"
#include "daemon/orders/scan_json.h"
#include "daemon/stock/plausible_read.h"
#include "daemon/stock/sheet_doubts.h"

namespace veneer::daemon {
namespace {

constexpr const char* kProposals = "proposals";  // their pictures, until they are decided

}  // namespace

ScanService::ScanService(ScannerDriver& scanner, DatabaseThread& database, const PanelLibrary& library,
                         WorkRunner& workers, ScanProposals& proposals, const Config& config)
    : scanner_(scanner),
      database_(database),
      library_(library),
      workers_(workers),
      proposals_(proposals),
      config_(config),
      series_(library) {}

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
    if (request.anew) series_.give_up();
    if (const Status added = series_.add(*std::move(tile), request); !added) return added.error();
    if (!request.more) return series_.end(request, [&] { return finish(request, progress, stop); });
    series_.note_open(request);
    ScanOutcome outcome;
    outcome.tiles = series_.tiles().size();
    outcome.face = request.face;
    return outcome;
  }
  const auto whole = series_.as_refused(request);
  if (!whole) return whole.error();
  auto tile = scan_new_tile(progress, stop);
  if (!tile) return tile.error();
  series_.replace(*request.again, *std::move(tile));
  return series_.end(*whole, [&] { return finish(*whole, progress, stop); });
}

Result<ScanTile> ScanService::scan_tile(const TaskProgress& progress, const std::stop_token& stop) {
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
  return ScanTile{std::move(*folder),
                  scan->device,
                  scan->make,
                  std::move(view->tile),
                  std::move(view->warnings),
                  content ? *content : std::string(),
                  {}};
}

// A scanner that reads a folder gives its pictures in turn: the one that was put there anew comes after the others.
Result<ScanTile> ScanService::scan_new_tile(const TaskProgress& progress, const std::stop_token& stop) {
  std::string device;
  for (std::size_t turn = 0; turn <= series_.tiles().size(); ++turn) {
    auto tile = scan_tile(progress, stop);
    if (!tile || !series_.is_there(*tile)) return tile;
    device = tile->device;
    if (stop.stop_requested()) return Error{ErrorCode::kCancelled, "the scan was cancelled"};
  }
  return picture_of_series(device);
}

// What the worker is told; of a panel that is known also what the ledger holds of it.
Result<RegisterScans> ScanService::ask_of(KnownSheet& known, const calib::ScannerModelData& scanner, WorkOrder& work) {
  RegisterScans wanted;
  for (const auto& tile : series_.tiles()) {
    wanted.views.push_back(tile.view);
    wanted.files.push_back(series_.picture_of(tile).string());
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
  const auto& tiles = series_.tiles();
  for (const auto& tile : tiles) {
    if (const Status same = require_make(*calibration, tile.make); !same) return same.error();
    if (const Status same = require_scan_size(*calibration, tile.view.width_px, tile.view.height_px); !same)
      return same.error();
  }
  auto known = identify(database_, request, tiles);
  if (!known) return known.error();
  if (const Status news = require_news(database_, *known, tiles); !news) return news.error();

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
  for (const ScanTile& tile : tiles)
    for (const ScanWarning& warning : tile.warnings)
      if (!(known->face == Face::kBack && is_of_sharpness(warning.name)) &&
          std::ranges::find(read->warnings, warning.name, &ScanWarning::name) == read->warnings.end())
        read->warnings.push_back(warning);
  if (!is_plausible(*read, tiles.size(), known->suspects.size()))
    return Error{ErrorCode::kInternal, "the scan came back unreadable: scan again, and report it when it comes back"};
  progress(0.92, "noting what was seen");
  if (known->face == Face::kBack) return add_back(*known, *read);
  return propose(request, *known, std::move(*read), *folder);
}

Result<ScanOutcome> ScanService::propose(const ScanRequest& request, const KnownSheet& known, PanelRead read,
                                         const WorkFolder& folder) {
  const std::string pictures = known.panel ? "panels/" + known.panel->id.value : kProposals;
  auto map_file = library_.adopt(folder.path() / kMadeMap, pictures, "map");
  if (!map_file) return map_file.error();
  auto mask_file = library_.adopt(folder.path() / kMadeMask, pictures, "mask");
  if (!mask_file) return mask_file.error();
  auto tiles = series_.store(Face::kShow);
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
  series_.clear();
  return proposals_.accept(*outcome->proposal, names, request.who);
}

Result<ScanOutcome> ScanService::add_back(const KnownSheet& known, const PanelRead& read) {
  const PanelId& id = known.panel->id;
  const auto tiles = series_.store(Face::kBack);
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
  outcome.tiles = series_.tiles().size();
  outcome.panel = id;
  outcome.face = Face::kBack;
  outcome.rms = read.rms;
  outcome.max = read.max;
  outcome.left_out = read.left_out, outcome.new_tags = read.new_tags;
  outcome.warnings = read.warnings;
  return outcome;
}

}  // namespace veneer::daemon
