#include "daemon/orders/scan_work.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "calib/stitcher.h"
#include "calib/veneer_mask.h"
#include "daemon/orders/packed_lattice.h"
#include "daemon/orders/panel_wood.h"
#include "daemon/orders/stored_picture.h"
#include "daemon/orders/strip_zones.h"
#include "planner/pictures/pictures.h"

namespace veneer::daemon {
namespace {

// Nearer to its outline than this a suspect piece may be charred, or lost its edge in the kerf.
constexpr Millimetres kBesideTheKerf(0.5);

calib::MaskOptions options_of(const RegisterScans& order) {
  calib::MaskOptions out;
  out.edge_margin = order.edge_margin, out.screw_margin = order.round_margin;
  return out;
}

Result<Raster<PanelFrame>> stitch(const RegisterScans& order, const calib::Registration& registration,
                                  const Box<PanelFrame>& area) {
  std::vector<calib::StitchTile> tiles;
  for (std::size_t i = 0; i < order.files.size(); ++i) {
    auto pixels = read_stored_picture(order.files[i]);
    if (!pixels) return pixels.error();
    tiles.push_back({*pixels, registration.tiles[i]});
  }
  calib::StitchOptions options;
  options.resolution = kMapResolution;
  return calib::stitch(tiles, area, options);
}

// Without the fringes that two scans of one border differ by.
cv::Mat patches_of(const cv::Mat& changed) {
  constexpr int kMillimetre = 11;  // pixels at 300 dpi, odd
  cv::Mat patches;
  cv::morphologyEx(changed, patches, cv::MORPH_OPEN,
                   cv::getStructuringElement(cv::MORPH_ELLIPSE, {kMillimetre, kMillimetre}));
  return patches;
}

// What the mask drops once a cut has parted it from the rest: patches that are too small, beside `cuts`.
void leave_out_scraps(cv::Mat& patches, const cv::Mat& cuts, double px_per_mm) {
  const double smallest = calib::MaskOptions{}.smallest_zone.count() * px_per_mm * px_per_mm;
  cv::Mat labels, stats, centroids;
  const int count = cv::connectedComponentsWithStats(patches, labels, stats, centroids);
  std::vector<bool> dropped(static_cast<std::size_t>(count), false);
  for (int row = 0; row < labels.rows; ++row)
    for (int column = 0; column < labels.cols; ++column)
      if (const int label = labels.at<int>(row, column); label > 0 && cuts.at<unsigned char>(row, column) != 0)
        dropped[static_cast<std::size_t>(label)] = stats.at<int>(label, cv::CC_STAT_AREA) < smallest;
  for (int row = 0; row < labels.rows; ++row)
    for (int column = 0; column < labels.cols; ++column)
      if (dropped[static_cast<std::size_t>(labels.at<int>(row, column))]) patches.at<unsigned char>(row, column) = 0;
}

// What accepting the new mask would do to the free wood.
void compare_wood(const RegisterScans& order, const Raster<PanelFrame>& earlier, const Raster<PanelFrame>& now,
                  PanelRead& out) {
  // The mask keeps away from the edges of cuts.
  const Millimetres beside_cuts = order.edge_margin + Millimetres(1), next_to = order.edge_margin + Millimetres(1.5);
  std::vector<Region<PanelFrame>> held = order.held;
  held.insert(held.end(), order.gone.begin(), order.gone.end());
  const auto like = [&](cv::Mat pixels) { return Raster<PanelFrame>{std::move(pixels), now.resolution, now.origin}; };
  const auto minus = [&](const Raster<PanelFrame>& a, const Raster<PanelFrame>& b) {
    cv::Mat rest = a.pixels.clone();
    rest.setTo(0, b.pixels);
    return like(rest);
  };
  // Of suspect pieces nobody knows whether they are cuts.
  const auto free_before = free_wood(minus(earlier, now), order.held, Millimetres(0));
  const auto lost = free_wood(free_wood(free_before, order.gone, beside_cuts), order.suspects, beside_cuts);
  cv::Mat patches = patches_of(lost.pixels);
  const auto away = free_wood(like(cv::Mat(now.pixels.size(), CV_8UC1, cv::Scalar(255))), order.gone, next_to);
  leave_out_scraps(patches, ~away.pixels, now.resolution.px_per_mm);
  out.lost = wood_area(like(patches));
  out.gained = wood_area(like(patches_of(free_wood(minus(now, earlier), held, Millimetres(0)).pixels)));
}

// The map's picture and its mask's, into the folder.
Status write_panel(const Raster<PanelFrame>& map, const calib::VeneerMask& mask, const std::filesystem::path& folder,
                   PanelRead& out) {
  if (Status written = write_stored_picture(map.pixels, folder / kMadeMap); !written) return written;
  out.zones = zones_of(mask), out.asked = mask.asked;
  out.usable = wood_area(mask.usable);
  return write_stored_picture(mask.usable.pixels, folder / kMadeMask);
}

void judge_exposure(const Raster<PanelFrame>& map, const Raster<PanelFrame>& wood, PanelRead& out) {
  std::ranges::move(doubts_of_exposure(calib::measure_exposure(map.pixels, wood.pixels)),
                    std::back_inserter(out.warnings));
}

Status read_new_panel(const RegisterScans& order, const calib::Registration& registration,
                      const std::filesystem::path& folder, const TaskProgress& progress, PanelRead& out) {
  progress(0.55, "stitching");
  auto map = stitch(order, registration, registration.sheet);
  if (!map) return map.error();
  progress(0.75, "finding usable wood");
  // A tag that counts for nothing is no wood all the same.
  calib::PanelFiducials covered = registration.fiducials;
  for (const calib::SpoiledTag& spoiled : registration.spoiled) covered.tags.push_back(spoiled.tag);
  auto mask = calib::mask_veneer(*map, covered, options_of(order));
  if (!mask) return mask.error();
  std::ranges::move(doubts_of_first_scan(order.views, registration, *mask), std::back_inserter(out.warnings));
  judge_exposure(*map, mask->usable, out);
  return write_panel(*map, *mask, folder, out);
}

// A picture of the panel that was kept; nothing where it is lost: it cannot be read, or is of another size or type than
// `map` says, and so of another map.
std::optional<Raster<PanelFrame>> read_kept(const std::string& file, const Raster<PanelFrame>& map, int type) {
  auto kept = read_stored_raster(file);
  if (!kept || kept->pixels.size() != map.pixels.size() || kept->pixels.type() != type) return std::nullopt;
  return *std::move(kept);
}

// What any of the masks calls wood, and what was told as gone since. Nothing when one is lost: there may be wood that
// only that one knew, and nobody would ask after it.
std::optional<Raster<PanelFrame>> believed_wood(const RegisterScans& order, const Raster<PanelFrame>& map,
                                                std::vector<ScanWarning>& warnings) {
  std::optional<Raster<PanelFrame>> wood;
  for (const std::string& file : order.wood_masks) {
    auto mask = read_kept(file, map, CV_8UC1);
    if (!mask) {
      warnings.push_back(doubt_of_lost_mask(file));
      return std::nullopt;
    }
    if (wood)
      wood->pixels |= mask->pixels;
    else
      wood = *std::move(mask);
  }
  if (wood) add_wood(*wood, order.told_gone);
  return wood;
}

struct OldMap {
  std::string file;
  Raster<PanelFrame> map;
};

// The oldest map that can be read and is as large as the panel: a size that a file alone tells would be that of a new
// map and mask. The database keeps whole micrometres, and a map begun pixels.
Result<OldMap> oldest_map(const RegisterScans& order, std::vector<ScanWarning>& warnings) {
  constexpr double kRounded = 0.01;  // pixels
  const auto fits = [](int pixels, Millimetres length) {
    const double begun = pixels - kMapResolution.to_px(length).count();
    return begun > -kRounded && begun < 1 + kRounded;
  };
  for (const std::string& file : order.maps) {
    auto map = read_stored_raster(file);
    if (map && map->pixels.type() == CV_8UC3 && fits(map->pixels.cols, order.width) &&
        fits(map->pixels.rows, order.height)) {
      if (file != order.maps.front()) warnings.push_back(doubt_of_lost_map(order.maps.front()));
      return OldMap{file, *std::move(map)};
    }
  }
  return Error{
      ErrorCode::kStorage,
      fmt::format("no map of this panel can be read, and a scan of it is compared with one: put {} back from a "
                  "backup and scan again",
                  order.maps.empty() ? order.earlier_map : order.maps.front())};
}

// The mask of a panel that had one: what was not usable then is not now, where both that mask and its map are left.
Result<calib::VeneerMask> mask_again(const RegisterScans& order, OldMap oldest, const Raster<PanelFrame>& map,
                                     PanelRead& out) {
  const auto usable = read_kept(order.earlier_mask, map, CV_8UC1);
  std::optional<Raster<PanelFrame>> before = std::move(oldest.map);
  if (order.earlier_map != oldest.file) {
    before.reset();  // there is no room for two more maps of a large panel
    before = read_kept(order.earlier_map, map, map.pixels.type());
  }
  std::optional<calib::EarlierLook> look;
  std::optional<ScanWarning> lost;
  if (usable && before)
    look.emplace(calib::EarlierLook{*before, *usable});
  else
    lost = doubt_of_lost_look(usable ? order.earlier_map : order.earlier_mask);
  auto mask = calib::mask_veneer(map, *order.known, options_of(order), look ? &*look : nullptr);
  // Of the wood as it was known: what looks otherwise now is not in the new mask.
  if (usable) judge_exposure(map, *usable, out);
  // It may be for want of that look.
  if (!mask && lost) return Error{mask.error().code, fmt::format("{}; {}", mask.error().message, lost->text)};
  if (lost) out.warnings.push_back(*std::move(lost));
  if (mask && usable) compare_wood(order, *usable, mask->usable, out);
  return mask;
}

Status read_known_panel(const RegisterScans& order, const calib::Registration& registration,
                        const std::filesystem::path& folder, const TaskProgress& progress, PanelRead& out) {
  progress(0.55, "stitching");
  // With what was there at first: wood that is gone is told by each scan until it is booked, not by the next one only.
  auto oldest = oldest_map(order, out.warnings);
  if (!oldest) return oldest.error();
  const Raster<PanelFrame>& before = oldest->map;
  Box<PanelFrame> area;
  area.add({});
  area.add(before.from_pixels(before.pixels.cols, 0));
  auto map = stitch(order, registration, area);
  if (!map) return map.error();
  progress(0.72, "comparing with the ledger");
  const auto wood = believed_wood(order, *map, out.warnings);
  calib::ReconcileOptions options;
  for (const auto& suspect : order.suspects) options.uncertain.push_back(suspect);
  auto compared = calib::reconcile(before, *map, order.gone, *order.known, options, wood ? &*wood : nullptr);
  if (!compared) return compared.error();
  std::ranges::move(doubts_of_comparison(*compared), std::back_inserter(out.warnings));
  out.differences = std::move(compared->differences);
  for (const auto& suspect : order.suspects)
    out.suspects_gone.push_back(calib::share_gone(compared->gone_mask, suspect, kBesideTheKerf));
  progress(0.82, "finding usable wood");
  const auto mask = mask_again(order, *std::move(oldest), *map, out);
  if (!mask) return mask.error();
  std::ranges::move(doubts_of_mask(*mask), std::back_inserter(out.warnings));
  return write_panel(*map, *mask, folder, out);
}

}  // namespace

std::string lattice_text(const calib::ScanMap& panel_from_scan, int width_px, int height_px,
                         const std::vector<calib::FiducialOffset>& offsets) {
  // 5.4 mm at 300 dpi: the scanner's map bends far more slowly. Farther apart where there are more pixels, for all
  // tiles together are one line of an answer.
  constexpr int kMostPoints = 10'000;
  int step = 64, columns = 0, rows = 0;
  for (;; step *= 2) {
    columns = (width_px + step - 1) / step + 1, rows = (height_px + step - 1) / step + 1;
    if (static_cast<std::int64_t>(columns) * rows <= kMostPoints) break;
  }
  const auto rounded = [](Millimetres length) { return std::round(length.count() * 1e5) / 1e5; };
  nlohmann::json panel_mm = nlohmann::json::array();
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      const auto p = panel_from_scan * point<ScanFrame>(c * step, r * step);
      panel_mm.push_back({rounded(p.x), rounded(p.y)});
    }
  nlohmann::json out = {
      {"origin_px", {0, 0}}, {"step_px", step}, {"cols", columns}, {"rows", rows}, {"panel_mm", std::move(panel_mm)}};
  if (!offsets.empty()) out[kLatticeFiducials] = lattice_fiducials(offsets);
  return out.dump();
}

