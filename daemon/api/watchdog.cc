#include "daemon/api/watchdog.h"

#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdlib>

namespace veneer::daemon {
SystemdNotifier::SystemdNotifier() {
  std::uint64_t microseconds = 0;
  if (sd_watchdog_enabled(/*unset_environment=*/0, &microseconds) > 0) {
    period_ = std::chrono::microseconds(microseconds);
  }
}

bool is_systemds_own() {
  // NOLINTBEGIN(concurrency-mt-unsafe): no other thread sets the environment
  const char *unit = getenv("INVOCATION_ID"), *process = getenv("SYSTEMD_EXEC_PID");
  // NOLINTEND(concurrency-mt-unsafe)
  return unit != nullptr && process != nullptr && process == std::to_string(::getpid());
}

void SystemdNotifier::notify(const std::string& note) { sd_notify(/*unset_environment=*/0, note.c_str()); }

Watchdog::Watchdog(ServiceNotifier& notifier, std::unique_ptr<OneShotTimer> timer)
    : notifier_(notifier), timer_(std::move(timer)) {}

void Watchdog::ready() {
  notifier_.notify("READY=1");
  feed();
}

void Watchdog::feed() {
  const Duration period = notifier_.watchdog_period();
  if (period <= Duration::zero()) return;
  notifier_.notify("WATCHDOG=1");
  timer_->after(period / 4, [this] { feed(); });
}

void Watchdog::status(const std::string& text) {
  std::string line = text;
  std::ranges::replace(line, '\n', ' ');  // a line break would begin another variable
  if (line == status_) return;
  status_ = line;
  notifier_.notify("STATUS=" + line);
}

void Watchdog::stopping() { notifier_.notify("STOPPING=1"); }

}  // namespace veneer::daemon
