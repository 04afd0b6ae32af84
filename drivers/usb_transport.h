// Transfers to one USB device's interface: a real port, a simulator's, or a recording.
//
// Threading: bound to the reactor; no call blocks. Handlers are called on the reactor, never from inside a call here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <variant>

#include "base/clock.h"
#include "base/result.h"

namespace veneer {

// A control transfer without data.
struct UsbSetup {
  std::uint8_t request_type = 0, request = 0;
  std::uint16_t value = 0, index = 0;
};
struct UsbWrite {
  std::uint8_t endpoint = 0;
  std::string bytes;
};
struct UsbRead {
  std::uint8_t endpoint = 0;
  std::size_t most_bytes = 0;
};
struct UsbRequest {
  std::variant<UsbSetup, UsbWrite, UsbRead> what;
  Duration timeout{};  // the port's own: real time, or a simulator's device time
};

struct UsbReply {
  // False when the time was up first. Of a write nobody knows then whether the device has taken it.
  bool done = true;
  std::string bytes;  // of a read
};

class UsbTransport {
 public:
  using OnReply = std::function<void(const UsbReply&)>;
  using OnClosed = std::function<void(Error)>;  // the link is gone; said once
  virtual ~UsbTransport() = default;

  // Opens exclusively. kUnavailable names the device and the remedy.
  virtual Status open(OnReply on_reply, OnClosed on_closed) = 0;
  // Queues a transfer behind those already waiting; each is replied to, in order. Ignored when closed.
  virtual void submit(UsbRequest request) = 0;
  // For STOP: submits this write at once from the calling thread, before it does anything else, then gives up what was
  // under way or waited, unanswered. It is not replied to. At most 64 bytes.
  virtual void submit_urgent(std::uint8_t endpoint, std::string_view bytes) noexcept = 0;
  virtual void close() noexcept = 0;
};

}  // namespace veneer
