// The real daemon with nothing but a laser: no scanner, no camera, no certificate, no twin. The laser is the
// controller's simulator on a pseudo-terminal, at real speed but quick to home.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "cli/api_client.h"
#include "tests/support/child_process.h"
#include "tests/support/pty_controller.h"

namespace veneer::tests {

class LaserOnlyCell {
 public:
  static sim::GrblSettings quick_laser();
  // `bin_dir` holds veneerd and veneerctl.
  static Result<std::unique_ptr<LaserOnlyCell>> start(const std::filesystem::path& bin_dir,
                                                      const sim::GrblSettings& settings = quick_laser());
  ~LaserOnlyCell();

  const cli::ApiClient& api() const { return *api_; }
  std::string socket() const { return (dir_ / "d.sock").string(); }
  // veneerctl with these arguments, to its end.
  Finished veneerctl(std::vector<std::string> arguments) const;
  std::string state() const;
  // Begins a test pattern over the API, with all that is asked for confirmed.
  Status begin_pattern(double size_mm) const;
  // From now on the daemon can write to no file, or can again.
  void set_disk_full(bool full) const;
  // False when it did not come about in time.
  bool wait_for(const std::function<bool()>& good) const;

  PtyController laser;

 private:
  explicit LaserOnlyCell(const sim::GrblSettings& settings) : laser(settings) {}

  std::filesystem::path bin_dir_, dir_;
  std::optional<ChildProcess> daemon_;
  std::optional<cli::ApiClient> api_;
};

}  // namespace veneer::tests
