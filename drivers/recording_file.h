// The file behind `file:/path` as a laser's port: bytes are written into it, and whatever it may be, it is no laser.
//
// Only a plain file is written to, one that is there or a new one; a link to one is followed. Devices, pipes and
// sockets are refused without being waited for: a real controller might stand behind them, and none of what keeps a
// real laser's beam off applies to a file.
#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string_view>

#include "base/result.h"

namespace veneer {

class RecordingFile {
 public:
  // Empty then. kInvalidArgument when it is no plain file, kUnavailable when it cannot be written.
  Status open(const std::filesystem::path& path);
  bool is_open() const { return file_ != nullptr; }
  void write(std::string_view bytes) noexcept;
  // What was written is with the system when this returns.
  void flush() noexcept;
  void close() noexcept { file_.reset(); }

 private:
  struct Close {
    void operator()(std::FILE* file) const noexcept { static_cast<void>(std::fclose(file)); }
  };
  std::unique_ptr<std::FILE, Close> file_;
};

}  // namespace veneer
