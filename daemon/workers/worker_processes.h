// Has work done by processes of the program veneer-worker: one for each piece of work, ended with it.
//
// The order goes to the process as one line of JSON; it answers with lines down a pipe: {"progress": 0.3, "text":
// "..."} any number of times, then {"done": ...}, {"error": {"code", "message"}} or {"out_of_memory": true}. Work with
// WorkOrder::grace is told to end by one more line, "stop", and then has that long until it is killed. It
// inherits no other descriptor, confines itself before it looks at anything foreign (confinement.h), and dies with this
// process (work_server.h). When it says anything else, dies, does not end in time, or fills the disk that the ledger
// needs, its work has failed and nothing else.
//
// Started by posix_spawn: Boost.Process 1.74 forks (a copy of the page tables of a process that must answer a laser),
// closes descriptors by opendir() between fork and exec, where a child of many threads may not allocate, and waits with
// a deadline by taking over the whole process's SIGCHLD.
//
// Thread-safe; run() must not be called on the reactor (it waits).
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>

#include "base/log.h"
#include "daemon/workers/work_runner.h"

namespace veneer::daemon {

std::optional<std::uint64_t> free_on_disk(const std::filesystem::path& folder);

struct WorkerProcessOptions {
  std::filesystem::path program;
  std::uint64_t memory_bytes = 0;  // of each process; 0: not limited
  // Called with each process that has begun. For tests.
  std::function<void(pid_t)> on_start;
  // Bytes free on the disk of this folder; nothing when nobody can tell.
  std::function<std::optional<std::uint64_t>(const std::filesystem::path&)> free_space = free_on_disk;
};

class WorkerProcesses final : public WorkRunner {
 public:
  WorkerProcesses(WorkerProcessOptions options, Logger log);
  Result<nlohmann::json> run(const WorkOrder& order, const TaskProgress& progress, std::stop_token stop) override;

 private:
  WorkerProcessOptions options_;
  Logger log_;
};

// veneer-worker, beside this program.
std::filesystem::path worker_program();
// Three quarters of the machine's memory.
std::uint64_t usual_worker_memory();

}  // namespace veneer::daemon
