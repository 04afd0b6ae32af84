// The area book of a panel: what each square millimetre of it is. The classes are disjoint and together the panel.
//
// Areas are exact (pixels of the mask as the squares they are, outlines as the ledger holds them), and each is counted
// on its own: none is what the others leave of the panel, so that their sum tells whether they are true. It holds to
// rounding; where wood lies across the panel's border, its corners there are whole micrometres. Free and unusable wood
// are the mask's pixels of either kind, less what of these pixels is booked: what is booked is counted once for each
// allocation and kept, so that pixels are not looked at again with each question. What is free here is a little more
// than what a plan may use, which takes no part of a pixel. Pure; thread-safe.
#pragma once

#include "base/raster.h"
#include "db/ledger.h"

namespace veneer::daemon {

struct AreaBook {
  SquareMillimetres panel{0};     // width times height
  SquareMillimetres free{0};      // usable, and nothing is booked on it
  SquareMillimetres reserved{0};  // leased, or for pieces that are not cut yet or are being cut: kerf included
  SquareMillimetres cut{0};       // became pieces
  SquareMillimetres kerf{0};      // burnt around those: the band and the lead-in
  SquareMillimetres suspect{0};   // somebody has to look: kerf included
  SquareMillimetres scrap{0};     // pieces that were lost, kerf included, and wood written off
  SquareMillimetres unusable{0};  // neither usable nor booked
};

// What of an area the mask calls usable, and what it does not or does not reach.
struct MaskedWood {
  SquareMillimetres usable{0}, unusable{0};
};

// What of a panel an allocation takes. It never changes, but for `pixels` with another mask.
struct BookedWood {
  SquareMillimetres whole{0};    // all that nobody else may use
  SquareMillimetres outline{0};  // of that the piece
  SquareMillimetres kerf{0};     // and what is around it; of wood that is no piece's all of it
  MaskedWood pixels;             // the whole, by what the mask says
};

// The panel as an area in its own frame: from its corner to `width`, `height`.
Region<PanelFrame> whole_panel(Millimetres width, Millimetres height);
// The same of the panel, by its mask (non-zero = usable).
MaskedWood masked_panel(const Raster<PanelFrame>& mask, Millimetres width, Millimetres height);

// What lies outside of the panel does not count.
BookedWood booked_wood(const db::AllocationRecord& allocation, const Raster<PanelFrame>& mask,
                       const Region<PanelFrame>& panel);

// Adds to `book` what `wood` is in `state`; free and unusable wood become less. A book without any: opened().
AreaBook opened(const Region<PanelFrame>& panel, const MaskedWood& wood);
void enter(AreaBook& book, const BookedWood& wood, db::AllocationState state);

}  // namespace veneer::daemon
