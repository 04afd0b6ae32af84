// Whether an arc may be sent at all.
//
// Of a line, a digit that is lost, doubled or changed shows when the machine's position is compared at the end of the
// piece. An arc can end at the right place and still be another one: GRBL takes a centre as long as its distances to
// both ends differ by no more than 0.005 mm or a thousandth of the radius, so that a lost decimal point makes a
// straight line of it, and a lost sign may send the beam the long way round. Every such change of one character is
// tried here beforehand. Pure; thread-safe.
#pragma once

#include <string>

#include "base/arc_fit.h"
#include "drivers/grbl/settings.h"

namespace veneer::grbl {

// "I-0.607J0.512": the centre as seen from the arc's begin.
std::string centre_words(WirePoint from, const ArcShape& arc);

// No change of one character of the centre's words leaves a line that the controller takes and whose way is more than
// 0.02 mm from the arc's.
bool arc_is_safe(WirePoint from, WirePoint to, const ArcShape& arc);

}  // namespace veneer::grbl
