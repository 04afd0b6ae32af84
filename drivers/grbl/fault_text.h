// The meaning of a controller's error and alarm numbers. Numbers above GRBL's own mean different things on different
// firmware families, so a text always carries number and family.
#pragma once

#include <string>
#include <string_view>

namespace veneer::grbl {

enum class Family { kGrbl, kGrblHal, kFluidNc };

// From the banner: "Grbl 1.1h ['$' for help]", "GrblHAL 1.1f ...", "Grbl 3.7 [FluidNC v3.7 ...".
Family family_of(std::string_view banner);
std::string_view name_of(Family family);

// "error:22 of Grbl (no feed rate given)".
std::string describe_error(int number, Family family);
// "ALARM:1 of Grbl (a limit switch was hit)".
std::string describe_alarm(int number, Family family);

}  // namespace veneer::grbl
