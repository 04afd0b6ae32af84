#include "tests/support/holed_panels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "calib/registration.h"
#include "calib/stitcher.h"
#include "calib/veneer_mask.h"
#include "drivers/sim/placing.h"
#include "drivers/sim/scanner.h"
#include "drivers/sim/sheet_maker.h"

namespace veneer::workshop {
namespace {

constexpr double kDpi = 300;
constexpr double kHoleStep = 0.1, kWoodStep = 0.5;  // mm between the places that are looked at
constexpr double kFromEdge = 1.2, kFromHole = 2.0;  // mm from a strip's edge and a hole's rim, where wood is sound

std::vector<cv::Point2f> outline_of(const sim::SpeciesZone& zone) {
  std::vector<cv::Point2f> out;
  for (const sim::Vec2& p : zone.outline) out.emplace_back(static_cast<float>(p.x), static_cast<float>(p.y));
  return out;
}

sim::TwinSettings settings_of(const HoledPanelOrder& order, const sim::PanelOrder& panel) {
  sim::TwinSettings settings;
  settings.seed = order.seed * 1009 + static_cast<std::uint64_t>(order.panel);
  settings.rough = panel.rough;
  const double across = std::hypot(panel.width_mm, panel.height_mm) + 10;  // it may lie in any quarter turn
  settings.scanner.width_mm = across, settings.scanner.height_mm = across;
  return settings;
}

sim::PanelOrder panel_of(const HoledPanelOrder& order) {
  sim::Random random(order.seed, "holed panel", static_cast<std::uint64_t>(order.panel));
  sim::PanelOrder panel;
  panel.name = "panel";
  panel.width_mm = random.uniform(190, 270), panel.height_mm = random.uniform(130, 180);
  panel.dpi = sim::TwinSettings().sheet_dpi;
  panel.seed = random.next();
  panel.rough = *sim::roughness_preset(order.preset);
  return panel;
}

// The mask of one scan, asked by places of the sheet.
class SheetMask {
 public:
  SheetMask(const sim::ScanTruth& scan, const calib::ScanMap& panel_from_scan, const calib::VeneerMask& mask)
      : scan_(scan), panel_from_scan_(panel_from_scan), mask_(mask) {}

  bool takes(sim::Vec2 on_sheet) const {
    double column = 0, row = 0;
    mask_.usable.to_pixels(on_panel(on_sheet), column, row);
    const cv::Point at(static_cast<int>(std::floor(column)), static_cast<int>(std::floor(row)));
    return cv::Rect({}, mask_.usable.pixels.size()).contains(at) && mask_.usable.pixels.at<std::uint8_t>(at) != 0;
  }
  bool is_asked_about(sim::Vec2 on_sheet) const {
    const Point<PanelFrame> at = on_panel(on_sheet);
    return std::ranges::any_of(mask_.asked, [&](const calib::AskedStrip& asked) {
      std::vector<cv::Point2f> outline;
      for (const auto& p : asked.outline)
        outline.emplace_back(static_cast<float>(p.x.count()), static_cast<float>(p.y.count()));
      return cv::pointPolygonTest(
                 outline, cv::Point2f(static_cast<float>(at.x.count()), static_cast<float>(at.y.count())), false) >= 0;
    });
  }

 private:
  Point<PanelFrame> on_panel(sim::Vec2 on_sheet) const {
    const sim::Vec2 pixel = scan_.scan_pixel(on_sheet);
    return panel_from_scan_ * Point<ScanFrame>{Pixels(pixel.x), Pixels(pixel.y)};
  }

