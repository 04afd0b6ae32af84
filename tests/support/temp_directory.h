// A directory of its own for one test; gone with the test. In memory where there is such a place, so that no test waits
// for a disk; on the disk when a test writes more than memory should hold.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

namespace veneer::testing {

class TempDirectory {
 public:
  enum class Place { kMemory, kDisk };

  explicit TempDirectory(Place place = Place::kMemory) {
    std::error_code ignored;
    const bool in_memory = place == Place::kMemory && std::filesystem::is_directory("/dev/shm", ignored);
    const std::filesystem::path parent = in_memory ? "/dev/shm" : std::filesystem::temp_directory_path();
    std::string name = (parent / "veneer-test-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) std::abort();
    path_ = name;
  }
  TempDirectory(const TempDirectory&) = delete;
  TempDirectory& operator=(const TempDirectory&) = delete;
  ~TempDirectory() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

}  // namespace veneer::testing
