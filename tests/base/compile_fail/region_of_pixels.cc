// expect: regions live in millimetre frames
#include "base/polygon_ops.h"

veneer::Region<veneer::CameraFrame> wrong;
