// expect: an isometry keeps the unit
#include "base/frames.h"

veneer::Isometry2<veneer::PanelFrame, veneer::ScanFrame> wrong;
