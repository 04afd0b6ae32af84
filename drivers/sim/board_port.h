// The simulated Lihuiyu machine behind a Unix socket: each line is a USB transfer to the board (the words are in
// client/sim_usb.h), and each burn marks the sheet on the bed.
//
// Threading: bound to the reactor that runs `io`.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/steady_timer.hpp>
#include <filesystem>
#include <string>

#include "base/clock.h"
#include "base/log.h"
#include "drivers/sim/laser_bench.h"
#include "drivers/sim/lihuiyu_board/usb_host.h"

namespace veneer::sim {

class World;

struct BoardPortOptions {
  std::filesystem::path path;  // of the socket
  bool m3 = false;
  double travel_x_mm = 520, travel_y_mm = 380;
  double boot_seconds = 0.1;
  std::uint64_t seed = 1;
};

class BoardPort final : public LaserBench {
 public:
  // `world` and `clock` must outlive this.
  BoardPort(boost::asio::io_context& io, const Clock& clock, World& world, BoardPortOptions options, Logger log);
  ~BoardPort() override;

  // kStorage when the socket cannot be made.
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
  using Protocol = boost::asio::local::stream_protocol;

  void accept();
  void receive();
  bool take(const std::string& line);
  void hang_up();
  void pump();
  void flush_now_and_then();

  const Clock& clock_;
  World& world_;
  BoardPortOptions options_;
  Logger log_;
  LihuiyuBoard board_;
  UsbHost host_;
  Protocol::acceptor acceptor_;
  Protocol::socket client_, visitor_;
  boost::asio::steady_timer wake_, flush_;
  std::string incoming_;
  bool lid_open_ = false, power_ = true;
  SignalAtBurn signal_at_burn_;
};

}  // namespace veneer::sim
