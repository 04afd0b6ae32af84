#include "tests/support/child_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <utility>

#include "tests/support/program_start.h"

namespace veneer::tests {
namespace {

int status_of(int raw) { return WIFEXITED(raw) ? WEXITSTATUS(raw) : 128 + WTERMSIG(raw); }

}  // namespace

Result<ChildProcess> ChildProcess::start(const std::vector<std::string>& command, const std::filesystem::path& log,
                                         const std::map<std::string, std::string>& environment) {
  const int output = open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (output < 0) return Error{ErrorCode::kStorage, fmt::format("cannot write {}", log.string())};
  const pid_t pid = ProgramStart(command, environment).run(output, output);
  close(output);
  if (pid < 0) return Error{ErrorCode::kInternal, "cannot start another process"};
  return ChildProcess(pid);
}

ChildProcess& ChildProcess::operator=(ChildProcess&& o) noexcept {
  if (this != &o) {
    if (pid_ > 0) kill();
    pid_ = std::exchange(o.pid_, 0);
  }
  return *this;
}

ChildProcess::~ChildProcess() {
  if (pid_ > 0) kill();
}

bool ChildProcess::running() {
  if (pid_ <= 0) return false;
  siginfo_t info{};
  return waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid == 0;
}

void ChildProcess::signal(int number) const {
  if (pid_ > 0) ::kill(pid_, number);
}

void ChildProcess::set_disk_full(bool full) const {
  rlimit limit{};
  ::prlimit(pid_, RLIMIT_FSIZE, nullptr, &limit);
  limit.rlim_cur = full ? 0 : limit.rlim_max;
  ::prlimit(pid_, RLIMIT_FSIZE, &limit, nullptr);
}

int ChildProcess::wait() {
  if (pid_ <= 0) return -1;
  int raw = 0;
  waitpid(std::exchange(pid_, 0), &raw, 0);
  return status_of(raw);
}

int ChildProcess::terminate() {
  signal(SIGTERM);
  return wait();
}

int ChildProcess::kill() {
  signal(SIGKILL);
  return wait();
}

Finished run_program(const std::vector<std::string>& command) {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) return {-1, "no pipe"};
  const pid_t pid = ProgramStart(command).run(ends[1], ends[1]);
  close(ends[1]);
  Finished out;
  std::array<char, 4096> buffer{};
  for (ssize_t n = 0; (n = read(ends[0], buffer.data(), buffer.size())) > 0;)
    out.output.append(buffer.data(), static_cast<std::size_t>(n));
  close(ends[0]);
  int raw = 0;
  waitpid(pid, &raw, 0);
  out.status = status_of(raw);
  return out;
}

}  // namespace veneer::tests
