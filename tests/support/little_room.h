// A disk that is full, for this process.
#pragma once

#include <sys/resource.h>

#include <csignal>

namespace veneer::testing {

// While it lives, no file may grow beyond so many bytes.
class LittleRoom {
 public:
  explicit LittleRoom(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit little{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &little);
  }
  LittleRoom(const LittleRoom&) = delete;
  LittleRoom& operator=(const LittleRoom&) = delete;
  ~LittleRoom() { ::setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_{};
};

}  // namespace veneer::testing
