// Which wood of a veneer map can be used.
//
// The board is learnt from the map's own margin (neutral grey), the lid is what is bright and neutral. Veneer is what
// is neither, in strips; screw holes (dark, round, inside a strip), through-holes, tags and missing pieces are taken
// out, and a margin is kept from every edge. Equal inputs give equal masks. Thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "base/raster.h"
#include "base/result.h"
#include "calib/fiducials.h"

namespace veneer::calib {

struct MaskOptions {
  Millimetres edge_margin{0.5};   // kept from strips' edges, gaps and missing pieces
  Millimetres screw_margin{0.7};  // kept from screw holes
  Millimetres fiducial_margin{1.5};
  Millimetres screw_diameter_min{2.5}, screw_diameter_max{5.5};
  SquareMillimetres smallest_zone{150};  // smaller islands of wood are dropped
};

// A strip, or what is connected of it.
struct Zone {
  int label = 0;  // its value in VeneerMask::zones
  Box<PanelFrame> box;
  SquareMillimetres area{0};
  double lightness = 0;  // mean grey level, 0 to 255
};

struct ScrewHole {
  Point<PanelFrame> centre{};
  Millimetres diameter{0};
};

struct VeneerMask {
  Raster<PanelFrame> usable;  // CV_8UC1, 255 = usable wood; as large as the map
  Raster<PanelFrame> zones;   // CV_8UC1, a zone's label on its usable wood, 0 elsewhere
  std::vector<Zone> list;     // by label, from 1; left to right
  std::vector<ScrewHole> screws;
};

// `map` shows the show face, CV_8UC3. `earlier` is the usable mask of the same panel before something was cut (as large
// as the map), or null: wood does not grow back, and a screw hole that a cut has opened is hard to see.
// kInvalidArgument for another type or size, kRefused when no veneer is found.
Result<VeneerMask> mask_veneer(const Raster<PanelFrame>& map, const PanelFiducials& fiducials,
                               const MaskOptions& options = {}, const Raster<PanelFrame>* earlier = nullptr);

}  // namespace veneer::calib
