// What a worker process may do to the machine it runs on: compute, read what it was given, write into its folder.
//
// It can open no device (so not the laser's port), no socket (so not the daemon's own), no other process; it makes no
// process, and the kernel ends it before all others when memory runs out. One that works with scanners or cameras may
// open the devices it was given and no others; one that works with scanners, or sends notices, may speak to the network
// as well, but still not to the daemon or any other process of this machine through a Unix socket. Works for root and
// for anybody, also within the shipped unit. Files are kept from it by Landlock (Linux 5.13); where the kernel has
// none, devices are hidden from it in a mount namespace of its own instead.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "base/result.h"

namespace veneer::daemon {

struct Confinement {
  std::uint64_t memory_bytes = 0;  // private memory of the process; 0: not limited
  int nice = 0;
  std::vector<std::filesystem::path> readable;                // files or folders, besides the system's libraries
  std::vector<std::filesystem::path> writable;                // folders
  std::optional<std::vector<std::filesystem::path>> devices;  // files in /dev, or links to them; none: no ioctl at all
  // The network, and what programs look up for it and for devices on USB. REQUIRES: `devices`, if an empty list.
  bool network = false;
  bool without_landlock = false;  // as on a kernel that has none; for tests
};

// Of the calling process, which must have one thread; for good. kUnavailable: the kernel lacks what is needed, and then
// no foreign data may be touched.
Status confine(const Confinement& limits);

}  // namespace veneer::daemon
