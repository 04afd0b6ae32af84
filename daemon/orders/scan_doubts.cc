#include "daemon/orders/scan_doubts.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace veneer::daemon {
namespace {

constexpr const char* kUnproven = "unproven-";
constexpr const char* kLight = "light";
constexpr const char* kOverexposed = "overexposed";
constexpr const char* kUnderexposed = "underexposed";
constexpr const char* kLostMap = "lost-map";

// How much longer than printed things are along the scanner's x and y; nothing where the tags lie so that they do not
// tell the two apart.
struct Stretch {
  double x = 0, y = 0;
};

std::optional<Stretch> stretch_of(const std::vector<calib::TileView>& views, const calib::Registration& registration) {
  // Each side of a tag says x cos^2 + y sin^2, by its direction on the glass.
  double cc = 0, cs = 0, ss = 0, c_long = 0, s_long = 0;
  for (std::size_t i = 0; i < views.size() && i < registration.tiles.size(); ++i)
    for (const auto& tag : views[i].tags) {
      if (registration.fiducials.tag(tag.id) == nullptr) continue;
      for (std::size_t k = 0; k < 4; ++k) {
        const auto &from = tag.corners.at(k), &to = tag.corners.at((k + 1) % 4);
        const double along = (to.x - from.x).count(), across = (to.y - from.y).count();
        const double c = along * along / (along * along + across * across), s = 1 - c;
        const double longer =
            distance(registration.tiles[i] * from, registration.tiles[i] * to) / calib::kPanelTagSize - 1;
        cc += c * c, cs += c * s, ss += s * s, c_long += c * longer, s_long += s * longer;
      }
    }
  const double determinant = cc * ss - cs * cs;
  if (!(determinant > 0.1 * cc * ss)) return std::nullopt;  // no tag at all, too
  return Stretch{(ss * c_long - cs * s_long) / determinant, (cc * s_long - cs * c_long) / determinant};
}

void judge_stretch(const Stretch& stretch, std::vector<ScanWarning>& out) {
  constexpr double kAxes = 0.004, kPrinted = 0.005;
  if (std::abs(stretch.x - stretch.y) > kAxes)
    out.push_back(
        {"scales",
         fmt::format("the printed tags are {:+.1f} % longer than printed along the scanner's x and {:+.1f} % "
                     "along its y: hold a rule against the sheet; if it is right, the printer stretched them, "
                     "else calibrate the scanner anew",
                     stretch.x * 100, stretch.y * 100)});
  else if (const double all = (stretch.x + stretch.y) / 2; std::abs(all) > kPrinted)
    out.push_back(
        {"tag-size",
         fmt::format("the printed tags are {:+.1f} % longer than printed: hold a rule against the sheet; if it "
                     "is right, the printer made them so, else the resolution or the certificate of the "
                     "scanner is wrong",
                     all * 100)});
}

// As sheets are cut that a machine cuts.
bool is_round(Millimetres side) {
  constexpr double kRound = 5, kNear = 0.6;
  return std::abs(side.count() - kRound * std::round(side.count() / kRound)) <= kNear;
}

// Where the wood reaches the sheet's edge along a side that is not round: panels have a rim for their tags, and a scan
// that broke off has none.
bool breaks_off(const Box<PanelFrame>& sheet, const calib::VeneerMask& mask) {
  constexpr Millimetres kRim(3);
  Box<PanelFrame> wood;
  for (const calib::Zone& zone : mask.list)
    if (!zone.box.empty()) wood.add(zone.box.min), wood.add(zone.box.max);
  for (const calib::AskedStrip& asked : mask.asked)
    for (const auto& corner : asked.outline) wood.add(corner);
  if (wood.empty()) return false;
  return (!is_round(sheet.width()) && (wood.min.x - sheet.min.x < kRim || sheet.max.x - wood.max.x < kRim)) ||
         (!is_round(sheet.height()) && (wood.min.y - sheet.min.y < kRim || sheet.max.y - wood.max.y < kRim));
}

// Points of the sheet's outline in that scan that lie on one rim of the picture: beyond it, nobody knows.
std::vector<std::vector<Point<ScanFrame>>> rims_of(const calib::TileView& view) {
  constexpr double kAtRim = 2;  // pixels
  const double right = view.width_px - 1 - kAtRim, bottom = view.height_px - 1 - kAtRim;
  std::vector<std::vector<Point<ScanFrame>>> out(4);
  for (const auto& at : view.outline) {
    const double x = at.x.count(), y = at.y.count();
    if (x <= kAtRim) out[0].push_back(at);
    if (x >= right) out[1].push_back(at);
    if (y <= kAtRim) out[2].push_back(at);
    if (y >= bottom) out[3].push_back(at);
  }
  return out;
}

// Whether a side of the sheet that is not round is no edge, but where a picture ended.
bool runs_off(const std::vector<calib::TileView>& views, const calib::Registration& registration) {
  constexpr Millimetres kOnSide(1), kLong(10);
  const Box<PanelFrame>& sheet = registration.sheet;
  const auto is_side = [&](Millimetres Point<PanelFrame>::*across, Millimetres side, const auto& rim, const auto& map) {
    std::vector<Point<PanelFrame>> on;
    for (const auto& at : rim)
      if (const Point<PanelFrame> there = map * at; std::abs((there.*across - side).count()) < kOnSide.count())
        on.push_back(there);
    return std::ranges::any_of(on, [&](const auto& one) { return distance(one, on.front()) > kLong; });
  };
  for (std::size_t i = 0; i < views.size() && i < registration.tiles.size(); ++i)
    for (const auto& rim : rims_of(views[i]))
      for (const auto& [across, least, most] : {std::tuple(&Point<PanelFrame>::x, sheet.min.x, sheet.max.x),
                                                std::tuple(&Point<PanelFrame>::y, sheet.min.y, sheet.max.y)})
        if (!is_round(most - least) &&
            (is_side(across, least, rim, registration.tiles[i]) || is_side(across, most, rim, registration.tiles[i])))
          return true;
  return false;
}

// A saw cuts where it has to: that a size is not round is a doubt only beside another one.
void judge_size(const std::vector<calib::TileView>& views, const calib::Registration& registration,
                const std::optional<Stretch>& stretch, const calib::VeneerMask& mask, std::vector<ScanWarning>& out) {
  constexpr double kAsPrintersAre = 0.002;
  const Box<PanelFrame>& sheet = registration.sheet;
  if (is_round(sheet.width()) && is_round(sheet.height())) return;
  std::string doubt;
  if (!stretch)
    doubt = "its tags do not tell its scale";
  else if (std::max(std::abs(stretch->x), std::abs(stretch->y)) > kAsPrintersAre)
    doubt = fmt::format("its tags are {:+.1f} % and {:+.1f} % longer than printed along the scanner's x and y",
                        stretch->x * 100, stretch->y * 100);
  else if (runs_off(views, registration))
    doubt = "it runs off the picture";
  else if (breaks_off(sheet, mask))
    doubt = "its wood reaches the edge, where panels have a rim";
  if (doubt.empty()) return;
  out.push_back(
      {"size", fmt::format("the sheet measures {:.1f} x {:.1f} mm, which is not round, and {}: hold a rule against it, "
                           "since a scan that broke off or was scaled shows another size",
                           sheet.width().count(), sheet.height().count(), doubt)});
}

using Span = std::pair<double, double>;

// What lies between the spans, once those that touch are one.
std::vector<Span> gaps_between(std::vector<Span> spans) {
  std::ranges::sort(spans);
  std::vector<Span> out;
  double reached = spans.empty() ? 0 : spans.front().first;
  for (const auto& [from, to] : spans) {
    if (from > reached) out.emplace_back(reached, from);
    reached = std::max(reached, to);
  }
  return out;
}

void judge_gaps(std::vector<Span> strips, const char* from_where, std::vector<ScanWarning>& out) {
  constexpr double kNarrowest = 12, kAsAStrip = 0.6;  // mm; of the middle one's width
  if (strips.size() < 2) return;
  std::vector<double> widths;
  widths.reserve(strips.size());
  for (const auto& [from, to] : strips) widths.push_back(to - from);
  std::ranges::nth_element(widths, widths.begin() + static_cast<std::ptrdiff_t>(widths.size() / 2));
  const double least = std::max(kNarrowest, kAsAStrip * widths[widths.size() / 2]);
  for (const auto& [from, to] : gaps_between(std::move(strips)))
    if (to - from >= least)
      out.push_back({"strip-missing",
                     fmt::format("bare board as wide as a strip is seen from {:.0f} to {:.0f} mm from the {}: if wood "
                                 "lies there, it was not seen; it can be given back with `veneerctl panel mask`",
                                 from, to, from_where)});
}

// Short lines are left out of the mask and not told: wood's own figure makes such too, and a person would be asked in
// vain.
void judge_hairs(const std::vector<calib::HairOnGlass>& hairs, std::vector<ScanWarning>& out) {
  constexpr Millimetres kSurely(15);
  constexpr std::size_t kNamed = 3;
  std::vector<std::string> places;
  std::size_t more = 0;
  for (const calib::HairOnGlass& hair : hairs) {
    if (hair.length < kSurely) continue;
    if (places.size() == kNamed)
      ++more;
    else
      places.push_back(fmt::format("{:.0f} mm from the left and {:.0f} mm from the lower edge ({:.0f} mm long)",
                                   hair.middle.x.count(), hair.middle.y.count(), hair.length.count()));
  }
  if (places.empty()) return;
  out.push_back(
      {"dust", fmt::format("what looks like a hair on the glass lies over the wood, at {}{}: what it hides is "
                           "left out; clean the glass and scan again",
                           fmt::join(places, "; at "), more > 0 ? fmt::format("; and at {} more places", more) : "")});
}

constexpr std::string_view kBlurred = "blurred-tag-";

}  // namespace

