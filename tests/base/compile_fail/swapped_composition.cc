// expect: no match for 'operator\*'
#include "base/frames.h"

using namespace veneer;

Isometry2<BedFrame, ArtworkFrame> wrong(const Isometry2<BedFrame, PanelFrame>& bed_from_panel,
                                        const Isometry2<PanelFrame, ArtworkFrame>& panel_from_artwork) {
  return panel_from_artwork * bed_from_panel;
}
