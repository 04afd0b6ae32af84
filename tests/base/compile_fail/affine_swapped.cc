// expect: no match for 'operator\*'
#include "base/frames.h"

using namespace veneer;

Affine2<MachineFrame, PanelFrame> wrong(const Affine2<MachineFrame, BedFrame>& machine_from_bed,
                                        const Isometry2<BedFrame, PanelFrame>& bed_from_panel) {
  return bed_from_panel.affine() * machine_from_bed;
}
