// A simulated Lihuiyu board as a device file: umockdev answers the kernel's usbfs calls for this process and for those
// it starts, without any kernel module, so that the real libusb reaches the board.
#pragma once

#include <umockdev.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/sim/lihuiyu_board/usb_host.h"
#include "tests/support/under_umockdev.h"

namespace veneer::tests {

// Threading: calls come on umockdev's thread, questions from the test's; both take the lock. One at a time in a
// process.
class BoardFile : private sim::BurnSink {
 public:
  explicit BoardFile(const sim::BoardOptions& options);
  ~BoardFile() override;
  BoardFile(const BoardFile&) = delete;
  BoardFile& operator=(const BoardFile&) = delete;

  // The board as it is now.
  template <class Use>
  auto with_board(Use use) {
    const std::lock_guard lock(mutex_);
    advance();
    return use(board_);
  }
  std::vector<sim::BurnSegment> burns();
  // The board's time runs ahead: what it does by itself within this, it has done.
  void let_pass(Duration time) {
    const std::lock_guard lock(mutex_);
    if (stood_) *stood_ += time;
    ahead_ += time;
    advance();
  }
  // The first time that the board is so, its time stands still until go_on(): what a test does then it does in the
  // midst of that, however late it comes. Transfers that are asked for meanwhile wait.
  void stand_still_at(std::function<bool(const sim::LihuiyuBoard&)> place) {
    const std::lock_guard lock(mutex_);
    advance();
    looked_at_ = now();
    place_ = std::move(place);
  }
  bool stands_still() {
    const std::lock_guard lock(mutex_);
    advance();
    return stood_.has_value();
  }
  void go_on() {
    const std::lock_guard lock(mutex_);
    if (stood_) ahead_ = *stood_ - SteadyClock().now();
    stood_.reset();
  }
  // What was asked of the kernel since the device was opened last: a letter a transfer, (w)rite, (r)ead, (c)ontrol, or
  // (d)iscard.
  std::string asked() {
    const std::lock_guard lock(mutex_);
    return asked_;
  }
  // When each reset packet was submitted.
  std::vector<std::chrono::steady_clock::time_point> resets() {
    const std::lock_guard lock(mutex_);
    return resets_;
  }
  // The interface was taken from the kernel's driver, and the chip put into its mode before all else.
  bool set_up_in_order() const { return claimed_detached_ && configured_first_; }

 private:
  struct Flying {
    UMockdevIoctlData* urb;
    UMockdevIoctlData* buffer;
  };

  TimePoint now() const { return stood_ ? *stood_ : SteadyClock().now() + ahead_; }
  void advance();
  void burn(const sim::BurnSegment& segment) override { burns_.push_back(segment); }

  bool answer(UMockdevIoctlClient* client);
  void opened_anew();
  bool submit(UMockdevIoctlClient* client, UMockdevIoctlData* arg);
  bool reap(UMockdevIoctlClient* client, UMockdevIoctlData* arg);
  bool discard(UMockdevIoctlClient* client, UMockdevIoctlData* arg);

  std::mutex mutex_;  // guards all below
  Duration ahead_{0};
  std::function<bool(const sim::LihuiyuBoard&)> place_;  // where its time is to stand still; looked for since then
  TimePoint looked_at_;
  std::optional<TimePoint> stood_;
  std::vector<sim::BurnSegment> burns_;
  std::string asked_;
  std::vector<std::chrono::steady_clock::time_point> resets_;
  sim::LihuiyuBoard board_;
  sim::UsbHost host_;
  UMockdevTestbed* testbed_;
  UMockdevIoctlBase* handler_;
  std::map<std::uint64_t, Flying> flying_;
  std::vector<Flying> done_;
  std::uint64_t next_id_ = 1;
  bool detached_ = false, claimed_detached_ = false, configured_first_ = false;
};

}  // namespace veneer::tests
