// How a test starts another program.
#pragma once

#include <sys/types.h>

#include <map>
#include <string>
#include <vector>

namespace veneer::tests {

// A program with its arguments and its environment, all of it laid out before any fork. A forked child has one thread
// and the locks as the others held them: were one of them allocating just then, a child that allocates would wait for
// ever (under AddressSanitizer, whose allocator knows nothing of forks).
class ProgramStart {
 public:
  // `command` begins with the program's path. `environment` is added to this process's, without its NOTIFY_SOCKET.
  explicit ProgramStart(const std::vector<std::string>& command,
                        const std::map<std::string, std::string>& environment = {});

  // Its process, or -1. It reads nothing, writes to these two files, and dies with the thread that started it; where
  // there is no such program it says so and ends with 127.
  pid_t run(int output, int errors) const;

 private:
  std::vector<std::string> words_, variables_;
};

}  // namespace veneer::tests
