#include "daemon/stock/strip_answers.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "daemon/stock/mask_painter.h"

namespace veneer::daemon {
namespace {

using PanelRegion = Region<PanelFrame>;

constexpr SquareMillimetres kSliver{1};

PanelRegion place_of(const calib::AskedStrip& strip) {
  return PanelRegion(Ring<PanelFrame>(strip.outline.begin(), strip.outline.end()));
}

PanelRegion usable_of(const calib::AskedStrip& strip, const PanelRead& margins) {
  PanelRegion out = offset(place_of(strip), -margins.edge_margin);
  for (const calib::ScrewHole& hole : strip.round)
    out = subtract(out, disc(hole.centre, hole.diameter / 2 + margins.round_margin));
  return out;
}

PanelRegion without_zones(PanelRegion region, const std::vector<db::ZoneRecord>& zones) {
  for (const db::ZoneRecord& zone : zones) region = subtract(region, zone.shape);
  return region;
}

Status check(const PanelRead& read, const StripAnswers& answers) {
  for (const auto* names : {&answers.wood, &answers.no_wood})
    for (const std::string& name : *names) {
      bool asked = false;
      for (std::size_t i = 1; i <= read.asked.size(); ++i) asked |= name == fmt::format("strip-{}", i);
      if (!asked)
        return Error{ErrorCode::kInvalidArgument,
                     fmt::format("this scan asks about no strip under the name {}: `veneerctl panel proposals NUMBER` "
                                 "lists those that it asks about",
                                 name)};
    }
  for (const std::string& name : answers.wood)
    if (std::ranges::count(answers.no_wood, name) > 0)
      return Error{ErrorCode::kInvalidArgument, fmt::format("{} is called wood and no wood: say one of them", name)};
  return Ok();
}

db::MaskEdit edit_of(bool give, PanelRegion shape, const std::string& name) {
  db::MaskEdit out;
  out.give = give, out.shape = std::move(shape), out.note = name;
  return out;
}

}  // namespace

Result<AnsweredStrips> answer_strips(const PanelRead& read, const StripAnswers& answers) {
  if (const Status good = check(read, answers); !good) return good.error();
  AnsweredStrips out{read.zones, {}};
  std::vector<db::ZoneRecord> found;
  int number = 0;
  for (const db::ZoneRecord& zone : read.zones) number = std::max(number, zone.number);
  for (std::size_t i = 0; i < read.asked.size(); ++i) {
    const calib::AskedStrip& strip = read.asked[i];
    const std::string name = fmt::format("strip-{}", i + 1);
    if (std::ranges::count(answers.wood, name) > 0 && !strip.taken) {
      PanelRegion usable = without_zones(usable_of(strip, read), read.zones);
      if (usable.area() <= kSliver) continue;
      if (PanelRegion zone = without_zones(usable, found); zone.area() > kSliver)
        found.push_back({++number, std::move(zone), "", strip.confidence});
      out.edits.push_back(edit_of(true, std::move(usable), name));
    } else if (std::ranges::count(answers.no_wood, name) > 0) {
      PanelRegion place = place_of(strip);
      if (strip.taken)
        std::erase_if(out.zones, [&](const db::ZoneRecord& zone) {
          return intersect(zone.shape, place).area() > zone.shape.area() / 2;
        });
      place = without_zones(std::move(place), out.zones);
      if (place.area() > kSliver) out.edits.push_back(edit_of(false, std::move(place), name));
    }
  }
  std::ranges::move(found, std::back_inserter(out.zones));
  return out;
}

}  // namespace veneer::daemon
