// Which wood of a veneer map can be used, on a board and of a wood of any colour.
//
// The board is learnt from the map's own rim. Strips are where the map is unlike the board, in colour or in texture,
// between straight sides; a gap is a band of board, lit or shaded, between two sides. A strip's own colours are those
// it shows all over: what is far from all of them (screws, holes, cracks), and what is round, is taken out, as are tags
// and through-holes. A margin is kept from every edge. A strip that is not known well enough is asked about and
// withheld. Equal inputs give equal masks. Thread-safe.
#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "base/raster.h"
#include "base/result.h"
#include "calib/fiducials.h"

namespace veneer::calib {

struct MaskOptions {
  Millimetres edge_margin{0.5};   // kept from strips' edges, gaps and missing pieces
  Millimetres screw_margin{0.7};  // kept from screw holes
  Millimetres fiducial_margin{1.5};
  SquareMillimetres smallest_zone{150};  // smaller islands of wood are dropped
  double least_confidence = 0.5;         // of a strip that is taken without asking
};

// A strip, or what is connected of it.
struct Zone {
  int label = 0;  // its value in VeneerMask::zones
  Box<PanelFrame> box;
  SquareMillimetres area{0};
  double lightness = 0;   // mean grey level, 0 to 255
  double confidence = 1;  // 0 to 1: that this is veneer, whole, and ends where its sides were seen
};

struct ScrewHole {
  Point<PanelFrame> centre{};
  Millimetres diameter{0};
};

// A strip that is in doubt: withheld, or taken but for much that does not look like the rest of it.
struct AskedStrip {
  std::array<Point<PanelFrame>, 4> outline{};  // lower left, lower right, upper right, upper left
  double confidence = 0;
  bool taken = false;
  std::string reason;            // for the operator, the end of a sentence
  std::vector<ScrewHole> round;  // what is round in it, of one that is withheld
};

// A hair or fibre on the scanner's glass that lies over veneer: what it hides is withheld.
struct HairOnGlass {
  Point<PanelFrame> middle{};
  Millimetres length{0};
};

struct VeneerMask {
  Raster<PanelFrame> usable;  // CV_8UC1, 255 = usable wood; as large as the map
  Raster<PanelFrame> zones;   // CV_8UC1, a zone's label on its usable wood, 0 elsewhere
  std::vector<Zone> list;     // by label, from 1; left to right
  std::vector<ScrewHole> screws;
  std::vector<AskedStrip> asked;
  std::vector<HairOnGlass> hairs;
};

// What was accepted of the same panel before, both as large as the map.
struct EarlierLook {
  const Raster<PanelFrame>& map;
  const Raster<PanelFrame>& usable;
};

// `map` shows the show face, CV_8UC3. With an earlier look, what was usable then and looks the same is usable: wood
// does not grow back, and strips need not be found again on what cuts have left. kInvalidArgument for another type or
// size, kRefused when no veneer is found, or none that is known.
Result<VeneerMask> mask_veneer(const Raster<PanelFrame>& map, const PanelFiducials& fiducials,
                               const MaskOptions& options = {}, const EarlierLook* earlier = nullptr);

}  // namespace veneer::calib
