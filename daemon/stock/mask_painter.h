// A panel's mask with what people painted on it: wood that was given back, wood that is withheld. A layer over what a
// scan saw, so that a later scan gets it too and each edit can be taken back.
//
// Blocks on files and the database; any thread but the reactor.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/polygon_ops.h"
#include "base/raster.h"
#include "base/result.h"
#include "daemon/stock/panel_library.h"
#include "daemon/store/database_thread.h"

namespace veneer::daemon {

struct MaskPaint {
  std::vector<db::MaskEdit> edits;         // that count, the oldest first: of two that meet the later one wins
  std::vector<Region<PanelFrame>> spared;  // never given: tags and holes, with a margin
  std::vector<Region<PanelFrame>> gone;    // nor this: a scan found no wood there, and nobody has decided
};

// Round a point; across its diagonals 4 % wider than said.
Region<PanelFrame> disc(const Point<PanelFrame>& centre, Millimetres radius);
// The places of these that are never given.
std::vector<Region<PanelFrame>> spared_by(const std::vector<db::FiducialRecord>& fiducials);
// What counts for the panel now. `gone` is what is open now.
Result<MaskPaint> paint_of(Repositories& r, const PanelId& panel);

// `seen`: 255 = usable. A pixel is given when all of it lies in the outline, withheld when a part of it does. Pure.
Raster<PanelFrame> painted(const Raster<PanelFrame>& seen, const MaskPaint& paint);

// Its file lies below the panel's; it is `seen_file` itself where nothing is painted. Where the library remembers the
// mask with all edits but the last, only that one is drawn.
Result<PanelLibrary::PaintedMask> painted_mask(const PanelLibrary& library, const PanelId& panel,
                                               const std::string& seen_file, const MaskPaint& paint);

// Edits that enter with a scan (db/masks.h), drawn one after the other over `scan`, a mask of a panel of this width and
// height, and `paint`; what lies beside the panel is none of them. kConflict: more than a panel's mask takes.
Result<std::vector<db::PaintedEdit>> painted_edits(const PanelLibrary& library, const db::PanelRecord& panel,
                                                   const db::MaskRecord& scan, MaskPaint paint,
                                                   const std::vector<db::MaskEdit>& edits);

// What an outline holds that may cross itself, as a hand draws it; each crossing is a corner. kInvalidArgument when it
// does so more often than a hand would: a thousand lines over one another have half a million crossings.
inline constexpr int kMostCrossings = 2'000;
Result<Region<PanelFrame>> outlined(const Ring<PanelFrame>& corners);

struct EditedMask {
  std::optional<db::MaskEditId> edit;         // the new one
  int version = 0;                            // that counts now
  SquareMillimetres before{0}, usable{0};     // what the mask calls usable
  std::vector<db::AllocationRecord> touched;  // of an edit that withholds: wood that is reserved all the same
};

// Three edits of a panel's mask, each with a new version of it. Their reads come from `r`, writes go to `database`.
// kNotFound, kConflict as db/masks.h says; kInvalidArgument: an outline that lies beside the panel, or has no area.
// `painted_on`: the version that whoever painted it was looking at; kConflict when another one counts by now.
Result<EditedMask> edit_mask(Repositories& r, DatabaseThread& database, const PanelLibrary& library,
                             const PanelId& panel, const db::MaskEdit& edit, std::optional<int> painted_on = {});
Result<EditedMask> remove_mask_edit(Repositories& r, DatabaseThread& database, const PanelLibrary& library,
                                    const PanelId& panel, db::MaskEditId edit, const std::string& who);
// What the scan of `version` saw counts again, with today's edits; nothing: of the scan before the one that counts.
Result<EditedMask> revert_mask(Repositories& r, DatabaseThread& database, const PanelLibrary& library,
                               const PanelId& panel, std::optional<int> version, const std::string& who);

}  // namespace veneer::daemon