Result<std::vector<ScanWarning>> doubts_of_resolution(const std::string& scan, double dpi_x, double dpi_y,
                                                      ScanResolution configured) {
  constexpr double kDoubted = 0.002, kRefused = 0.05;
  const auto means_nothing = [](double dpi) {
    constexpr double kScreens[] = {72, 96}, kRounding = 0.5, kLeast = 10;
    return dpi < kLeast ||
           std::ranges::any_of(kScreens, [&](double usual) { return std::abs(dpi - usual) < kRounding; });
  };
  if (dpi_x <= 0) dpi_x = dpi_y;
  if (dpi_y <= 0) dpi_y = dpi_x;
  if (means_nothing(dpi_x) && means_nothing(dpi_y)) return std::vector<ScanWarning>{};
  const double wanted = configured.dpi(), off = std::max(std::abs(dpi_x / wanted - 1), std::abs(dpi_y / wanted - 1));
  if (off <= kDoubted) return std::vector<ScanWarning>{};
  const auto number = [](double dpi) { return fmt::format("{:g}", std::round(dpi * 10) / 10); };
  const std::string said = std::abs(dpi_x / dpi_y - 1) <= kDoubted
                               ? number(dpi_x) + " dpi"
                               : fmt::format("{} dpi along x and {} along y", number(dpi_x), number(dpi_y));
  const std::string told = fmt::format(
      "the file of {} says {}, but the scanner is configured for {} dpi: scan at {} dpi, or set `dpi` under "
      "[scanner] to what the scanner makes and calibrate it anew",
      scan, said, number(wanted), number(wanted));
  if (off > kRefused) return Error{ErrorCode::kRefused, told};
  return std::vector<ScanWarning>{{"dpi", told}};
}

