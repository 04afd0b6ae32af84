// Pictures and drawings that want to hurt whoever looks at them: cut off, mutated, of forged size, bombs; and honest
// ones among them, which say so.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace veneer::tests {

struct HostilePicture {
  std::string what;  // "PNG, 17 bytes changed"
  std::string bytes;
  bool honest = false;  // as it should be: told apart, and not counted among the hostile
};
// The same for the same seed. Never empty.
HostilePicture hostile_picture(std::uint64_t seed);
// An SVG for `veneerctl laser run`.
HostilePicture hostile_svg(std::uint64_t seed);
// A body of POST /laser/run, dry and out of every machine's reach where it can be read.
HostilePicture hostile_run(std::uint64_t seed);
// A drawing of areas that become pieces (segmentation_bytes): an SVG with a style sheet, now and then a picture.
HostilePicture hostile_areas(std::uint64_t seed);
// What these texts were before they were changed.
std::string honest_svg();
std::string honest_run();
std::string honest_areas();

// Small files of pictures that take gigabytes: 30,000 x 30,000 grey, and 19,000 x 19,000 of 16 bits in four channels.
// To make them takes as much.
std::vector<HostilePicture> largest_bombs();

}  // namespace veneer::tests
