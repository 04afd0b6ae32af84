// The lock of the one that may write to a database, or put another file in its place: `<file>.lock`.
//
// flock() belongs to the open file, so that a second one of this process is refused as well, and a process that dies
// leaves nothing behind.
#pragma once

#include <filesystem>
#include <utility>

#include "base/result.h"

namespace veneer::db {

class WriterLock {
 public:
  // Makes the database's folder. kStorage when the lock's file cannot be written, kUnavailable when somebody has it.
  static Result<WriterLock> take(const std::filesystem::path& file);
  WriterLock(WriterLock&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  WriterLock& operator=(WriterLock&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~WriterLock();

  // That a database was made is written into the lock's file, where it outlives the database: an empty file is none
  // that is to be made then. A note that the disk does not take is missing.
  bool was_made() const;
  void note_made() const noexcept;
  void note_gone() const noexcept;  // somebody removed the file: a new one is to be made

 private:
  explicit WriterLock(int fd) : fd_(fd) {}
  int fd_;
};

}  // namespace veneer::db
