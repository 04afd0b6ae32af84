// expect: no match for 'operator\*'
#include "base/frames.h"

using namespace veneer;

Point<BedFrame> wrong(const Isometry2<BedFrame, PanelFrame>& bed_from_panel, const Point<ArtworkFrame>& p) {
  return bed_from_panel * p;
}
