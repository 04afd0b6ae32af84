// The beam's way around one outline: kerf, where the cut may begin, lead-ins, bridges.
//
// The show face of a piece is to be its outline less half the fit clearance. The beam therefore runs
// (kerf at the show face - clearance) / 2 outside it, and burns on the back no farther than the widest kerf: what the
// ledger has booked (docs/KERF.md).
// Pure functions; thread-safe.
#pragma once

#include <optional>
#include <vector>

#include "base/geometry.h"
#include "base/polygon_ops.h"
#include "base/result.h"
#include "planner/cutting/recipe.h"

namespace veneer::planner {

struct LeadOptions {
  Millimetres length{1.0};   // at most; halved once where there is less room
  Millimetres overlap{0.3};  // a cut with a lead-in runs on past its beginning
};

struct BridgeOptions {
  bool on = true;
  Millimetres below{8};    // pieces narrower than this could tip once they are cut free
  Millimetres width{0.4};  // of the wood that stays, on the back
  int count = 2;
};

// How far outside the outline the beam runs; negative: inside.
Millimetres beam_offset(const Recipe& recipe, Millimetres fit_clearance);

// The outline offset by `grow`, counter-clockwise. kInvalidArgument: the outline encloses no single area, or nothing
// single is left of it; the message lacks its subject.
Result<Ring<BedFrame>> beam_ring(const Ring<BedFrame>& outline, Millimetres grow);

// A straight lead-in: where the cut begins, in waste, and the vertex of the beam's ring that it runs to.
template <class Frame>
struct Lead {
  Point<Frame> begin, end;
  friend bool operator==(const Lead&, const Lead&) = default;
};

// Where a cut may begin: a vertex of the ring, and the far end of the lead-in when there is wood for one.
struct Door {
  std::size_t vertex = 0;
  std::optional<Point<BedFrame>> lead;
};

// Sharp corners, where a cut's beginning shows least; on a smooth ring vertices all around it. Without lead-ins.
std::vector<Door> doors_of(const Ring<BedFrame>& ring);
// Those of a hole, led into from `waste`: what the lead-in and its kerf may burn, the band around the ring included.
std::vector<Door> hole_doors(const Ring<BedFrame>& ring, const Region<BedFrame>& waste, Millimetres kerf,
                             const LeadOptions& options);

std::size_t nearest_vertex(const Ring<BedFrame>& ring, const Point<BedFrame>& p);
// Gives the ring a vertex where it passes `p`, unless it has one there. An outline that lies turned or mirrored is
// rounded anew: a point amid a straight edge may be a vertex of its ring in one place and none in another.
void give_vertex(Ring<BedFrame>& ring, const Point<BedFrame>& p);

// What a straight lead-in burns, `kerf` wide, the round end at its beginning included.
Ring<BedFrame> lead_burn(const Point<BedFrame>& lead, const Point<BedFrame>& vertex, Millimetres kerf);

// Straight ways into one corner, from outside and `length` long: along its bisector, and in line with either edge where
// the corner is sharp enough that they part from the ring at once. Each is where the cut would begin.
std::vector<Point<BedFrame>> leads_into(const Ring<BedFrame>& ring, std::size_t vertex, Millimetres length);

// The corners of the ring, at most eight; on a smooth one eight vertices around it.
std::vector<std::size_t> door_vertices(const Ring<BedFrame>& ring);

// Where bridges stay, as distances along the ring from its first vertex: near the middle of long stretches between
// corners, where the ring bends little, since a knife cuts them straight and flush. Where it bends everywhere, they
// stand where it bends least. None stands within its own width of one of `doors`, which are vertices of the ring: a cut
// begins there, and wood that it begins in holds nothing. Empty when no stretch is long enough.
std::vector<double> bridge_places(const Ring<BedFrame>& ring, const BridgeOptions& options,
                                  const std::vector<std::size_t>& doors);

// The least distance between two parallels that enclose the ring.
Millimetres narrowest_width(const Ring<BedFrame>& ring);

// The ring from the door around, less the bridges with the kerf on both sides of them: paths in the order of burning. A
// single one without bridges and lead-in ends where it begins. A bridge that reaches as far as the door is none.
std::vector<Polyline<BedFrame>> cut_paths(const Ring<BedFrame>& ring, const Door& door,
                                          const std::vector<double>& bridges, Millimetres bridge_gap,
                                          const LeadOptions& options);

// How sharply the ring turns at a vertex; radians, 0 = straight on.
double turn_at(const Ring<BedFrame>& ring, std::size_t i);

}  // namespace veneer::planner
