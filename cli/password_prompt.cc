#include "cli/password_prompt.h"

#include <termios.h>
#include <unistd.h>

#include <iostream>

namespace veneer::cli {
namespace {

// While it lives the terminal does not show what is typed.
class EchoOff {
 public:
  EchoOff() {
    if (::tcgetattr(STDIN_FILENO, &before_) != 0) return;
    termios quiet = before_;
    quiet.c_lflag &= ~static_cast<tcflag_t>(ECHO);
    off_ = ::tcsetattr(STDIN_FILENO, TCSAFLUSH, &quiet) == 0;
  }
  EchoOff(const EchoOff&) = delete;
  EchoOff& operator=(const EchoOff&) = delete;
  ~EchoOff() {
    if (!off_) return;
    ::tcsetattr(STDIN_FILENO, TCSAFLUSH, &before_);
    std::cerr << std::endl;
  }

 private:
  termios before_{};
  bool off_ = false;
};

}  // namespace

Result<std::string> ask_password(const std::string& prompt) {
  std::string password;
  if (::isatty(STDIN_FILENO) != 0) {
    std::cerr << prompt << ": " << std::flush;
    const EchoOff quiet;
    std::getline(std::cin, password);
  } else {
    std::getline(std::cin, password);
  }
  if (!password.empty() && password.back() == '\r') password.pop_back();
  if (!password.empty()) return password;
  return Error{ErrorCode::kInvalidArgument, "no password was given: type it, or send it as a line on standard input"};
}

Result<std::string> ask_new_password(const std::string& of) {
  auto password = ask_password("New password of " + of);
  if (!password || ::isatty(STDIN_FILENO) == 0) return password;
  const auto again = ask_password("Once more");
  if (again && *again == *password) return password;
  return Error{ErrorCode::kInvalidArgument, "the two passwords differ: try again"};
}

}  // namespace veneer::cli
