// The host's USB controller in front of the simulated board: transfers in order, with timeouts and what a transfer
// takes on the bus. For tests, the twin's port and the emulated device file.
//
// No I/O, no clock of its own; not thread-safe.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "drivers/sim/lihuiyu_board/lihuiyu_board.h"

namespace veneer::sim {

struct HostSetup {
  std::uint8_t request_type = 0, request = 0;
  std::uint16_t value = 0, index = 0;
};
struct HostWrite {
  std::uint8_t endpoint = 0;
  std::string bytes;
};
struct HostRead {
  std::uint8_t endpoint = 0;
  std::size_t most = 0;
};
struct HostTransfer {
  std::variant<HostSetup, HostWrite, HostRead> what;
  Duration timeout{};
  std::uint64_t id = 0;  // handed back; 0: nobody waits for the answer
};
struct HostReply {
  std::uint64_t id = 0;
  enum class End { kDone, kTimedOut, kError } end = End::kDone;
  std::string bytes;
};

class UsbHost {
 public:
  explicit UsbHost(LihuiyuBoard& board, Duration transfer_time = std::chrono::microseconds(200))
      : board_(board), transfer_time_(transfer_time), enumeration_(board.enumeration()) {}

  void submit(HostTransfer transfer, TimePoint now);
  // Gives up what waits and what is under way.
  void cancel_all();
  void cancel(std::uint64_t id);
  void advance_to(TimePoint now);
  std::optional<TimePoint> next_event_time() const;
  std::vector<HostReply> take_replies();
  // The device that was opened is gone, even if one is plugged in again.
  bool gone() const { return !board_.plugged() || board_.enumeration() != enumeration_; }
  void reopen();

 private:
  void begin(TimePoint now);
  bool attempt(TimePoint now);
  void end(HostReply::End how, std::string bytes = {});

  LihuiyuBoard& board_;
  Duration transfer_time_;
  int enumeration_;
  std::deque<HostTransfer> queue_;  // the first is under way
  bool under_way_ = false;
  TimePoint first_try_, deadline_;
  std::vector<HostReply> replies_;
};

}  // namespace veneer::sim
