// The real daemon with nothing but a GRBL laser: the controller's simulator on a pseudo-terminal, at real speed but
// quick to home.
#pragma once

#include <memory>

#include "tests/support/lone_daemon.h"
#include "tests/support/pty_controller.h"

namespace veneer::tests {

class LaserOnlyCell : public LoneDaemon {
 public:
  static sim::GrblSettings quick_laser();
  // `bin_dir` holds veneerd and veneerctl.
  static Result<std::unique_ptr<LaserOnlyCell>> start(const std::filesystem::path& bin_dir,
                                                      const sim::GrblSettings& settings = quick_laser(),
                                                      const LoneDaemonOptions& options = {});
  ~LaserOnlyCell() { end(); }  // before its laser
  LaserOnlyCell(const LaserOnlyCell&) = delete;
  LaserOnlyCell& operator=(const LaserOnlyCell&) = delete;

  PtyController laser;

 private:
  explicit LaserOnlyCell(const sim::GrblSettings& settings) : laser(settings) {}
};

}  // namespace veneer::tests
