// expect: no matching function for call to 'intersect\(
#include "base/polygon_ops.h"

using namespace veneer;

Region<PanelFrame> wrong(const Region<PanelFrame>& a, const Region<BedFrame>& b) { return intersect(a, b); }
