// The simulated controller on a pseudo-terminal: moves bytes between the pty's master and GrblController, and wakes the
// controller when something happens by itself.
//
// Threading: bound to the reactor that runs `io`.
#pragma once

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "base/clock.h"
#include "base/log.h"
#include "drivers/sim/grbl_controller/grbl_controller.h"
#include "drivers/sim/laser_bench.h"

namespace veneer::sim {

class World;

struct LaserPortOptions {
  std::filesystem::path link;  // symlink to the pty's other end
  bool reset_on_open = true;
  double travel_x_mm = 520, travel_y_mm = 380;
  double boot_seconds = 0.1;
  std::uint64_t seed = 1;
};

class LaserPort final : public LaserBench {
 public:
  // `world` and `clock` must outlive this.
  LaserPort(boost::asio::io_context& io, const Clock& clock, World& world, LaserPortOptions options, Logger log);
  ~LaserPort() override;

  // Opens the pty and makes the link. kUnavailable when the system has no pty left, kStorage when the link fails.
  Status open();

  void set_lid(bool open) override;
  void set_power(bool on) override;
  void unplug() override;
  Status replug() override;
  Status inject(const FaultRequest& request) override;
  void set_consent(bool given) override;
  void signal_at_burn(const SignalAtBurn::Order& order) override { signal_at_burn_.arm(order); }
  nlohmann::json describe() const override;

 private:
  void close_port();
  Status watch_openers();
  void wait_for_openers();
  void count_openers();
  void attached();
  void read();
  void pump();
  void write();
  void flush_now_and_then();

  const Clock& clock_;
  World& world_;
  LaserPortOptions options_;
  Logger log_;
  GrblController controller_;
  boost::asio::posix::stream_descriptor master_;
  boost::asio::posix::stream_descriptor openers_;  // inotify: who opens and closes the other end
  boost::asio::steady_timer wake_, flush_;
  std::array<char, 1024> chunk_{};
  std::string pending_;
  std::string port_;
  int openers_count_ = 0;  // how often the other end is open
  bool lid_open_ = false, power_ = true, writing_ = false, reading_ = false;
  SignalAtBurn signal_at_burn_;
};

}  // namespace veneer::sim
