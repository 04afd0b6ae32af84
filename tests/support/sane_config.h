// SANE's configuration with its own `test` and `pnm` backends and no others, in a folder of a test's.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

namespace veneer::testing {

// Where Debian puts them (libsane1, which libsane-dev brings along).
inline bool sane_backends_are_here() {
  std::error_code none;
  for (const auto& folder : std::filesystem::directory_iterator("/usr/lib", none)) {
    const auto backends = folder.path() / "sane";
    if (std::filesystem::exists(backends / "libsane-test.so.1", none) &&
        std::filesystem::exists(backends / "libsane-pnm.so.1", none))
      return true;
  }
  return false;
}

// The folder is SANE_CONFIG_DIR then. `test_conf` is what its test backend begins with, lines as "resolution 300";
// SANE reads it anew each time it is started.
inline void write_sane_config(const std::filesystem::path& folder, const std::string& test_conf = "") {
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "dll.conf") << "test\npnm\n";
  std::ofstream(folder / "test.conf") << "number_of_devices 2\n" << test_conf;
}

}  // namespace veneer::testing

#define VENEER_NEEDS_SANE_BACKENDS()                \
  if (!::veneer::testing::sane_backends_are_here()) \
  GTEST_SKIP() << "SANE's test and pnm backends are not here: apt-get install libsane1"
