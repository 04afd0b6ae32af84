// The developer's data set, which benchmarks of pictures and wood read: VENEER_DATA names its folder, else it lies
// beside the sources.
#pragma once

#include <cstdlib>
#include <filesystem>

namespace veneer::bench {

inline std::filesystem::path data_folder() {
  const char* named = std::getenv("VENEER_DATA");  // NOLINT(concurrency-mt-unsafe): nothing sets it
  if (named != nullptr) return named;
  return std::filesystem::path(VENEER_SOURCE) / ".." / "shared" / "data";
}

}  // namespace veneer::bench