bool is_of_sharpness(std::string_view name) { return name.starts_with(kBlurred); }

std::vector<ScanWarning> doubts_of_sharpness(const std::string& scan, const std::vector<calib::TagSharpness>& tags,
                                             ScanResolution nominal) {
  // A sheet that lies flat is blurred by some 0.75 pixels, and by 0.05 mm of its print.
  constexpr double kMostPixels = 1.2;
  const Millimetres most = std::max(Millimetres(0.2), nominal.to_mm(Pixels(kMostPixels)));
  const auto is_blurred = [&](const calib::TagSharpness& tag) { return tag.blur > most; };
  const auto blurred = std::ranges::count_if(tags, is_blurred);
  if (blurred == 0) return {};
  const auto& worst = *std::ranges::max_element(tags, {}, &calib::TagSharpness::blur);
  return {{fmt::format("{}{}", kBlurred, worst.id),
           fmt::format(
               "{} shows tag {}{} blurred by {:.2f} mm, and perhaps the wood there as well, so that cracks, screws and "
               "grain may not be seen: press the sheet flat on the glass, wipe the glass and scan again",
               scan, worst.id, blurred > 1 ? fmt::format(" (and {} more)", blurred - 1) : "", worst.blur.count())}};
}

std::optional<std::string> remark_on_size(Millimetres width, Millimetres height) {
  if (is_round(width) && is_round(height)) return std::nullopt;
  return fmt::format("the sheet measures {:.1f} x {:.1f} mm, which is not round, as of a sheet that was sawn by hand",
                     width.count(), height.count());
}

