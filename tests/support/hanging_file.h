// A file that hangs as one on a disk that does not answer: whoever opens it to read waits until it is let go.
#pragma once

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

namespace veneer::testing {

class HangingFile {
 public:
  explicit HangingFile(std::filesystem::path file) : file_(std::move(file)) {
    if (::mkfifo(file_.c_str(), 0600) != 0) throw std::runtime_error("no pipe can be made at " + file_.string());
  }
  HangingFile(const HangingFile&) = delete;
  HangingFile& operator=(const HangingFile&) = delete;
  ~HangingFile() {
    for (const int end : {pipe_, waited_})
      if (end >= 0) ::close(end);
  }
  // Until somebody has opened it, who reads nothing yet. Throws where nobody does.
  void await_reader() {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::minutes(1);
    while ((waited_ = ::open(file_.c_str(), O_WRONLY | O_CLOEXEC | O_NONBLOCK)) < 0) {
      if (errno != ENXIO || std::chrono::steady_clock::now() > deadline)
        throw std::runtime_error("nobody reads the pipe " + file_.string());
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  // Whoever waits reads nonsense, as does whoever opens it from now on.
  void let_go() {
    if (pipe_ >= 0) return;
    const std::filesystem::path was = file_.string() + ".was";
    std::filesystem::rename(file_, was);
    std::ofstream(file_) << "nonsense";
    pipe_ = ::open(was.c_str(), O_RDWR | O_CLOEXEC);
    if (waited_ >= 0) ::close(std::exchange(waited_, -1));
    constexpr std::array<char, 60'000> kNonsense{};  // enough for all who wait, and less than a pipe holds
    if (pipe_ < 0 || ::write(pipe_, kNonsense.data(), kNonsense.size()) < 0)
      throw std::runtime_error("the pipe " + was.string() + " cannot be written");
  }

 private:
  std::filesystem::path file_;
  int pipe_ = -1, waited_ = -1;
};

}  // namespace veneer::testing
