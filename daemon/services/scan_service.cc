#include "daemon/services/scan_service.h"
#include "daemon/services/panel_wood.h"

#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "base/clock.h"
#include "calib/april_grid.h"
#include "calib/stitcher.h"
#include "calib/veneer_mask.h"

namespace veneer::daemon {
namespace {

// Strips are convex, or nearly so.
std::vector<db::ZoneRecord> zones_of(const calib::VeneerMask& mask) {
  std::vector<db::ZoneRecord> out;
  for (const calib::Zone& zone : mask.list) {
    std::vector<cv::Point> pixels, hull;
    cv::findNonZero(mask.zones.pixels == zone.label, pixels);
    if (pixels.size() < 3) continue;
    cv::convexHull(pixels, hull);
    db::ZoneRecord& record = out.emplace_back();
    record.number = zone.label;
    for (const auto& p : hull) record.outline.push_back(mask.zones.from_pixels(p.x + 0.5, p.y + 0.5));
  }
  return out;
}

}  // namespace

std::string lattice_text(const calib::ScanMap& panel_from_scan, int width_px, int height_px) {
  constexpr int kStep = 64;  // 5.4 mm at 300 dpi: the scanner's map bends far more slowly
  const int columns = (width_px + kStep - 1) / kStep + 1, rows = (height_px + kStep - 1) / kStep + 1;
  nlohmann::json panel_mm = nlohmann::json::array();
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      const auto p = panel_from_scan * point<ScanFrame>(c * kStep, r * kStep);
      panel_mm.push_back({p.x.count(), p.y.count()});
    }
  return nlohmann::json{
      {"origin_px", {0, 0}}, {"step_px", kStep}, {"cols", columns}, {"rows", rows}, {"panel_mm", panel_mm}}
      .dump();
}

ScanService::ScanService(ScannerDriver& scanner, DatabaseThread& database, const PanelLibrary& library, double dpi,
                         Logger log)
    : scanner_(scanner),
      database_(database),
      library_(library),
      resolution_(ScanResolution::from_dpi(dpi)),
      log_(std::move(log)) {}

Result<ScanOutcome> ScanService::add_tile(const ScanRequest& request, const TaskProgress& progress,
                                          const std::stop_token& stop) {
  progress(0.02, "scanning");
  auto image = scanner_.scan(
      resolution_, [&](double f) { progress(0.02 + 0.38 * f, "scanning"); }, stop);
  if (!image) return image.error();
  progress(0.4, "looking for tags and holes");
  const std::string name = image->device;
  calib::TileView view = calib::view_tile(image->pixels, image->nominal, name);
  if (view.tags.empty())
    return Error{ErrorCode::kRefused,
                 "no fiducials found on the scan: lay a panel on the glass, tags down, and scan again"};
  // Tiles of the other face that were never finished belong to nothing.
  if (std::exchange(face_of_tiles_, request.face) != request.face) tiles_.clear();
  tiles_.push_back({std::move(*image), std::move(view)});
  if (request.more) {
    ScanOutcome outcome;
    outcome.tiles = tiles_.size();
    outcome.face = request.face;
    return outcome;
  }
  auto outcome = finish(request, progress);
  // Good or bad, this series of tiles is over; a refused one is scanned anew.
  tiles_.clear();
  return outcome;
}

Result<ScanService::Known> ScanService::identify(const ScanRequest& request) {
  struct Stock {
    std::vector<db::PanelRecord> panels;
    std::map<PanelId, calib::PanelFiducials> fiducials;
  };
  auto stock = database_.call([](Repositories& r) -> Result<Stock> {
    auto panels = r.panels.list();
    if (!panels) return panels.error();
    Stock out{std::move(*panels), {}};
    for (const auto& panel : out.panels) {
      auto fiducials = r.panels.fiducials(panel.id);
      if (!fiducials) return fiducials.error();
      out.fiducials[panel.id] = to_calib(*fiducials);
    }
    return out;
  });
  if (!stock) return stock.error();

  Known known;
  known.face = request.face;
  // The tags say which panel and which face this is, where they are known.
  std::map<std::pair<PanelId, Face>, int> votes;
  for (const auto& tile : tiles_)
    for (const auto& tag : tile.view.tags)
      for (const auto& [id, fiducials] : stock->fiducials)
        if (const auto* t = fiducials.tag(tag.id)) ++votes[{id, t->face}];
  std::optional<PanelId> wanted = request.panel;
  int most = 0;
  for (const auto& [where, count] : votes)
    if (count > most) {
      most = count;
      if (!request.panel) wanted = where.first;
      if (!request.panel || *request.panel == where.first) known.face = where.second;
    }
  for (const auto& panel : stock->panels)
    if (wanted && panel.id == *wanted) known.panel = panel;
  if (wanted && !known.panel)
    return Error{ErrorCode::kNotFound, fmt::format("there is no panel {}: see veneerctl panel list", wanted->value)};
  if (!known.panel && request.face == Face::kBack)
    return Error{
        ErrorCode::kInvalidArgument,
        "these back tags are new: name the panel they belong to, as in veneerctl panel scan --face back --panel "
        "P-0001"};
  if (known.panel) known.fiducials = stock->fiducials[known.panel->id];
  const calib::AprilGrid grid;
  for (int i = 0; i < grid.tags(); ++i) known.foreign_tags.insert(grid.first_id + i);
  for (const auto& [id, fiducials] : stock->fiducials)
    if (!known.panel || id != known.panel->id)
      for (const auto& tag : fiducials.tags) known.foreign_tags.insert(tag.id);
  return known;
}

