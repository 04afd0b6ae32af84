// Work that may fail or be given foreign data, and is therefore done outside the process that owns the laser.
//
// A piece of work is a pure function of its request and the files named in it; what it makes are files in its folder
// and a result in JSON. Two ways to have it done: in a process of its own (worker_processes.h), or at once, in tests.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "base/result.h"

namespace veneer::daemon {

using TaskProgress = std::function<void(double fraction, const std::string& text)>;

struct WorkOrder {
  std::string kind;  // what the worker is asked to do, a word it knows
  std::string what;  // for sentences: "planning", "drawing the picture"
  nlohmann::json request;
  std::filesystem::path folder;                 // its own; what it may write to
  std::vector<std::filesystem::path> readable;  // what else it needs: files or folders
  std::vector<std::filesystem::path> writable;
  std::optional<std::vector<std::filesystem::path>> devices;  // of all devices these (confinement.h); none: no device
  bool network = false;                                       // REQUIRES: `devices`, if an empty list
  std::chrono::milliseconds deadline{0};
  // At a stop request or the deadline it is told to end, and killed when it has not by then. 0: killed at once.
  std::chrono::milliseconds grace{0};
  int nice = 5;
};

class WorkRunner {
 public:
  virtual ~WorkRunner() = default;
  // Blocks until the work is done, has failed or is stopped; then nothing of it goes on. `progress` is called on the
  // calling thread. Errors are the work's own, or: kCancelled after a stop request, kTimeout after the deadline,
  // kUnavailable when memory ran out or the work's process was killed, kInternal when it crashed or answered nonsense.
  // Thread-safe.
  virtual Result<nlohmann::json> run(const WorkOrder& order, const TaskProgress& progress, std::stop_token stop) = 0;
};

}  // namespace veneer::daemon
