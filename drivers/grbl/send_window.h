// Bytes the controller has received but not yet acknowledged, so that its receive buffer never overruns: an overrun is
// silent, bytes that do not fit are simply gone.
//
// Invariant: in_flight() <= capacity(); each ok or error releases exactly the oldest line. Pure; not thread-safe.
#pragma once

#include <cstddef>
#include <deque>
#include <string_view>

#include "base/result.h"

namespace veneer::grbl {

class SendWindow {
 public:
  explicit SendWindow(std::size_t capacity_bytes = 128);  // 128 on stock GRBL 1.1

  bool fits(std::string_view line) const { return line.size() <= capacity_ - in_flight_; }
  // `line` with its newline. A line that does not fit is a bug, and aborts.
  void sent(std::string_view line);
  // kDeviceFault when nothing was outstanding.
  Status acknowledged();
  // After a reset no answer to anything sent before will come.
  void clear();

  std::size_t in_flight() const { return in_flight_; }
  std::size_t capacity() const { return capacity_; }
  std::size_t lines() const { return lengths_.size(); }

 private:
  std::size_t capacity_;
  std::size_t in_flight_ = 0;
  std::deque<std::size_t> lengths_;
};

}  // namespace veneer::grbl