bool leaves_out_what_is_in_doubt(std::string_view name) {
  // Strips, tags and holes are numbered, and "strip-missing" is bare board that stays such. "size" is not among them: a
  // picture of another resolution looks right.
  constexpr std::string_view kNumbered[] = {"strip-", "spoiled-tag-", "moved-tag-", "moved-hole-"};
  constexpr std::string_view kSingle[] = {"dust", "no-new-tag", "lost-wood"};
  return std::ranges::any_of(kNumbered, [&](std::string_view beginning) { return name.starts_with(beginning); }) ||
         std::ranges::count(kSingle, name) > 0;
}

ScanWarning doubt_of_lost_map(const std::filesystem::path& file) {
  return {
      kLostMap,
      fmt::format("{}, the oldest map of this panel, is spoilt, so the scan was compared with a later one, and wood "
                  "that was gone by then is not told as missing: put the file back from a backup and scan again",
                  file.filename().string())};
}

bool is_lost_map(const ScanWarning& warning) { return warning.name == kLostMap; }

ScanWarning doubt_of_lost_mask(const std::filesystem::path& file) {
  return {"lost-mask",
          fmt::format("{}, a mask of this panel, is lost or spoilt, so all of the sheet was compared, and board may be "
                      "told as missing wood: put the file back from a backup and scan again, or look at each "
                      "difference",
                      file.filename().string())};
}

ScanWarning doubt_of_lost_look(const std::filesystem::path& file) {
  return {fmt::format("{}mask", kUnproven),
          fmt::format("{}, of the panel's mask until now, is lost or spoilt, so nobody could tell whether this scan "
                      "takes for wood what was known to be none: put the file back from a backup and scan again, or "
                      "look at the picture and accept what is wood",
                      file.filename().string())};
}

bool is_unproven(const ScanWarning& warning) { return warning.name.starts_with(kUnproven); }

std::vector<ScanWarning> doubts_of_tags(const calib::Registration& registration) {
  std::vector<ScanWarning> out;
  for (const calib::SpoiledTag& spoiled : registration.spoiled) {
    const std::string name = fmt::format("spoiled-tag-{}", spoiled.tag.id);
    if (std::ranges::any_of(out, [&](const ScanWarning& told) { return told.name == name; })) continue;
    const std::string what =
        spoiled.apart ? fmt::format(
                            "is not seen alike by the scans that show it, by {:.2f} mm ({} is one), where all "
                            "else agrees, and counts for nothing",
                            spoiled.apart->count(), spoiled.tile)
                      : fmt::format(
                            "on {} measures {:.2f} mm where the others have their size, and counts for nothing "
                            "there",
                            spoiled.tile, spoiled.side.count());
    out.push_back({name, fmt::format("tag {} {}: wipe it clean and scan again; a panel that enters stock without it "
                                     "gets it later by a scan with --retag",
                                     spoiled.tag.id, what)});
  }
  return out;
}

std::vector<ScanWarning> doubts_of_fiducials(const std::vector<calib::TileView>& views,
                                             const calib::Registration& registration) {
  constexpr Millimetres kOne(0.01);  // two tiles may see the same one
  std::vector<ScanWarning> out;
  std::vector<calib::FiducialOffset> told;
  int holes = 0;
  for (const calib::FiducialOffset& moved : registration.moved) {
    const auto is_it = [&](const calib::FiducialOffset& other) {
      return other.tag == moved.tag && distance(other.place, moved.place) <= kOne;
    };
    if (std::ranges::any_of(told, is_it)) continue;
    told.push_back(moved);
    const bool tag = moved.tag >= 0;
    out.push_back(
        {tag ? fmt::format("moved-tag-{}", moved.tag) : fmt::format("moved-hole-{}", ++holes),
         fmt::format("{} lies {:.2f} mm from where the first scans saw it, by what the others say, and counts for "
                     "nothing: {}",
                     name_of(moved), moved.off.count(),
                     tag ? "wipe it clean and scan again; if it came loose, glue on a tag with a new number and scan "
                           "with --retag"
                         : "clear it of dust and splinters and scan again; if it was drilled out or filled, the panel "
                           "needs three other tags and holes at least")});
  }
  for (std::size_t i = 0; i < registration.agreement.size() && i < views.size(); ++i) {
    const calib::TileAgreement& agreement = registration.agreement[i];
    if (!agreement.worst)
      out.push_back({fmt::format("{}{}", kUnproven, i + 1),
                     fmt::format("{} shows {} of the panel's tags and holes that count, and nobody could tell whether "
                                 "one has moved: lay the panel so that three at least are seen, and scan again",
                                 views[i].name, agreement.fiducials)});
    else if (!agreement.within(calib::RegistrationOptions{}.max_offset))
      out.push_back({fmt::format("disagree-{}", i + 1),
                     fmt::format("the panel's tags and holes on {} do not lie as the first scans saw them, by up to "
                                 "{:.2f} mm, and nobody can tell which one has moved: lay the panel flat, wipe its "
                                 "tags clean and scan again, or calibrate the scanner",
                                 views[i].name, agreement.worst->count())});
  }
  return out;
}

