// The guardian's watch over one daemon: it waits for the daemon's end, and darkens the machine unless the daemon said
// that it was dark.
//
// What is watched stands in a file (the record): so a guardian, or a computer, that dies as well leaves word for the
// next one. Once darkened it stays there as such until the next daemon: it is darkened once more before that may use
// it, for nobody knows who had hands on it in between. While what a daemon left cannot be darkened, the next one is
// told so and waits, and it is tried again; a machine at another port than the one to be watched is given up after some
// tries. A lock beside it is held by whoever watches or darkens; two
// never do at once.
//
// Blocking; one thread.
#pragma once

#include <sys/types.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "base/log.h"
#include "base/result.h"
#include "guardian/guarded_machine.h"

namespace veneer::guardian {

struct WatchOptions {
  std::filesystem::path record;  // beside it: its name with ".lock"
  std::function<Status(const GuardedMachine&)> darken;
  int tries = 20;  // half a second apart: after a death, then the record stays for the next start
  std::chrono::milliseconds pause{500};
  uid_t daemon = ::geteuid();  // whoever else connects is shown the door, and so is who says nothing for so long
  std::chrono::milliseconds first_line{2000};
};

class Watch {
 public:
  Watch(WatchOptions options, Logger log) : options_(std::move(options)), log_(std::move(log)) {}

  // Speaks with one daemon (guarded_machine.h) until its end and does what is to be done then. The descriptor stays
  // the caller's.
  void serve(int connection);
  // Darkens what the record says was left behind; nothing when there is none, or it was darkened already. Waits for the
  // lock.
  Status settle();

 private:
  class Lock;
  Status darken_left_behind(bool once_more);
  void record(const std::string& line) const;

  WatchOptions options_;
  Logger log_;
};

}  // namespace veneer::guardian
