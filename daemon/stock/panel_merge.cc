#include "daemon/stock/panel_merge.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "base/clock.h"
#include "calib/hole_tie.h"
#include "calib/part_relation.h"
#include "daemon/orders/packed_lattice.h"
#include "daemon/stock/panel_library.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using PanelMap = Isometry2<PanelFrame, PanelFrame>;

struct Tie {
  PanelMap kept_from_merged;
  int fiducials = 0;
  Millimetres rms{0};
};

std::vector<Point<PanelFrame>> places(const calib::PanelFiducials& fiducials) {
  std::vector<Point<PanelFrame>> out;
  for (const auto& hole : fiducials.holes) out.push_back(hole.centre);
  return out;
}

Result<Tie> tie_of(const db::PanelRecord& kept, const calib::PanelFiducials& there, const db::PanelRecord& merged,
                   const calib::PanelFiducials& here) {
  constexpr double kMostRms = 0.05;  // mm, as of the holes that tie the faces of one panel
  Box<PanelFrame> sheet;
  sheet.add({});
  sheet.add({kept.width, kept.height});
  if (const auto same = calib::relate_part(there, here, sheet))
    return Tie{same->part_from_parent, same->fiducials, same->rms};
  const auto holes_there = places(there), holes_here = places(here);
  const auto holes = calib::match_holes<PanelFrame, PanelFrame>(holes_there, holes_here);
  if (holes && holes->to_from.handedness() == Handedness::kImproper && holes->residual.rms <= kMostRms)
    return Tie{holes->to_from, static_cast<int>(holes->pairs.size()), Millimetres(holes->residual.rms)};
  return Error{
      ErrorCode::kRefused,
      fmt::format("nothing shows that panels {0} and {1} are one sheet: they need two tags or holes in common, "
                  "far from each other, or three holes that lie alike on either face. If {1} should not be "
                  "there, run `veneerctl panel retire {1}`",
                  kept.id.value, merged.id.value)};
}

// The scan -> panel map, in the other panel's frame.
std::string moved_lattice(const std::string& lattice, const PanelMap& map) {
  json out = json::parse(unpacked_lattice(lattice), nullptr, false);
  if (!out.is_object() || !out.contains("panel_mm") || !out["panel_mm"].is_array()) return lattice;
  const auto rounded = [](Millimetres length) { return std::round(length.count() * 1e5) / 1e5; };
  for (json& place : out["panel_mm"]) {
    if (!place.is_array() || place.size() != 2 || !place[0].is_number() || !place[1].is_number()) return lattice;
    const auto there = map * point<PanelFrame>(place[0].get<double>(), place[1].get<double>());
    place = {rounded(there.x), rounded(there.y)};
  }
  if (out.contains(kLatticeFiducials)) {
    auto offsets = offsets_of_lattice(out);
    for (auto& one : offsets) one.place = map * one.place;
    out[kLatticeFiducials] = lattice_fiducials(offsets);
  }
  return packed_lattice(out.dump());
}

}  // namespace

Result<db::MergeRecord> merge_panels(Repositories& r, DatabaseThread& database, const PanelId& kept,
                                     const PanelId& merged, const std::string& who) {
  const auto there = r.panels.find(kept), here = r.panels.find(merged);
  if (!there) return there.error();
  if (!here) return here.error();
  const auto known = r.panels.fiducials(kept), others = r.panels.fiducials(merged);
  if (!known) return known.error();
  if (!others) return others.error();
  const auto kept_fiducials = to_calib(*known);
  const auto tie = tie_of(*there, kept_fiducials, *here, to_calib(*others));
  if (!tie) return tie.error();
  const bool other_face = tie->kept_from_merged.handedness() == Handedness::kImproper;

  std::vector<db::FiducialRecord> tags;
  for (const auto& fiducial : *others) {
    if (fiducial.kind != db::FiducialKind::kTag || kept_fiducials.tag(fiducial.tag_id) != nullptr) continue;
    db::FiducialRecord& tag = tags.emplace_back(fiducial);
    if (other_face) tag.face = fiducial.face == Face::kShow ? Face::kBack : Face::kShow;
    for (auto& corner : tag.corners) corner = tie->kept_from_merged * corner;
  }
  const auto taken = r.panels.scans(merged);
  if (!taken) return taken.error();
  std::vector<db::ScanRecord> scans;
  // Those of its show face are of another map: a scan of the show face is one that this panel's wood was seen on.
  for (const auto& scan : *taken) {
    if (!other_face || scan.face != Face::kShow) continue;
    db::ScanRecord& back = scans.emplace_back(scan);
    back.id = {}, back.panel = kept, back.face = Face::kBack;
    back.rms = tie->rms;
    back.lattice = moved_lattice(scan.lattice, tie->kept_from_merged);
  }
  const db::MergeRecord merge{kept, merged, tie->kept_from_merged, tie->fiducials, tie->rms, who, utc_timestamp()};
  if (Status done = database.call([&](Repositories& w) { return w.panels.merge(merge, tags, scans); }); !done)
    return done.error();
  return merge;
}

}  // namespace veneer::daemon