  const sim::ScanTruth& scan_;
  const calib::ScanMap& panel_from_scan_;
  const calib::VeneerMask& mask_;
};

double share_taken(const SheetMask& mask, const sim::TrueHole& hole) {
  const double radius = hole.diameter_mm / 2;
  double all = 0, taken = 0;
  for (double y = -radius; y <= radius; y += kHoleStep)
    for (double x = -radius; x <= radius; x += kHoleStep) {
      if (std::hypot(x, y) > radius) continue;
      all += 1, taken += mask.takes(hole.centre + sim::Vec2{x, y}) ? 1 : 0;
    }
  return taken / all;
}

void judge_wood(const sim::Sheet& sheet, const SheetMask& mask, HoledPanelVerdict& out) {
  std::vector<std::vector<cv::Point2f>> outlines;
  for (const sim::SpeciesZone& zone : sheet.zones) outlines.push_back(outline_of(zone));
  for (double y = kWoodStep / 2; y < sheet.height_mm; y += kWoodStep)
    for (double x = kWoodStep / 2; x < sheet.width_mm; x += kWoodStep) {
      const sim::Vec2 at{x, y};
      double within = -1e9;
      for (const auto& outline : outlines)
        within = std::max(
            within, cv::pointPolygonTest(outline, cv::Point2f(static_cast<float>(x), static_cast<float>(y)), true));
      const bool by_a_hole = std::ranges::any_of(sheet.screw_holes, [&](const sim::TrueHole& hole) {
        return sim::length(hole.centre - at) < hole.diameter_mm / 2 + kFromHole;
      });
      const double area = kWoodStep * kWoodStep;
      if (within < -kHoleStep) {
        out.beside += mask.takes(at) ? area : 0;
      } else if (within > kFromEdge && !by_a_hole) {
        out.wood += area, out.wood_taken += mask.takes(at) ? area : 0;
      }
    }
}

const std::string& species_at(const sim::Sheet& sheet, sim::Vec2 at) {
  static const std::string none;
  const cv::Point2f point(static_cast<float>(at.x), static_cast<float>(at.y));
  for (const sim::SpeciesZone& zone : sheet.zones)
    if (cv::pointPolygonTest(outline_of(zone), point, false) >= 0) return zone.species;
  return none;
}

}  // namespace

HoledPanelVerdict judge_holes(const HoledPanelOrder& order) {
  HoledPanelVerdict out;
  if (!sim::roughness_preset(order.preset))
    return out.refused = "there is no preset called '" + order.preset + "': bench, workshop or rough", out;
  const sim::PanelOrder wanted = panel_of(order);
  const auto sheet = sim::make_panel(wanted);
  if (!sheet) return out.refused = sheet.error().message, out;
  const sim::CellTruth cell = sim::draw_cell_truth(settings_of(order, wanted));
  sim::Random hand(order.seed, "laid on the glass", static_cast<std::uint64_t>(order.panel));
  const auto pose =
      sim::lay_on_glass(**sheet, sim::SheetFace::kShow, "whole", cell.scanner.width_mm, cell.scanner.height_mm, hand);
  if (!pose) return out.refused = pose.error().message, out;
  sim::ScanTruth scan;
  scan.capture = "capture-1", scan.sheet = (*sheet)->name, scan.glass_from_sheet = *pose;
  scan.px_per_mm = kDpi / 25.4, scan.scanner = sim::scanner_of_today(cell, 1);
  const std::uint64_t seed = hand.next();
  scan.dust = sim::dust_of_scan(scan, seed);
  const cv::Mat picture = sim::render_scan(scan, sheet->get(), seed);

  // The scanner's own map is not known here: what it errs by moves nothing that a hole of four millimetres shows.
  calib::RegistrationOptions options;
  options.tag_size_tolerance = 0.02;
  const auto resolution = ScanResolution::from_dpi(kDpi);
  const auto registration = calib::register_first_scan(std::vector{calib::view_tile(picture, resolution, "the scan")},
                                                       calib::ScannerModel(), options);
  if (!registration) return out.refused = registration.error().message, out;
  calib::StitchOptions stitching;
  stitching.resolution = resolution;
  const auto map =
      calib::stitch(std::vector<calib::StitchTile>{{picture, registration->tiles[0]}}, registration->sheet, stitching);
  if (!map) return out.refused = map.error().message, out;
  const auto mask = calib::mask_veneer(*map, registration->fiducials);
  if (!mask) return out.refused = mask.error().message, out;

  const SheetMask seen(scan, registration->tiles[0], *mask);
  for (const sim::TrueHole& hole : (*sheet)->screw_holes) {
    ++out.holes;
    if (const double taken = share_taken(seen, hole); taken > kPartOfHole)
      out.taken.push_back({species_at(**sheet, hole.centre), hole.centre.x, hole.centre.y, hole.diameter_mm, taken});
  }
  for (const sim::SpeciesZone& zone : (*sheet)->zones) {
    sim::Vec2 middle;
    for (const sim::Vec2& p : zone.outline) middle = middle + p * (1.0 / static_cast<double>(zone.outline.size()));
    ++out.strips, out.asked += seen.is_asked_about(middle) ? 1 : 0;
  }
  judge_wood(**sheet, seen, out);
  return out;
}

void HoleFigures::add(const HoledPanelVerdict& verdict) {
  ++panels, refused += verdict.refused.empty() ? 0 : 1;
  holes += verdict.holes, strips += verdict.strips, asked += verdict.asked;
  for (const TakenHole& hole : verdict.taken) ++in_part, whole += hole.taken > kWholeHole ? 1 : 0;
  wood += verdict.wood, wood_taken += verdict.wood_taken, beside += verdict.beside;
}

void HoleFigures::add(const HoleFigures& other) {
  panels += other.panels, refused += other.refused, holes += other.holes;
  whole += other.whole, in_part += other.in_part, strips += other.strips, asked += other.asked;
  wood += other.wood, wood_taken += other.wood_taken, beside += other.beside;
}

std::string hole_table_head() {
  return fmt::format("{:<10} {:>6} {:>7} {:>6} {:>6} {:>7} {:>6} {:>5} {:>10} {:>11}\n", "twin", "panels", "refused",
                     "holes", "taken", "in part", "strips", "asked", "wood taken", "beside, mm2");
}

std::string hole_table_line(const std::string& name, const HoleFigures& f) {
  return fmt::format("{:<10} {:>6} {:>7} {:>6} {:>6} {:>7} {:>6} {:>5} {:>10.4f} {:>11.1f}\n", name, f.panels,
                     f.refused, f.holes, f.whole, f.in_part, f.strips, f.asked, f.wood > 0 ? f.wood_taken / f.wood : 0,
                     f.beside);
}

nlohmann::json to_json(const HoleFigures& f) {
  return {{"panels", f.panels},
          {"refused", f.refused},
          {"screw_holes", f.holes},
          {"screw_holes_in_mask", f.whole},
          {"screw_holes_in_mask_in_part", f.in_part},
          {"strips", f.strips},
          {"asked_in_all", f.asked},
          {"share_of_wood_taken", f.wood > 0 ? f.wood_taken / f.wood : 0},
          {"beside_wood_mm2", f.beside}};
}

}  // namespace veneer::workshop
