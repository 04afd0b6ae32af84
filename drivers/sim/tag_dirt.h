// What happens to tags in a workshop: they are stained, scorched, pasted over, and come loose.
//
// Not thread-safe towards the sheet.
#pragma once

#include <cstdint>

#include "drivers/sim/random.h"
#include "drivers/sim/sheet.h"

namespace veneer::sim {

// `amount` 0 to 1: how likely each tag has a stain or a scorched corner; from 0.5 on one tag of each face is pasted
// over by half.
void soil_tags(Sheet& sheet, double amount, std::uint64_t seed);

// One tag of the face moves by `by_mm`, some way. sheet.tags keeps where it was.
void slip_one_tag(Sheet& sheet, SheetFace face, double by_mm, Random& random);

}  // namespace veneer::sim
