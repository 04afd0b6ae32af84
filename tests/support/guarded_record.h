// What a guardian has written down beside a daemon's database (guardian/watch.h).
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

namespace veneer::tests {

// May a machine be left burning, for all the record says?
inline bool watched(const std::filesystem::path& data_dir) {
  std::ifstream in(data_dir / "guarded");
  std::string line;
  return std::getline(in, line) && !line.starts_with("dark ");
}

// Was one darkened after the daemon's death?
inline bool darkened(const std::filesystem::path& data_dir) {
  return std::filesystem::exists(data_dir / "guarded") && !watched(data_dir);
}

}  // namespace veneer::tests