Result<ScanOutcome> ScanService::finish(const ScanRequest& request, const TaskProgress& progress) {
  progress(0.45, "registering");
  auto calibration = database_.call([](Repositories& r) { return load_calibration(r, utc_timestamp()); });
  if (!calibration) return calibration.error();
  if (const Status ready = require_scanner(*calibration); !ready) return ready.error();
  for (const auto& tile : tiles_)
    if (const Status same = require_scan_size(*calibration, tile.image.pixels.cols, tile.image.pixels.rows); !same)
      return same.error();
  auto known = identify(request);
  if (!known) return known.error();

  std::vector<calib::TileView> views;
  for (const auto& tile : tiles_) views.push_back(tile.view);
  calib::RegistrationOptions options;
  options.foreign_tags = known->foreign_tags;
  auto registration = known->panel
                          ? calib::register_scan(views, known->face, known->fiducials, *calibration->scanner, options)
                          : calib::register_first_scan(views, *calibration->scanner, options);
  if (!registration) return registration.error();
  if (!known->panel) return add_panel(*registration, progress);
  if (known->face == Face::kBack) return add_back(*known, *registration);
  return scan_again(*known, *registration, progress);
}

Result<std::vector<db::ScanRecord>> ScanService::store_scans(const PanelId& panel, Face face,
                                                             const calib::Registration& registration) {
  std::vector<db::ScanRecord> records;
  for (std::size_t i = 0; i < tiles_.size(); ++i) {
    const auto& image = tiles_[i].image;
    auto stored = library_.store_picture(image.pixels, "scans", to_string(face));
    if (!stored) return stored.error();
    db::ScanRecord& record = records.emplace_back();
    record.panel = panel;
    record.face = face;
    record.device = image.device;
    record.file = stored->file;
    record.sha256 = stored->sha256;
    record.dpi = image.nominal.dpi();
    record.rms = registration.rms;
    record.max = registration.max;
    record.lattice = lattice_text(registration.tiles[i], image.pixels.cols, image.pixels.rows);
    record.taken_at = utc_timestamp();
  }
  return records;
}

Result<Raster<PanelFrame>> ScanService::stitch(const calib::Registration& registration,
                                               const Box<PanelFrame>& area) const {
  std::vector<calib::StitchTile> tiles;
  for (std::size_t i = 0; i < tiles_.size(); ++i) tiles.push_back({tiles_[i].image.pixels, registration.tiles[i]});
  calib::StitchOptions options;
  options.resolution = kMapResolution;
  return calib::stitch(tiles, area, options);
}

