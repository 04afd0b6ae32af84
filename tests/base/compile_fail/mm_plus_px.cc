// expect: no match for 'operator\+' .*MillimetreUnit.*PixelUnit
#include "base/units.h"

using namespace veneer::literals;

veneer::Millimetres wrong() { return 3_mm + 4_px; }
