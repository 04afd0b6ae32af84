// What marks a panel: tags on each face and through-holes, at frozen places in PanelFrame.
//
// Corners are in the detector's order (Tag::corners). A back tag's corners are where they lie as seen *through* the
// panel from the show face, so there they run clockwise.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "base/face.h"
#include "base/geometry.h"

namespace veneer::calib {

struct PanelTag {
  int id = -1;
  Face face = Face::kShow;
  std::array<Point<PanelFrame>, 4> corners{};
};

struct PanelHole {
  Point<PanelFrame> centre{};
  Millimetres diameter{6};
};

// How well one fiducial fits the others: a tag by its id, or a hole by its place.
struct FiducialOffset {
  int tag = -1;  // a hole: -1
  Point<PanelFrame> place{};
  Millimetres off{0};  // from where the others put it, rms of its corners
};
// "tag 212", "the hole at 12, 40".
std::string name_of(const FiducialOffset& fiducial);

struct PanelFiducials {
  std::vector<PanelTag> tags;  // sorted by id
  std::vector<PanelHole> holes;

  const PanelTag* tag(int id) const {
    for (const PanelTag& t : tags)
      if (t.id == id) return &t;
    return nullptr;
  }
  bool knows(Face face) const {
    for (const PanelTag& t : tags)
      if (t.face == face) return true;
    return false;
  }
};

}  // namespace veneer::calib