Result<ScanOutcome> ScanService::add_panel(const calib::Registration& registration, const TaskProgress& progress) {
  progress(0.55, "stitching");
  auto map = stitch(registration, registration.sheet);
  if (!map) return map.error();
  progress(0.75, "finding usable wood");
  auto mask = calib::mask_veneer(*map, registration.fiducials);
  if (!mask) return mask.error();
  progress(0.88, "entering stock");
  auto id = database_.call([](Repositories& r) { return r.panels.next_panel_id(); });
  if (!id) return id.error();
  auto map_file = library_.store_picture(map->pixels, "panels/" + id->value, "map");
  if (!map_file) return map_file.error();
  auto mask_file = library_.store_picture(mask->usable.pixels, "panels/" + id->value, "mask");
  if (!mask_file) return mask_file.error();
  auto scans = store_scans(*id, Face::kShow, registration);
  if (!scans) return scans.error();
  db::PanelRecord panel;
  panel.id = *id;
  panel.name = id->value;
  panel.width = registration.sheet.width();
  panel.height = registration.sheet.height();
  panel.map_file = map_file->file;
  panel.mask_file = mask_file->file;
  panel.map_hash = map_file->sha256;
  panel.created_at = utc_timestamp();
  const auto fiducials = to_records(registration.fiducials, Face::kShow);
  const Status added = database_.call([&](Repositories& r) -> Status {
    if (const Status entered = r.panels.add(panel, *scans, fiducials); !entered) return entered;
    return r.materials.add_zones(panel.id, zones_of(*mask));
  });
  if (!added) return added.error();
  ScanOutcome outcome;
  outcome.tiles = tiles_.size();
  outcome.panel = *id;
  outcome.is_new = true;
  outcome.rms = registration.rms;
  outcome.max = registration.max;
  outcome.usable = wood_area(mask->usable);
  outcome.zones = mask->list.size();
  log_->info("panel {} entered stock: {:.0f} x {:.0f} mm, {} zones", id->value, panel.width.count(),
             panel.height.count(), outcome.zones);
  return outcome;
}

Result<ScanOutcome> ScanService::add_back(const Known& known, const calib::Registration& registration) {
  const PanelId& id = known.panel->id;
  auto scans = store_scans(id, Face::kBack, registration);
  if (!scans) return scans.error();
  // Back tags are frozen once; a later look at the back adds its scans only.
  std::vector<db::FiducialRecord> fiducials;
  if (!known.fiducials.knows(Face::kBack)) fiducials = to_records(registration.fiducials, Face::kBack);
  const Status added = database_.call([&](Repositories& r) { return r.panels.add_scans(id, *scans, fiducials); });
  if (!added) return added.error();
  ScanOutcome outcome;
  outcome.tiles = tiles_.size();
  outcome.panel = id;
  outcome.face = Face::kBack;
  outcome.rms = registration.rms;
  outcome.max = registration.max;
  return outcome;
}

Result<ScanOutcome> ScanService::scan_again(const Known& known, const calib::Registration& registration,
                                            const TaskProgress& progress) {
  const db::PanelRecord& panel = *known.panel;
  progress(0.55, "stitching");
  auto before = library_.load_map(panel);
  if (!before) return before.error();
  Box<PanelFrame> area;
  area.add({});
  area.add(before->from_pixels(before->pixels.cols, 0));
  auto map = stitch(registration, area);
  if (!map) return map.error();
  progress(0.72, "comparing with the ledger");
  auto live = database_.call([&](Repositories& r) { return r.ledger.live_allocations(panel.id); });
  if (!live) return live.error();
  std::vector<Region<PanelFrame>> gone;
  for (const auto& allocation : *live)
    if (allocation.state == db::AllocationState::kCut || allocation.state == db::AllocationState::kScrap)
      gone.push_back(allocation.area);
  auto compared = calib::reconcile(*before, *map, gone, known.fiducials);
  if (!compared) return compared.error();
  progress(0.82, "finding usable wood");
  auto earlier = library_.load_mask(panel);
  if (!earlier) return earlier.error();
  auto mask = calib::mask_veneer(*map, known.fiducials, {}, &*earlier);
  if (!mask) return mask.error();
  progress(0.92, "entering stock");
  auto map_file = library_.store_picture(map->pixels, "panels/" + panel.id.value, "map");
  if (!map_file) return map_file.error();
  auto mask_file = library_.store_picture(mask->usable.pixels, "panels/" + panel.id.value, "mask");
  if (!mask_file) return mask_file.error();
  auto scans = store_scans(panel.id, Face::kShow, registration);
  if (!scans) return scans.error();
  const Status written = database_.call([&](Repositories& r) -> Status {
    if (const Status added = r.panels.add_scans(panel.id, *scans, {}); !added) return added;
    // A panel from before zones were kept gets them now.
    if (const Status zoned = r.materials.add_zones(panel.id, zones_of(*mask)); !zoned) return zoned;
    const auto version =
        r.panels.add_mask(panel.id, {0, map_file->file, mask_file->file, map_file->sha256, utc_timestamp()});
    return version ? Ok() : Status(version.error());
  });
  if (!written) return written.error();
  library_.drop_index(panel.id);
  ScanOutcome outcome;
  outcome.tiles = tiles_.size();
  outcome.panel = panel.id;
  outcome.rms = registration.rms;
  outcome.max = registration.max;
  outcome.usable = wood_area(mask->usable);
  outcome.zones = mask->list.size();
  outcome.differences = compared->differences;
  return outcome;
}

}  // namespace veneer::daemon
