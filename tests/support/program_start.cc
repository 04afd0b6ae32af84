#include "tests/support/program_start.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <cstring>
#include <string_view>

namespace veneer::tests {
namespace {

// As execve() wants them.
std::vector<char*> pointers(const std::vector<std::string>& words) {
  std::vector<char*> out;
  out.reserve(words.size() + 1);
  for (const std::string& word : words) out.push_back(const_cast<char*>(word.c_str()));
  out.push_back(nullptr);
  return out;
}

void say(const char* words) { static_cast<void>(!write(STDERR_FILENO, words, std::strlen(words))); }

}  // namespace

ProgramStart::ProgramStart(const std::vector<std::string>& command,
                           const std::map<std::string, std::string>& environment)
    : words_(command) {
  for (char** own = environ; *own != nullptr; ++own) {
    const std::string_view variable = *own;
    const std::string name(variable.substr(0, variable.find('=')));
    if (name != "NOTIFY_SOCKET" && !environment.contains(name)) variables_.emplace_back(variable);
  }
  for (const auto& [name, value] : environment) variables_.push_back(name + "=" + value);
}

pid_t ProgramStart::run(int output, int errors) const {
  const std::vector<char*> arguments = pointers(words_), variables = pointers(variables_);
  const pid_t pid = fork();
  if (pid != 0) return pid;
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  dup2(output, STDOUT_FILENO);
  dup2(errors, STDERR_FILENO);
  dup2(open("/dev/null", O_RDONLY), STDIN_FILENO);
  execve(arguments[0], arguments.data(), variables.data());
  for (const char* words : {"cannot start ", static_cast<const char*>(arguments[0]), "\n"}) say(words);
  _exit(127);
}

}  // namespace veneer::tests