std::vector<ScanWarning> doubts_of_exposure(const calib::Exposure& exposure) {
  constexpr double kMost = 0.02;  // none of the woods that were looked at has a hundredth of it
  std::vector<ScanWarning> out;
  if (exposure.blown > kMost)
    out.push_back({kOverexposed, fmt::format("{:.0f} % of the wood is shown so light that its grain is lost: lower the "
                                             "scanner's brightness, or let its lamp settle, and scan again",
                                             100 * exposure.blown)});
  if (exposure.sunk > kMost)
    out.push_back({kUnderexposed, fmt::format("{:.0f} % of the wood is shown so dark that its grain is lost: raise the "
                                              "scanner's brightness, see that its lamp burns, and scan again",
                                              100 * exposure.sunk)});
  return out;
}

bool is_of_exposure(std::string_view name) { return name == kOverexposed || name == kUnderexposed; }

std::vector<ScanWarning> doubts_of_mask(const calib::VeneerMask& mask) {
  std::vector<ScanWarning> out;
  for (const calib::AskedStrip& strip : mask.asked) {
    Box<PanelFrame> box;
    for (const auto& corner : strip.outline) box.add(corner);
    const auto place = fmt::format("{:.0f} to {:.0f} mm from the left and {:.0f} to {:.0f} mm from the lower edge",
                                   box.min.x.count(), box.max.x.count(), box.min.y.count(), box.max.y.count());
    out.push_back(
        {fmt::format("strip-{}", out.size() + 1),
         strip.taken
             ? fmt::format("of the strip at {} some is left out of the usable wood: {}", place, strip.reason)
             : fmt::format("what looks like a strip at {} is left out of the usable wood: {}", place, strip.reason)});
  }
  judge_hairs(mask.hairs, out);
  return out;
}

std::vector<ScanWarning> doubts_of_comparison(const calib::Reconciliation& compared) {
  if (compared.light_known) return {};
  return {{kLight,
           "the scan is so much lighter or darker than the panel's first one, or so little of the sheet is neither cut "
           "nor in doubt, that wood may be told as missing which is there: let the lamp warm up, wipe the glass and "
           "scan again, and look at the pieces in doubt yourself"}};
}

bool is_unfit_light(const ScanWarning& warning) { return warning.name == kLight; }

std::vector<ScanWarning> doubts_of_first_scan(const std::vector<calib::TileView>& views,
                                              const calib::Registration& registration, const calib::VeneerMask& mask) {
  std::vector<ScanWarning> out = doubts_of_mask(mask);
  const auto stretch = stretch_of(views, registration);
  if (stretch) judge_stretch(*stretch, out);
  judge_size(views, registration, stretch, mask, out);
  // What is asked about was seen.
  std::vector<Span> columns, rows;
  const auto add = [&](const Box<PanelFrame>& box) {
    columns.emplace_back(box.min.x.count(), box.max.x.count());
    rows.emplace_back(box.min.y.count(), box.max.y.count());
  };
  for (const calib::Zone& zone : mask.list) add(zone.box);
  for (const calib::AskedStrip& strip : mask.asked) {
    Box<PanelFrame> box;
    for (const auto& corner : strip.outline) box.add(corner);
    add(box);
  }
  const std::size_t before = out.size();
  judge_gaps(columns, "left", out);
  judge_gaps(rows, "lower edge", out);
  // One name a warning.
  if (out.size() > before + 1)
    for (std::size_t i = before; i < out.size(); ++i) out[i].name += fmt::format("-{}", i - before + 1);
  return out;
}

}  // namespace veneer::daemon
