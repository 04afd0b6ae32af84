// expect: could not convert '2.5e\+0' from 'double'|conversion from 'double' to non-scalar type
#include "base/units.h"

veneer::Millimetres wrong = 2.5;
