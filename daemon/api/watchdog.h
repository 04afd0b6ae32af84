// Readiness and the watchdog towards systemd. It is fed by a timer on the reactor, the loop that owns the laser, and by
// nothing else: a stuck reactor starves it and systemd ends the process (the guardian darkens the machine then).
// Whether the rest answers is no business of systemd's: daemon/unit/cell_health.h sees to that.
//
// Bound to the reactor.
#pragma once

#include <memory>
#include <string>

#include "base/clock.h"
#include "daemon/threads/reactor_timer.h"

namespace veneer::daemon {

// Where notes to the service manager go: "READY=1", "WATCHDOG=1", "STATUS=...", "STOPPING=1".
class ServiceNotifier {
 public:
  virtual ~ServiceNotifier() = default;
  virtual void notify(const std::string& note) = 0;
  virtual Duration watchdog_period() const = 0;  // 0: the manager does not watch
};

// sd_notify(3); does nothing when NOTIFY_SOCKET is not set.
class SystemdNotifier final : public ServiceNotifier {
 public:
  SystemdNotifier();
  void notify(const std::string& note) override;
  Duration watchdog_period() const override { return period_; }

 private:
  Duration period_{0};
};

// Whether systemd itself began this process, as a unit's main one: then its Restart= says what follows an end. (Whether
// that asks for a new start the process is not told; the shipped unit does.) Somebody's shell or container may have
// inherited or set NOTIFY_SOCKET; the process number is meant for this process alone.
bool is_systemds_own();

class Watchdog {
 public:
  // `notifier` outlives this.
  Watchdog(ServiceNotifier& notifier, std::unique_ptr<OneShotTimer> timer);

  void ready();                          // READY=1 and the first feeding; then one every quarter of the period
  void status(const std::string& text);  // one line; told only when it changed
  void stopping();                       // STOPPING=1; keeps feeding, so that an orderly end may take its time

 private:
  void feed();

  ServiceNotifier& notifier_;
  std::unique_ptr<OneShotTimer> timer_;
  std::string status_;
};

}  // namespace veneer::daemon
