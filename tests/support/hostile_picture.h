// Pictures that want to hurt whoever looks at them: cut off, mutated, of forged size, bombs; and honest ones among
// them.
#pragma once

#include <cstdint>
#include <string>

namespace veneer::tests {

struct HostilePicture {
  std::string what;  // "PNG, 17 bytes changed"
  std::string bytes;
};
// The same for the same seed.
HostilePicture hostile_picture(std::uint64_t seed);

}  // namespace veneer::tests
