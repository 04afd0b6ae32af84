// The strips of wood of a part, which was sawn from a panel. They are the parent's strips: pieces that were cut from a
// strip part it for the eye, which would make a zone of what is left between each two of them. Pure.
#pragma once

#include <vector>

#include "base/frames.h"
#include "base/geometry.h"
#include "db/materials.h"

namespace veneer::daemon {

// Each zone of the parent in which wood of the part was seen, with its number, material and confidence, as far as it
// lies on the part's `sheet`; then, with numbers and without a material, what was seen of wood where the parent has no
// zone, as sure as it was seen.
// `seen`: the zones that the part's own scan shows.
std::vector<db::ZoneRecord> zones_of_part(const std::vector<db::ZoneRecord>& seen,
                                          const std::vector<db::ZoneRecord>& parent,
                                          const Isometry2<PanelFrame, PanelFrame>& part_from_parent,
                                          const Box<PanelFrame>& sheet);

}  // namespace veneer::daemon
