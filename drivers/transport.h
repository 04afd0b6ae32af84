// A byte stream to a device: serial line, TCP, USB, or a simulator's port.
//
// Threading: bound to the reactor; no call blocks. Handlers are called on the reactor, never from inside a call here.
#pragma once

#include <functional>
#include <string_view>

#include "base/result.h"

namespace veneer {

class Transport {
 public:
  using OnBytes = std::function<void(std::string_view)>;
  using OnClosed = std::function<void(Error)>;  // the link is gone; said once
  virtual ~Transport() = default;

  // Opens for one program at a time (serial_transport.h). kUnavailable names the port and the remedy.
  virtual Status open(OnBytes on_bytes, OnClosed on_closed) = 0;
  // Queues bytes behind those already waiting; order is kept. Ignored when closed.
  virtual void write(std::string_view bytes) = 0;
  // For STOP: drops what waits unsent, writes these bytes at once from the calling thread.
  virtual void write_urgent(std::string_view bytes) noexcept = 0;
  virtual void close() noexcept = 0;
};

}  // namespace veneer
