// A program of ours, started as users start it. It dies with its parent.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"

namespace veneer::tests {

class ChildProcess {
 public:
  // Standard output and error go to `log`, appended.
  static Result<ChildProcess> start(const std::vector<std::string>& command, const std::filesystem::path& log,
                                    const std::map<std::string, std::string>& environment = {});
  ChildProcess(ChildProcess&& o) noexcept : pid_(std::exchange(o.pid_, 0)) {}
  ChildProcess& operator=(ChildProcess&& o) noexcept;
  ~ChildProcess();  // SIGKILL

  bool running();
  void signal(int number) const;
  int wait();       // for its end; exit status, or 128 + signal
  int terminate();  // SIGTERM and wait()
  int kill();       // SIGKILL and wait()
  // From now on it can write to no file, or can again.
  void set_disk_full(bool full) const;
  pid_t pid() const { return pid_; }

 private:
  explicit ChildProcess(pid_t pid) : pid_(pid) {}
  pid_t pid_ = 0;
};

// Runs to its end; what it printed on both streams.
struct Finished {
  int status = 0;
  std::string output;
};
Finished run_program(const std::vector<std::string>& command);

}  // namespace veneer::tests
