// A small file of the data folder that follows what changes in memory: written whole by a thread of its own, so that
// nobody waits for a disk. Of changes that come faster than the disk takes them only the newest is written. It may be
// lost, and need not be writable: then what it keeps is of this life of the daemon only.
//
// Bound to the reactor. The worker outlives it or finishes what was posted to it.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>

#include "base/log.h"
#include "daemon/threads/worker.h"

namespace veneer::daemon {

class KeptFile {
 public:
  KeptFile(std::filesystem::path file, Logger log);

  // Null when there is none, or nobody can read it. It waits for the disk: to be asked before the reactor runs.
  nlohmann::json read() const;
  // `content` is made on the worker.
  void write(Worker& worker, std::function<nlohmann::json()> content);

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace veneer::daemon
