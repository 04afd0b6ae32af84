// What a serial line and a TCP connection share: a non-blocking file descriptor on the reactor.
//
// Contract and threading: drivers/transport.h.
#pragma once

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <memory>
#include <string>

#include "drivers/transport.h"

namespace veneer {

class StreamTransport : public Transport {
 public:
  StreamTransport(boost::asio::io_context& io, std::string name);
  ~StreamTransport() override;
  StreamTransport(const StreamTransport&) = delete;
  StreamTransport& operator=(const StreamTransport&) = delete;

  void write(std::string_view bytes) override;
  void write_urgent(std::string_view bytes) noexcept override;
  void close() noexcept override;

 protected:
  // Takes the descriptor, which must be non-blocking, and begins to read. Call on the reactor.
  void run_on(int descriptor);
  void listen(OnBytes on_bytes, OnClosed on_closed);
  // The link failed: closes it and says so, once, on the reactor.
  void fail(Error error);
  bool listening() const { return static_cast<bool>(on_closed_); }
  boost::asio::io_context& io() { return io_; }
  const std::string& name() const { return name_; }
  std::weak_ptr<int> generation() const { return generation_; }

 private:
  // Drops what the kernel has taken but not yet sent, where that is possible.
  virtual void drop_unsent(int descriptor) noexcept = 0;
  void read_more();
  void write_more();
  void disconnected(const boost::system::error_code& error);

  boost::asio::io_context& io_;
  std::string name_;
  boost::asio::posix::stream_descriptor descriptor_;
  std::array<char, 4096> incoming_{};
  std::string unsent_;
  bool waiting_to_write_ = false;
  OnBytes on_bytes_;
  OnClosed on_closed_;
  std::shared_ptr<int> generation_;  // renewed by close(), so that late handlers know they are late
};

}  // namespace veneer
