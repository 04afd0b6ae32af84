// expect: cannot convert .*PixelUnit.*MillimetreUnit
#include "base/units.h"

using namespace veneer::literals;

veneer::Pixels wrong(veneer::ScanResolution resolution) { return resolution.to_px(4_px); }
