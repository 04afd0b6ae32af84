#include "tests/support/pty_controller.h"

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>

namespace veneer::tests {

PtyController::PtyController(const sim::GrblSettings& settings, const sim::GrblOptions& options)
    : controller_(settings, options, 7, this) {
  master_ = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  std::array<char, 128> name{};
  if (master_ < 0 || ::grantpt(master_) != 0 || ::unlockpt(master_) != 0 ||
      ::ptsname_r(master_, name.data(), name.size()) != 0)
    return;
  port_ = name.data();
  keep_ = ::open(port_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  termios mode{};
  ::tcgetattr(master_, &mode);
  ::cfmakeraw(&mode);
  ::tcsetattr(master_, TCSANOW, &mode);
  controller_.power_on(std::chrono::steady_clock::now());
  thread_ = std::thread([this] { run(); });
}

PtyController::~PtyController() {
  ending_ = true;
  if (thread_.joinable()) thread_.join();
  ::close(keep_);
  ::close(master_);
}

void PtyController::run() {
  std::array<char, 1024> chunk{};
  while (!ending_) {
    int wait_ms = 20;
    {
      const std::lock_guard lock(mutex_);
      const auto now = std::chrono::steady_clock::now();
      if (const auto next = controller_.next_event_time())
        wait_ms = static_cast<int>(
            std::clamp<std::int64_t>(std::chrono::ceil<std::chrono::milliseconds>(*next - now).count(), 0, 20));
    }
    pollfd ready{master_, POLLIN, 0};
    const bool bytes = ::poll(&ready, 1, wait_ms) > 0 && (ready.revents & POLLIN) != 0;
    const ssize_t count = bytes ? ::read(master_, chunk.data(), chunk.size()) : 0;
    const auto now = std::chrono::steady_clock::now();
    const std::lock_guard lock(mutex_);
    if (count > 0) {
      const std::string_view got(chunk.data(), static_cast<std::size_t>(count));
      resets_.insert(resets_.end(), static_cast<std::size_t>(std::count(got.begin(), got.end(), '\x18')), now);
      received_ += got;
      controller_.receive(got, now);
    }
    controller_.advance_to(now);
    // Before it says anything, so that whoever hears it finds it so.
    beam_on_ = controller_.beam_on();
    moving_ = controller_.moving();
    const std::string said = controller_.take_output();
    if (!said.empty() && ::write(master_, said.data(), said.size()) < 0) return;
  }
}

std::vector<PtyController::RealTime> PtyController::resets() const {
  const std::lock_guard lock(mutex_);
  return resets_;
}

std::string PtyController::received() const {
  const std::lock_guard lock(mutex_);
  return received_;
}

double PtyController::burnt_mm() const {
  const std::lock_guard lock(mutex_);
  return burnt_mm_;
}

sim::BeamLog PtyController::beam_log() const {
  const std::lock_guard lock(mutex_);
  return controller_.beam_log();
}

void PtyController::set_consent(bool given) {
  const std::lock_guard lock(mutex_);
  controller_.set_consent(given);
}

void PtyController::set_lid(bool open) {
  const std::lock_guard lock(mutex_);
  controller_.set_lid(open, std::chrono::steady_clock::now());
}

}  // namespace veneer::tests
