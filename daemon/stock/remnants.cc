#include "daemon/stock/remnants.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <set>

#include "daemon/orders/panel_wood.h"
#include "daemon/stock/covered_wood.h"

namespace veneer::daemon {
namespace {

// A circle is looked for in so many pixels at most; in a larger panel they are joined.
constexpr double kCirclePixels = 4e6;
// The tone of wood is seen on a picture this wide at most: one that the library keeps on the disk.
constexpr int kTonePixels = 1600;
// And is that of so much of it together: streaks of its grain do not count.
constexpr Millimetres kGrain(3);
// The smallest patch of a plan, where nobody says another.
constexpr Millimetres kUsualPatch(14);

struct PanelState {
  std::string wood;  // names mask and what is booked
  std::vector<db::ZoneRecord> zones;
  // And what the zones are of, and which outlines of theirs count.
  std::string woods() const {
    std::string out = wood;
    for (const auto& zone : zones)
      out += zone.version > 1 ? fmt::format(",{} {} {}", zone.number, zone.version, zone.material)
                              : fmt::format(",{} {}", zone.number, zone.material);
    return out;
  }
};

Result<PanelState> read_state(Repositories& r, StockMemory& memory, const db::PanelRecord& panel) {
  PanelState out;
  const auto state = memory.state_of(r, panel);
  if (!state) return state.error();
  out.wood = state->wood;
  auto all = r.materials.zones(panel.id);
  if (!all) return all.error();
  out.zones = std::move(*all);
  return out;
}

std::set<std::string> materials_of(const std::vector<db::ZoneRecord>& zones) {
  std::set<std::string> out;
  for (const auto& zone : zones) out.insert(zone.material);
  if (zones.empty()) out.insert("");
  return out;
}

// Wood may be booked or given back between the state's reading and this: the state becomes that of what is told here,
// or a lease that ends soon would leave a count without its wood under the name of the panel that has it.
Result<Raster<PanelFrame>> free_now(Repositories& r, const PanelLibrary& library, StockMemory& memory,
                                    const db::PanelRecord& panel, PanelState& state) {
  auto mask = library.load_mask(panel);  // before what is booked: one that is missing is asked for at every look
  memory.note_readable(panel.mask_file, mask.ok());
  if (!mask) return mask.error();
  const auto allocations = r.ledger.live_allocations(panel.id);
  if (!allocations) return allocations.error();
  std::vector<Region<PanelFrame>> areas;
  areas.reserve(allocations->size());
  for (const auto& allocation : *allocations) areas.push_back(allocation.area);
  state.wood = StockMemory::name_of_wood(panel, *allocations);
  return free_wood(*mask, areas, Millimetres(0));
}

Result<PanelLibrary::SmallPicture> load_for_tones(const PanelLibrary& library, StockMemory& memory,
                                                  const db::PanelRecord& panel) {
  auto map = library.load_small(panel.map_file, kTonePixels);
  memory.note_readable(panel.map_file, map.ok());
  return map;
}

// Without zones all wood is of the material that nobody has said.
Raster<PanelFrame> wood_of(const Raster<PanelFrame>& free, const std::vector<db::ZoneRecord>& zones,
                           const std::string& material) {
  if (zones.empty() && material.empty()) return free;
  std::vector<Region<PanelFrame>> wanted, others;
  for (const auto& zone : zones) (zone.material == material ? wanted : others).push_back(zone.shape);
  return wood_within(free, wanted, others);
}

Remnant remnant_in(const Raster<PanelFrame>& free, const std::vector<db::ZoneRecord>& zones) {
  Remnant out;
  for (const std::string& material : materials_of(zones))
    out.woods.push_back({material, wood_area(wood_of(free, zones, material))});
  out.square = largest_square(free);
  const double pixels = static_cast<double>(free.pixels.total());
  out.circle = largest_circle(in_larger_pixels(free, static_cast<int>(std::ceil(std::sqrt(pixels / kCirclePixels)))));
  return out;
}

// Where the map looks dark, or light, in pixels of the mask.
cv::Mat wood_of_tone(const PanelLibrary::SmallPicture& map, Tone tone, cv::Size size) {
  cv::Mat bgr, lab, lightness;
  map.pixels.convertTo(bgr, CV_32F, 1.0 / 255);
  if (bgr.channels() == 1) cv::cvtColor(bgr, bgr, cv::COLOR_GRAY2BGR);
  // OpenCV makes its tables with the first call, and where two threads come at once it makes them twice and loses one.
  [[maybe_unused]] static const bool tables_are_made = [] {
    cv::Mat one;
    cv::cvtColor(cv::Mat(1, 1, CV_32FC3, cv::Scalar::all(0)), one, cv::COLOR_BGR2Lab);
    return true;
  }();
  cv::cvtColor(bgr, lab, cv::COLOR_BGR2Lab);
  cv::extractChannel(lab, lightness, 0);
  const int grain = std::max(1, cvRound(kMapResolution.to_px(kGrain).count() * map.scale));
  cv::boxFilter(lightness, lightness, CV_32F, {grain, grain}, {-1, -1}, true, cv::BORDER_REPLICATE);
  cv::Mat good = tone == Tone::kDark ? lightness <= kDarkAtMost : lightness >= kLightAtLeast;
  cv::resize(good, good, size, 0, 0, cv::INTER_NEAREST);
  return good;
}

// Of what searches ask, all but the patches' side.
std::string kind_of(const WoodWanted& wanted) {
  return fmt::format("patches {} {}", wanted.tone ? static_cast<int>(*wanted.tone) : -1,
                     wanted.material ? "of " + *wanted.material : "");
}
std::string counted_of(const PanelState& state, const db::PanelRecord& panel, const WoodWanted& wanted) {
  return (wanted.material ? state.woods() : state.wood) + "," + panel.map_file;
}

}  // namespace

std::string name_of(const WoodWanted& wanted) {
  return fmt::format("{} {} {}", wanted.tone ? static_cast<int>(*wanted.tone) : -1, wanted.patch.count(),
                     wanted.material ? "of " + *wanted.material : "");
}

Remnant remnant_of(const db::RemnantRecord& booked) {
  Remnant out;
  for (const auto& [material, free] : booked.woods) out.woods.push_back({material, free});
  if (const auto& square = booked.square) out.square = InscribedSquare{square->at, square->size};
  if (const auto& circle = booked.circle) out.circle = InscribedCircle{circle->at, circle->size};
  return out;
}

db::RemnantRecord to_record(const PanelId& panel, int mask_version, const std::string& counted_of,
                            const Remnant& remnant) {
  db::RemnantRecord out;
  out.panel = panel, out.mask_version = mask_version, out.counted_of = counted_of;
  for (const auto& [material, free] : remnant.woods) out.woods.push_back({material, free});
  if (const auto& square = remnant.square) out.square = db::RemnantRecord::Room{square->min, square->side};
  if (const auto& circle = remnant.circle) out.circle = db::RemnantRecord::Room{circle->centre, circle->radius};
  return out;
}

Result<std::optional<Remnants::Counted>> Remnants::known(Repositories& r, const PanelId& panel, const std::string& of) {
  {
    const std::lock_guard lock(mutex_);
    const auto kept = kept_.find(panel);
    if (kept != kept_.end() && kept->second.of == of && kept->second.booked) return std::optional(kept->second);
  }
  const auto booked = r.remnants.newest(panel);
  if (!booked) return booked.error();
  const std::lock_guard lock(mutex_);
  if (*booked && (*booked)->counted_of == of) {
    kept_[panel] = {of, remnant_of(**booked), true};
    return std::optional(kept_[panel]);
  }
  const auto kept = kept_.find(panel);
  return kept != kept_.end() && kept->second.of == of ? std::optional(kept->second) : std::nullopt;
}

Result<bool> Remnants::knows(Repositories& r, const db::PanelRecord& panel) {
  const auto state = read_state(r, memory_, panel);
  if (!state) return state.error();
  const auto counted = known(r, panel.id, state->woods());
  if (!counted) return counted.error();
  return counted->has_value();
}

Result<std::optional<Remnants::Counted>> Remnants::count(Repositories& r, const db::PanelRecord& panel) {
  auto state = read_state(r, memory_, panel);
  if (!state) return state.error();
  if (auto counted = known(r, panel.id, state->woods()); !counted || *counted) return counted;
  const auto free = free_now(r, library_, memory_, panel, *state);
  if (!free) return std::optional<Counted>();
  Counted counted{state->woods(), remnant_in(*free, state->zones)};
  const std::lock_guard lock(mutex_);
  return std::optional(kept_[panel.id] = std::move(counted));
}

Result<std::optional<Remnant>> Remnants::of(Repositories& r, const db::PanelRecord& panel) {
  auto counted = count(r, panel);
  if (!counted) return counted.error();
  return *counted ? std::optional(std::move((*counted)->remnant)) : std::nullopt;
}

std::vector<WoodWanted> Remnants::usual_searches() {
  return {{{}, {}, kUsualPatch}, {{}, Tone::kDark, kUsualPatch}, {{}, Tone::kLight, kUsualPatch}};
}

Result<std::optional<SquareMillimetres>> Remnants::booked_fitting(Repositories& r, const db::PanelRecord& panel,
                                                                  const std::string& counted_of,
                                                                  const std::string& search) {
  const auto last = r.remnants.newest(panel.id);
  if (!last) return last.error();
  const std::optional<SquareMillimetres> none;
  if (!*last || (*last)->counted_of != counted_of || (*last)->mask_version != panel.mask_version) return none;
  for (const auto& [known, area] : (*last)->fitting)
    if (known == search) return std::optional(area);
  return none;
}

Result<Remnants::Asked> Remnants::ask(Repositories& r) {
  const auto newest = memory_.newest_step(r);
  if (!newest) return newest.error();
  auto zones = r.materials.zones_without_outlines();
  if (!zones) return zones.error();
  return Asked{*newest, std::move(*zones)};
}

Result<SquareMillimetres> Remnants::fitting(Repositories& r, const db::PanelRecord& panel, const WoodWanted& wanted) {
  const auto newest = memory_.newest_step(r);
  if (!newest) return newest.error();
  auto zones = r.materials.zones(panel.id);
  if (!zones) return zones.error();
  const auto known = fitting(r, panel, wanted, Asked{*newest, {{panel.id, std::move(*zones)}}}, Look::kMay);
  return known ? known->value_or(SquareMillimetres(0)) : Result<SquareMillimetres>(known.error());
}

bool Remnants::is_readable(const db::PanelRecord& panel, const WoodWanted& wanted) {
  return memory_.is_readable(panel.mask_file) && (!wanted.tone || memory_.is_readable(panel.map_file));
}

Result<std::optional<SquareMillimetres>> Remnants::fitting(Repositories& r, const db::PanelRecord& panel,
                                                           const WoodWanted& wanted, const Asked& asked, Look look) {
  const std::optional<SquareMillimetres> none;
  const auto named = memory_.state_of(r, panel, asked.newest);
  if (!named) return named.error();
  const auto known_zones = asked.zones.find(panel.id);
  PanelState state{named->wood, known_zones == asked.zones.end() ? std::vector<db::ZoneRecord>() : known_zones->second};
  if (wanted.material && !materials_of(state.zones).contains(*wanted.material))
    return std::optional(SquareMillimetres(0));
  if (const auto known = memory_.find_text(panel.id, kind_of(wanted), counted_of(state, panel, wanted)))
    if (const auto covered = CoveredWood::read(*known)) return std::optional(covered->by(wanted.patch));
  const auto booked = booked_fitting(r, panel, state.woods(), name_of(wanted));
  if (!booked) return booked.error();
  if (*booked || look == Look::kNot) return *booked;
  auto zones = r.materials.zones(panel.id);  // with their outlines
  if (!zones) return zones.error();
  state.zones = std::move(*zones);
  // The map before the mask: one that cannot be read would have the mask decoded at every look.
  std::optional<PanelLibrary::SmallPicture> map;
  if (wanted.tone) {
    auto loaded = load_for_tones(library_, memory_, panel);
    if (!loaded) return none;
    map = std::move(*loaded);
  }
  const auto free = free_now(r, library_, memory_, panel, state);
  if (!free) return none;
  Raster<PanelFrame> wood = wanted.material ? wood_of(*free, state.zones, *wanted.material) : *free;
  if (map) wood.pixels &= wood_of_tone(*map, *wanted.tone, wood.pixels.size());
  const CoveredWood covered(wood);
  memory_.keep_text(panel.id, kind_of(wanted), counted_of(state, panel, wanted), covered.text());
  return std::optional(covered.by(wanted.patch));
}

Result<int> Remnants::count_for_searches(Repositories& r, const db::PanelRecord& panel) {
  auto state = read_state(r, memory_, panel);
  if (!state) return state.error();
  std::vector<std::optional<std::string>> materials = {std::nullopt};
  if (!state->zones.empty())
    for (const std::string& material : materials_of(state->zones)) materials.emplace_back(material);
  std::vector<WoodWanted> missing;
  for (const auto& material : materials)
    for (const std::optional<Tone> tone :
         {std::optional<Tone>(), std::optional(Tone::kDark), std::optional(Tone::kLight)})
      if (const WoodWanted kind{material, tone, {}};
          !memory_.find_text(panel.id, kind_of(kind), counted_of(*state, panel, kind)))
        missing.push_back(kind);
  if (missing.empty()) return 0;
  // The map before the mask: one that cannot be read would have the mask decoded at every look.
  std::optional<PanelLibrary::SmallPicture> map;
  if (std::ranges::any_of(missing, [](const WoodWanted& kind) { return kind.tone.has_value(); })) {
    auto loaded = load_for_tones(library_, memory_, panel);
    if (loaded)
      map = std::move(*loaded);
    else
      std::erase_if(missing, [](const WoodWanted& kind) { return kind.tone.has_value(); });
    if (missing.empty()) return loaded.error();
  }
  const auto free = free_now(r, library_, memory_, panel, *state);
  if (!free) return free.error();
  cv::Mat dark, light;
  if (map) {
    dark = wood_of_tone(*map, Tone::kDark, free->pixels.size());
    light = wood_of_tone(*map, Tone::kLight, free->pixels.size());
  }
  for (const auto& material : materials) {
    const auto whole = material ? wood_of(*free, state->zones, *material) : *free;
    for (const WoodWanted& kind : missing) {
      if (kind.material != material) continue;
      Raster<PanelFrame> wood{{}, whole.resolution, whole.origin};
      if (kind.tone)
        cv::bitwise_and(whole.pixels, kind.tone == Tone::kDark ? dark : light, wood.pixels);
      else
        wood.pixels = whole.pixels;
      memory_.keep_text(panel.id, kind_of(kind), counted_of(*state, panel, kind), CoveredWood(wood).text());
    }
  }
  return static_cast<int>(missing.size());
}

Result<cv::Mat> picture_of_remnant(const PanelLibrary& library, const db::PanelRecord& panel,
                                   const std::vector<db::AllocationRecord>& live, const Remnant& remnant, int width_px,
                                   Beside beside) {
  const auto map = library.load_small(panel.map_file, width_px);
  if (!map) return map.error();
  const auto mask = library.load_small(panel.mask_file, width_px);
  if (!mask) return mask.error();
  std::vector<Region<PanelFrame>> areas;
  areas.reserve(live.size());
  for (const auto& allocation : live) areas.push_back(allocation.area);
  const Raster<PanelFrame> wood{map->pixels, {kMapResolution.px_per_mm * map->scale}, {}};
  return draw_remnant(wood, mask->pixels, areas, remnant, beside);
}

cv::Mat draw_remnant(const Raster<PanelFrame>& map, const cv::Mat& mask, const std::vector<Region<PanelFrame>>& live,
                     const Remnant& remnant, Beside beside) {
  const Raster<PanelFrame> usable{mask >= 128, map.resolution, map.origin};
  const auto free = free_wood(usable, live, Millimetres(0));
  cv::Mat colours = map.pixels, out;
  if (colours.channels() == 1) cv::cvtColor(map.pixels, colours, cv::COLOR_GRAY2BGR);
  if (beside == Beside::kBlank) {
    out = cv::Mat(colours.size(), CV_8UC3, cv::Scalar(225, 225, 225));
  } else {
    cv::cvtColor(colours, out, cv::COLOR_BGR2GRAY);
    cv::cvtColor(out, out, cv::COLOR_GRAY2BGR);
    cv::addWeighted(out, 0.25, cv::Mat(out.size(), CV_8UC3, cv::Scalar(235, 235, 235)), 0.75, 0, out);
  }
  colours.copyTo(out, free.pixels);
  // White with a dark rim is seen on any wood.
  const auto pixel_of = [&](const Point<PanelFrame>& p) {
    double column = 0, row = 0;
    map.to_pixels(p, column, row);
    return cv::Point(cvRound(column - 0.5), cvRound(row - 0.5));
  };
  for (const auto& [colour, width] : {std::pair(cv::Scalar(40, 40, 40), 4), std::pair(cv::Scalar(255, 255, 255), 2)}) {
    if (remnant.square) {
      const auto& [min, side] = *remnant.square;
      cv::rectangle(out, pixel_of(min), pixel_of({min.x + side, min.y + side}), colour, width, cv::LINE_AA);
    }
    if (remnant.circle)
      cv::circle(out, pixel_of(remnant.circle->centre), cvRound(map.resolution.to_px(remnant.circle->radius).count()),
                 colour, width, cv::LINE_AA);
  }
  return out;
}

}  // namespace veneer::daemon
