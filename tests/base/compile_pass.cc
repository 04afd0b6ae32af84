// The right way round of everything in compile_fail/: what must compile, so that those fail for their own reason.
#include "base/frames.h"
#include "base/ids.h"
#include "base/polygon_ops.h"
#include "base/result.h"

using namespace veneer;

Millimetres sum() { return 3_mm + Millimetres(2.5); }
Pixels pixels(ScanResolution resolution) { return resolution.to_px(4_mm) + 1_px; }
Point<BedFrame> there_and_back(const Isometry2<BedFrame, PanelFrame>& bed_from_panel,
                               const Isometry2<PanelFrame, ArtworkFrame>& panel_from_artwork,
                               const Point<ArtworkFrame>& p) {
  const Isometry2<BedFrame, ArtworkFrame> bed_from_artwork = bed_from_panel * panel_from_artwork;
  return bed_from_panel * (bed_from_panel.inverse() * (bed_from_artwork * p));
}
Affine2<MachineFrame, PanelFrame> machine(const Affine2<MachineFrame, BedFrame>& machine_from_bed,
                                          const Isometry2<BedFrame, PanelFrame>& bed_from_panel) {
  return machine_from_bed * bed_from_panel.affine();
}
Region<PanelFrame> common(const Region<PanelFrame>& a, const Region<PanelFrame>& b) { return intersect(a, b); }
Result<int> count();
Status stop();
bool heeded() { return count().ok() && stop().ok(); }
void book(PieceId piece);
void booked(PieceId piece) { book(piece); }
