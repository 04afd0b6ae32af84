// The wood of one place of a panel, read from its map's tiles: a panel of two hundred million pixels is not decoded for
// a piece of it. Any thread but the reactor: it reads files, and has the tiles made where there are none.
#pragma once

#include <string>

#include "base/raster.h"
#include "base/result.h"
#include "daemon/stock/panel_library.h"

namespace veneer::daemon {

// What of the map holds this box, at one to two times `side_px` pixels along the box's longer side, or as fine as the
// map is; beyond the map its last pixels go on. kInvalidArgument: the box lies beside the map. Otherwise as
// PanelLibrary::load_tile().
Result<Raster<PanelFrame>> wood_of_place(const PanelLibrary& library, const std::string& map_file,
                                         const Box<PanelFrame>& place, int side_px, PanelLibrary::MissingTiles missing);

}  // namespace veneer::daemon
