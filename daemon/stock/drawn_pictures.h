// Pictures that were drawn for people, by the version of what they were drawn of: the next who asks for the same gets
// it as it is. The last few, in memory. Thread-safe.
#pragma once

#include <chrono>
#include <cstddef>
#include <list>
#include <mutex>
#include <optional>
#include <string>

namespace veneer::daemon {

class DrawnPictures {
 public:
  static constexpr std::size_t kMostBytes = 32 << 20;  // some ten pictures of panels
  explicit DrawnPictures(std::size_t most_bytes = kMostBytes) : most_bytes_(most_bytes) {}

  // The file, as it was kept.
  std::optional<std::string> find(const std::string& version) const;
  // One that would take more than half of the room is not kept.
  void keep(const std::string& version, const std::string& file) const;
  // Gives up those that nobody has asked for since then, and says whether there were any.
  bool forget_unasked(std::chrono::steady_clock::time_point since) const;

 private:
  struct Drawn {
    std::string version, file;
    std::chrono::steady_clock::time_point asked;
  };
  const std::size_t most_bytes_;
  mutable std::mutex mutex_;
  mutable std::list<Drawn> drawn_;  // the last one asked for first; guarded by mutex_
};

}  // namespace veneer::daemon
