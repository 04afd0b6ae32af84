#include "calib/part_relation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "calib/hole_tie.h"
#include "calib/point_fit.h"

namespace veneer::calib {
namespace {

using PanelPlaces = std::vector<Point<PanelFrame>>;
using PartMap = Isometry2<PanelFrame, PanelFrame>;

constexpr const char* kPartRemedy =
    "leave two tags or holes of it on each part, far from each other; a part from which nothing was cut may be scanned "
    "as a fresh sheet, with none of the old tags on it";

// The same places in both frames, and the middle of each tag or hole in the part's.
struct Common {
  PanelPlaces part, parent, middles;
  std::vector<std::string> names;  // of each place: "tag 12"
};

Point<PanelFrame> middle_of_tag(const std::array<Point<PanelFrame>, 4>& corners) {
  Point<PanelFrame> sum = point<PanelFrame>(0, 0);
  for (const auto& corner : corners) sum.x += corner.x / 4, sum.y += corner.y / 4;
  return sum;
}

Common common_tags(const PanelFiducials& part, const PanelFiducials& parent) {
  Common out;
  for (const PanelTag& tag : part.tags) {
    const PanelTag* const before = parent.tag(tag.id);
    if (before == nullptr || tag.face != Face::kShow || before->face != Face::kShow) continue;
    out.part.insert(out.part.end(), tag.corners.begin(), tag.corners.end());
    out.parent.insert(out.parent.end(), before->corners.begin(), before->corners.end());
    out.names.insert(out.names.end(), 4, fmt::format("tag {}", tag.id));
    out.middles.push_back(middle_of_tag(tag.corners));
  }
  return out;
}

void add_hole(Common& common, const PanelHole& part, const PanelHole& parent) {
  common.part.push_back(part.centre);
  common.parent.push_back(parent.centre);
  common.names.push_back(fmt::format("the hole at {:.0f}, {:.0f} mm", part.centre.x.count(), part.centre.y.count()));
  common.middles.push_back(part.centre);
}

// Each hole of the parent is one of the part's at most.
void add_holes_near(Common& common, const PartMap& part_from_parent, const PanelFiducials& part,
                    const PanelFiducials& parent, Millimetres reach) {
  for (const PanelHole& hole : part.holes) {
    const PanelHole* nearest = nullptr;
    Millimetres least = reach;
    for (const PanelHole& before : parent.holes)
      if (const auto away = distance(part_from_parent * before.centre, hole.centre); away < least)
        least = away, nearest = &before;
    if (nearest != nullptr) add_hole(common, hole, *nearest);
  }
}

Common common_holes(const PanelFiducials& part, const PanelFiducials& parent) {
  Common out;
  PanelPlaces here, there;
  for (const PanelHole& hole : part.holes) here.push_back(hole.centre);
  for (const PanelHole& hole : parent.holes) there.push_back(hole.centre);
  const auto tie =
      calib::match_holes(std::span<const Point<PanelFrame>>(here), std::span<const Point<PanelFrame>>(there));
  // A part does not turn over: the show face is seen in both.
  if (!tie || tie->to_from.handedness() != Handedness::kProper) return out;
  for (const auto& [to, from] : tie->pairs) add_hole(out, part.holes[to], parent.holes[from]);
  return out;
}

// How far wrong a fit to places that are each wrong by `one` may be in the farthest corner (standard deviation): the
// shift by the mean of the places, the angle by how far they lie from their middle.
Millimetres doubt_in_corners(const PanelPlaces& middles, const Box<PanelFrame>& sheet, Millimetres one) {
  const double count = static_cast<double>(middles.size());
  Point<PanelFrame> mean = point<PanelFrame>(0, 0);
  for (const auto& place : middles) mean.x += place.x / count, mean.y += place.y / count;
  double spread = 0, farthest = 0;
  for (const auto& place : middles) spread += std::pow(distance(place, mean).count(), 2);
  for (const auto& corner :
       {sheet.min, sheet.max, Point<PanelFrame>{sheet.min.x, sheet.max.y}, Point<PanelFrame>{sheet.max.x, sheet.min.y}})
    farthest = std::max(farthest, distance(corner, mean).count());
  return one * std::sqrt(1 / count + farthest * farthest / spread);
}

Error not_related(const std::string& why) { return {ErrorCode::kRefused, fmt::format("{}: {}", why, kPartRemedy)}; }

}  // namespace

Result<PartRelation> relate_part(const PanelFiducials& part, const PanelFiducials& parent, const Box<PanelFrame>& sheet,
                                 const PartRelationOptions& options) {
  Common common = common_tags(part, parent);
  if (common.middles.empty()) {
    common = common_holes(part, parent);
    if (common.middles.empty())
      return not_related(
          "the part shares no tag with the panel that it was sawn from, nor three holes that tell how it lay");
  } else {
    const PartMap by_tags = fit_isometry<PanelFrame, PanelFrame>(common.part, common.parent);
    add_holes_near(common, by_tags, part, parent, options.hole_reach);
  }
  if (common.middles.size() < 2)
    return not_related(
        fmt::format("of the panel that it was sawn from the part carries {} only", common.names.front()));
  PartRelation out;
  out.part_from_parent = fit_isometry<PanelFrame, PanelFrame>(common.part, common.parent);
  const auto residual = residual_of(out.part_from_parent, std::span<const Point<PanelFrame>>(common.part),
                                    std::span<const Point<PanelFrame>>(common.parent));
  out.fiducials = static_cast<int>(common.middles.size());
  out.rms = Millimetres(residual.rms);
  if (out.rms > options.max_rms || Millimetres(residual.max) > options.max_single) {
    std::size_t worst = 0;
    const auto off = [&](std::size_t i) { return distance(out.part_from_parent * common.parent[i], common.part[i]); };
    for (std::size_t i = 0; i < common.part.size(); ++i)
      if (off(i) > off(worst)) worst = i;
    return Error{ErrorCode::kRefused,
                 fmt::format("{} lies {:.2f} mm from where it lay in the panel that the part was sawn from: if it was "
                             "glued anew take it off, else scan the part again",
                             common.names[worst], residual.max)};
  }
  out.doubt = doubt_in_corners(common.middles, sheet, std::max(out.rms, options.place_doubt));
  if (!(out.doubt <= options.max_doubt))
    return not_related(
        fmt::format("the tags and holes that the part kept of its panel lie so close together that they "
                    "tell its corners to {:.1f} mm only",
                    out.doubt.count()));
  return out;
}

}  // namespace veneer::calib