Result<ScanView> view_scan(const ViewScan& order, const std::filesystem::path& folder, const TaskProgress& progress) {
  auto picture = planner::load_scan(order.file);
  if (!picture) return picture.error();
  auto doubts = doubts_of_resolution(order.name, picture->dpi_x, picture->dpi_y, order.nominal);
  if (!doubts) return doubts.error();
  if (const Status written = write_stored_picture(picture->pixels, folder / kMadeScan); !written)
    return written.error();
  progress(0.4, "looking for tags and holes");
  ScanView out{calib::view_tile(picture->pixels, order.nominal, order.name), *std::move(doubts)};
  std::ranges::move(
      doubts_of_sharpness(order.name, calib::measure_sharpness(picture->pixels, out.tile.tags, order.nominal),
                          order.nominal),
      std::back_inserter(out.warnings));
  return out;
}

Result<PanelRead> register_scans(const RegisterScans& order, const std::filesystem::path& folder,
                                 const TaskProgress& progress) {
  progress(0.45, "registering");
  const calib::ScannerModel scanner(order.scanner);
  calib::RegistrationOptions options;
  options.foreign_tags = order.foreign_tags;
  options.retag = order.retag;
  auto registration = order.known ? calib::register_scan(order.views, order.face, *order.known, scanner, options)
                                  : calib::register_first_scan(order.views, scanner, options);
  if (!registration) return registration.error();
  PanelRead out;
  out.rms = registration->rms, out.max = registration->max;
  out.fiducials = registration->fiducials;
  out.sheet = registration->sheet;
  out.edge_margin = order.edge_margin, out.round_margin = order.round_margin;
  for (std::size_t i = 0; i < order.views.size(); ++i)
    out.lattices.push_back(lattice_text(
        registration->tiles[i], order.views[i].width_px, order.views[i].height_px,
        registration->agreement.empty() ? std::vector<calib::FiducialOffset>() : registration->agreement[i].offsets));
  out.new_tags = registration->new_tags;
  if (!registration->left_out.empty())
    out.left_out = std::ranges::max(registration->left_out, {}, &calib::FiducialOffset::off).off;
  out.warnings = doubts_of_tags(*registration);
  std::ranges::move(doubts_of_fiducials(order.views, *registration), std::back_inserter(out.warnings));
  if (order.retag && out.new_tags.empty())
    out.warnings.push_back({"no-new-tag",
                            "no tag is seen that the panel did not have, so that none became its own: glue one on with "
                            "a number that was never used, and scan with --retag again"});
  if (order.known && order.face == Face::kBack) return out;
  const Status read = order.known ? read_known_panel(order, *registration, folder, progress, out)
                                  : read_new_panel(order, *registration, folder, progress, out);
  if (!read) return read.error();
  return out;
}

}  // namespace veneer::daemon
