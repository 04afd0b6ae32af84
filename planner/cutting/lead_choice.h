// Where the cuts of a panel's pieces begin in waste. Chosen when the wood is reserved, because what a lead-in burns is
// booked with its piece: nobody else's wood, no fiducial and nothing outside the usable wood is ever led through.
//
// Waste between pieces that nothing fits into comes first; of beginnings as good, the one that makes the way of the
// head short. A piece too closely surrounded gets none. Deterministic. Pure functions; thread-safe.
#pragma once

#include <optional>
#include <vector>

#include "base/geometry.h"
#include "base/polygon_ops.h"
#include "base/raster.h"
#include "base/result.h"
#include "planner/cutting/toolpath.h"

namespace veneer::planner {

// Wood that stays between a lead-in and whatever else is cut: it holds the waste, which would fall out as soon as burns
// enclosed it, booked by nobody.
inline constexpr Millimetres kWeb{0.4};
// The same between two pieces with curved borders (PlanOptions::web); no wider, because it costs wood all around each.
inline constexpr Millimetres kPieceWeb{0.2};

// A piece to be cut, in PanelFrame.
struct LeadPiece {
  Ring<PanelFrame> outline;
  std::string mark;
  Radians artwork_up{kPi / 2};
  Recipe recipe;
  Region<PanelFrame> allocation;  // what is booked for it without a lead-in
};

struct LeadIn {
  Lead<PanelFrame> way;
  Region<PanelFrame> burnt;  // to be booked as well; it overlaps the piece's own allocation
};

struct LeadRoom {
  Raster<PanelFrame> free;  // as StockPanel::free, before these pieces
  std::vector<Region<PanelFrame>> spared;
  Millimetres kerf;  // what is booked around every beam
};

// One for each piece, in order; none where no wood is left for it, or when `options.leads.length` is 0.
// kInvalidArgument as make_toolpath.
Result<std::vector<std::optional<LeadIn>>> choose_leads(const std::vector<LeadPiece>& pieces, const LeadRoom& room,
                                                        const ToolpathOptions& options);

// The lead-in of which only the beginning was kept. Its end is found here, where the outline lies as it did when the
// wood was booked: turned on the bed and rounded anew, its ring may have another vertex that is nearer.
// kInvalidArgument as make_toolpath; the message lacks its subject.
Result<Lead<PanelFrame>> lead_of(const Ring<PanelFrame>& outline, const Point<PanelFrame>& begin, const Recipe& recipe,
                                 Millimetres fit_clearance);

// What it burns with a kerf of `width`.
Region<PanelFrame> lead_burn(const Lead<PanelFrame>& lead, Millimetres width);

}  // namespace veneer::planner
