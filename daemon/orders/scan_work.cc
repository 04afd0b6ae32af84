#include "daemon/orders/scan_work.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "calib/stitcher.h"
#include "calib/veneer_mask.h"
#include "daemon/orders/panel_wood.h"
#include "daemon/orders/stored_picture.h"
#include "planner/pictures/pictures.h"

namespace veneer::daemon {
namespace {

// Nearer to its outline than this a suspect piece may be charred, or lost its edge in the kerf.
constexpr Millimetres kBesideTheKerf(0.5);

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

constexpr std::size_t kNamedHairs = 3;  // in one sentence

// What the mask withholds because it is in doubt; places as the operator measures them, from the lower left corner.
std::vector<std::string> warnings_of(const calib::VeneerMask& mask) {
  std::vector<std::string> out;
  for (const calib::AskedStrip& strip : mask.asked) {
    Box<PanelFrame> box;
    for (const auto& corner : strip.outline) box.add(corner);
    const auto place = fmt::format("{:.0f} to {:.0f} mm from the left and {:.0f} to {:.0f} mm from the lower edge",
                                   box.min.x.count(), box.max.x.count(), box.min.y.count(), box.max.y.count());
    if (strip.taken)
      out.push_back(fmt::format("of the strip at {} some is left out of the usable wood: {}", place, strip.reason));
    else
      out.push_back(
          fmt::format("what looks like a strip at {} is left out of the usable wood: {}", place, strip.reason));
  }
  if (mask.hairs.empty()) return out;
  std::vector<std::string> places;
  for (const calib::HairOnGlass& hair : mask.hairs) {
    if (places.size() == kNamedHairs) break;
    places.push_back(fmt::format("{:.0f} mm from the left and {:.0f} mm from the lower edge ({:.0f} mm long)",
                                 hair.middle.x.count(), hair.middle.y.count(), hair.length.count()));
  }
  const std::size_t more = mask.hairs.size() - places.size();
  out.push_back(
      fmt::format("dust or a hair lies on the glass over the wood, at {}{}: what it hides is left out; clean the glass "
                  "and scan again",
                  fmt::join(places, "; at "), more > 0 ? fmt::format("; and at {} more places", more) : ""));
  return out;
}

// The map's picture and its mask's, into the folder.
Status write_panel(const Raster<PanelFrame>& map, const calib::VeneerMask& mask, const std::filesystem::path& folder,
                   PanelRead& out) {
  if (Status written = write_stored_picture(map.pixels, folder / kMadeMap); !written) return written;
  out.zones = zones_of(mask);
  out.usable = wood_area(mask.usable);
  out.warnings = warnings_of(mask);
  return write_stored_picture(mask.usable.pixels, folder / kMadeMask);
}

Status read_new_panel(const RegisterScans& order, const calib::Registration& registration,
                      const std::filesystem::path& folder, const TaskProgress& progress, PanelRead& out) {
  progress(0.55, "stitching");
  auto map = stitch(order, registration, registration.sheet);
  if (!map) return map.error();
  progress(0.75, "finding usable wood");
  auto mask = calib::mask_veneer(*map, registration.fiducials);
  if (!mask) return mask.error();
  return write_panel(*map, *mask, folder, out);
}

Status read_known_panel(const RegisterScans& order, const calib::Registration& registration,
                        const std::filesystem::path& folder, const TaskProgress& progress, PanelRead& out) {
  progress(0.55, "stitching");
  // With what was there at first: wood that is gone is told by each scan until it is booked, not by the next one only.
  auto before = read_stored_raster(order.first_map);
  if (!before) return before.error();
  Box<PanelFrame> area;
  area.add({});
  area.add(before->from_pixels(before->pixels.cols, 0));
  auto map = stitch(order, registration, area);
  if (!map) return map.error();
  progress(0.72, "comparing with the ledger");
  auto compared = calib::reconcile(*before, *map, order.gone, *order.known);
  if (!compared) return compared.error();
  out.differences = std::move(compared->differences);
  for (const auto& suspect : order.suspects)
    out.suspects_gone.push_back(calib::share_gone(compared->gone_mask, suspect, kBesideTheKerf));
  progress(0.82, "finding usable wood");
  if (order.earlier_map != order.first_map) before = read_stored_raster(order.earlier_map);
  if (!before) return before.error();
  auto earlier = read_stored_raster(order.earlier_mask);
  if (!earlier) return earlier.error();
  const calib::EarlierLook look{*before, *earlier};
  auto mask = calib::mask_veneer(*map, *order.known, {}, &look);
  if (!mask) return mask.error();
  return write_panel(*map, *mask, folder, out);
}

}  // namespace

std::string lattice_text(const calib::ScanMap& panel_from_scan, int width_px, int height_px) {
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
  return nlohmann::json{
      {"origin_px", {0, 0}}, {"step_px", step}, {"cols", columns}, {"rows", rows}, {"panel_mm", panel_mm}}
      .dump();
}

Result<calib::TileView> view_scan(const ViewScan& order, const std::filesystem::path& folder,
                                  const TaskProgress& progress) {
  auto picture = planner::load_picture(order.file);
  if (!picture) return picture.error();
  if (const Status written = write_stored_picture(*picture, folder / kMadeScan); !written) return written.error();
  progress(0.4, "looking for tags and holes");
  return calib::view_tile(*picture, order.nominal, order.name);
}

Result<PanelRead> register_scans(const RegisterScans& order, const std::filesystem::path& folder,
                                 const TaskProgress& progress) {
  progress(0.45, "registering");
  const calib::ScannerModel scanner(order.scanner);
  calib::RegistrationOptions options;
  options.foreign_tags = order.foreign_tags;
  auto registration = order.known ? calib::register_scan(order.views, order.face, *order.known, scanner, options)
                                  : calib::register_first_scan(order.views, scanner, options);
  if (!registration) return registration.error();
  PanelRead out;
  out.rms = registration->rms, out.max = registration->max;
  out.fiducials = registration->fiducials;
  out.sheet = registration->sheet;
  for (std::size_t i = 0; i < order.views.size(); ++i)
    out.lattices.push_back(lattice_text(registration->tiles[i], order.views[i].width_px, order.views[i].height_px));
  if (order.known && order.face == Face::kBack) return out;
  const Status read = order.known ? read_known_panel(order, *registration, folder, progress, out)
                                  : read_new_panel(order, *registration, folder, progress, out);
  if (!read) return read.error();
  return out;
}

}  // namespace veneer::daemon
