// veneerctl run as a program: what it printed where, and its exit status. VENEERCTL is its path.
#pragma once

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/api_server.h"

namespace veneer::testing {

struct Outcome {
  int status = -1;
  std::string out, err;
};

class Veneerctl {
 public:
  explicit Veneerctl(std::vector<std::string> arguments) {
    int out[2];
    int err[2];
    if (pipe(out) != 0 || pipe(err) != 0) std::abort();
    pid_ = fork();
    if (pid_ == 0) {
      close(STDIN_FILENO);  // nobody is at a terminal
      open("/dev/null", O_RDONLY);
      dup2(out[1], STDOUT_FILENO);
      dup2(err[1], STDERR_FILENO);
      for (const int fd : {out[0], out[1], err[0], err[1]}) close(fd);
      std::vector<char*> argv = {const_cast<char*>("veneerctl")};
      for (std::string& argument : arguments) argv.push_back(argument.data());
      argv.push_back(nullptr);
      execv(VENEERCTL, argv.data());
      _exit(127);
    }
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
