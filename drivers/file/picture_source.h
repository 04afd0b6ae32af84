// Names pictures on disk by one string and hands them out in turn, in the order of their names, round and round.
//
// The string is a picture, a folder (all pictures in it), or a pattern with * and ? in its last part. The disk is
// looked at anew for every picture, so files may come and go. Not thread-safe.
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"

namespace veneer {

struct NamedPicture {
  std::filesystem::path file;
  std::chrono::system_clock::time_point written;  // its last change; long ago where that is not known
};

class PictureSource {
 public:
  explicit PictureSource(std::string pattern);

  // kUnavailable when nothing matches.
  Result<NamedPicture> next();
  // The one that next() would give, which it gives still.
  Result<NamedPicture> peek() const;
  const std::string& pattern() const { return pattern_; }

 private:
  std::string pattern_;
  std::filesystem::path last_;
};

}  // namespace veneer
