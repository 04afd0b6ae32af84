// The simulated GRBL controller on a pseudo-terminal in real time, on a thread of its own, which notes when reset bytes
// arrive.
#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "drivers/sim/grbl_controller/grbl_controller.h"

namespace veneer::tests {

class PtyController final : private sim::BurnSink {
 public:
  using RealTime = std::chrono::steady_clock::time_point;

  explicit PtyController(const sim::GrblSettings& settings, const sim::GrblOptions& options = {});
  ~PtyController() override;
  PtyController(const PtyController&) = delete;
  PtyController& operator=(const PtyController&) = delete;

  const std::string& port() const { return port_; }  // where the daemon's end is
  // When each reset byte was there, in order.
  std::vector<RealTime> resets() const;
  std::string received() const;
  double burnt_mm() const;
  bool beam_on() const { return beam_on_; }
  bool moving() const { return moving_; }
  sim::BeamLog beam_log() const;
  void set_consent(bool given);
  void set_lid(bool open);

 private:
  void burn(const sim::BurnSegment& segment) override { burnt_mm_ += segment.length_mm(); }
  void run();

  int master_ = -1, keep_ = -1;  // keep_: so that the terminal outlives a daemon
  std::string port_;
  mutable std::mutex mutex_;  // guards all below
  sim::GrblController controller_;
  std::vector<RealTime> resets_;
  std::string received_;
  double burnt_mm_ = 0;
  std::atomic<bool> beam_on_{false}, moving_{false}, ending_{false};
  std::thread thread_;
};

}  // namespace veneer::tests
