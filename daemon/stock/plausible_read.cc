#include "daemon/stock/plausible_read.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/json_depth.h"

namespace veneer::daemon {

bool is_plausible(const PanelRead& read, std::size_t tiles, std::size_t suspects) {
  constexpr std::size_t kMostTags = 2'000, kMostZones = 10'000, kMostPoints = 10'000, kMostDifferences = 10'000;
  constexpr std::size_t kMostWarnings = 1'000, kLongestWarning = 1'000, kLongestName = 40;
  constexpr std::size_t kLongestLattice = 2 << 20;
  constexpr Millimetres kSmallest{1}, kLargest{20'000};
  const auto is_lattice = [](const std::string& text) {
    if (text.size() > kLongestLattice || nested_too_deeply(text)) return false;
    const auto lattice = nlohmann::json::parse(text, nullptr, false);
    return lattice.is_object() && lattice.contains("panel_mm") && lattice["panel_mm"].is_array();
  };
  constexpr std::size_t kMostCorners = 1'000'000;  // of all shapes together
  std::size_t corners = 0;
  const auto is_there = [&](const Point<PanelFrame>& p) {
    return p.x >= -kLargest && p.x <= kLargest && p.y >= -kLargest && p.y <= kLargest;
  };
  const auto is_near = [&](const calib::Difference& difference) {
    const auto rings = difference.shape.rings();
    for (const auto& ring : rings) corners += ring.size();
    return is_there(difference.place) && !rings.empty() && corners <= kMostCorners &&
           std::ranges::all_of(rings, [&](const auto& ring) { return std::ranges::all_of(ring, is_there); });
  };
  static constexpr auto is_share = [](double share) { return share >= 0 && share <= 1; };
  const auto is_asked = [&](const calib::AskedStrip& strip) {
    return is_share(strip.confidence) && !strip.reason.empty() && strip.reason.size() <= kLongestWarning &&
           std::ranges::all_of(strip.outline, is_there) && strip.round.size() <= kMostTags &&
           std::ranges::all_of(strip.round, [&](const calib::ScrewHole& hole) {
             return is_there(hole.centre) && hole.diameter >= Millimetres(0) && hole.diameter <= kLargest;
           });
  };
  // Farther out than the database reads, a shape that was kept would be taken for a damaged one.
  const auto is_zone = [&](const db::ZoneRecord& zone) {
    return is_share(zone.confidence.value_or(0)) && std::ranges::all_of(zone.shape.rings(), [&](const auto& ring) {
             return std::ranges::all_of(ring, is_there);
           });
  };
  const auto is_side = [&](Millimetres side) { return side >= kSmallest && side <= kLargest; };
  return read.lattices.size() == tiles && std::ranges::all_of(read.lattices, is_lattice) &&
         (read.sheet.empty() || (is_side(read.sheet.width()) && is_side(read.sheet.height()))) &&
         read.fiducials.tags.size() + read.fiducials.holes.size() <= kMostTags && read.zones.size() <= kMostZones &&
         std::ranges::all_of(
             read.zones, [](const auto& zone) { return micro::corners_of(zone.shape.micro_area()) <= kMostPoints; }) &&
         std::ranges::all_of(read.zones, is_zone) && read.asked.size() <= kMostWarnings &&
         std::ranges::all_of(read.asked, is_asked) && read.usable >= SquareMillimetres(0) &&
         read.usable <= kLargest * kLargest &&
         (!read.differences ||
          (read.differences->size() <= kMostDifferences && std::ranges::all_of(*read.differences, is_near))) &&
         read.suspects_gone.size() == suspects && std::ranges::all_of(read.suspects_gone, is_share) &&
         read.warnings.size() <= kMostWarnings &&
         std::ranges::all_of(read.warnings,
                             [](const auto& warning) {
                               return !warning.name.empty() && warning.name.size() <= kLongestName &&
                                      warning.text.size() <= kLongestWarning;
                             }) &&
         read.lost >= SquareMillimetres(0) && read.lost <= kLargest * kLargest && read.gained >= SquareMillimetres(0) &&
         read.gained <= kLargest * kLargest;
}

}  // namespace veneer::daemon
