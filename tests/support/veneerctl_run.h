// veneerctl run as a program: what it printed where, and its exit status. VENEERCTL is its path.
#pragma once

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/api_server.h"
#include "tests/support/program_start.h"

namespace veneer::testing {

struct Outcome {
  int status = -1;
  std::string out, err;
};

class Veneerctl {
 public:
  explicit Veneerctl(std::vector<std::string> arguments) {
    std::array<int, 2> out{}, err{};
    if (pipe2(out.data(), O_CLOEXEC) != 0 || pipe2(err.data(), O_CLOEXEC) != 0) std::abort();
    arguments.insert(arguments.begin(), VENEERCTL);
    pid_ = tests::ProgramStart(arguments).run(out[1], err[1]);
    close(out[1]);
    close(err[1]);
    out_ = out[0];
    err_ = err[0];
  }
  Veneerctl(const Veneerctl&) = delete;
  Veneerctl& operator=(const Veneerctl&) = delete;
  ~Veneerctl() { finish(); }

  void interrupt() const { kill(pid_, SIGINT); }
  Outcome finish() {
    if (pid_ < 0) return outcome_;
    outcome_.out = read_all(out_);
    outcome_.err = read_all(err_);
    int status = 0;
    waitpid(pid_, &status, 0);
    pid_ = -1;
    outcome_.status = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    return outcome_;
  }

 private:
  static std::string read_all(int fd) {
    std::string all;
    char chunk[4096];
    for (ssize_t got = 0; (got = read(fd, chunk, sizeof chunk)) > 0;) all.append(chunk, static_cast<std::size_t>(got));
    close(fd);
    return all;
  }
  pid_t pid_ = -1;
  int out_ = -1;
  int err_ = -1;
  Outcome outcome_;
};

inline Outcome veneerctl(std::vector<std::string> arguments) { return Veneerctl(std::move(arguments)).finish(); }

inline Outcome ask(const ApiServer& server, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"--socket", server.socket()});
  return veneerctl(std::move(arguments));
}

}  // namespace veneer::testing
