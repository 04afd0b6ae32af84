// One piece as people look for it: beside which others it lies in the artwork, and how its wood looked before it was
// cut. Pure; thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "base/raster.h"
#include "db/job_store.h"

namespace veneer::daemon {

// The marks of those of `pieces` that share an edge with it in the artwork, a millimetre of it at least; in their
// order.
std::vector<std::string> neighbours_of(const db::PieceRecord& piece, const std::vector<db::PieceRecord>& pieces);

// The piece as it lies in the artwork, show face up and upright, in the wood around it, which is paler. At most
// `width_px` wide; no finer than the map. An empty picture for a piece that has no wood.
cv::Mat draw_piece(const Raster<PanelFrame>& map, const db::PieceRecord& piece, int width_px);

// The wood alone, cut to the outline: show face up and upright as in the artwork, BGR with alpha, clear outside. It
// fills the outline's upright box; its longer side has at most `side_px` pixels, no finer than the map.
cv::Mat cut_out_piece(const Raster<PanelFrame>& map, const Ring<ArtworkFrame>& outline,
                      const Isometry2<PanelFrame, ArtworkFrame>& panel_from_artwork, int side_px);

}  // namespace veneer::daemon
