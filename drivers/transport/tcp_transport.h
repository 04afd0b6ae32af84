// A raw byte stream over TCP, as grblHAL and FluidNC offer it. Segments go out at once (TCP_NODELAY).
//
// open() returns while the name is still being looked up and the connection made; a failure is told through OnClosed,
// and what is written meanwhile waits.
#pragma once

#include <boost/asio/ip/tcp.hpp>

#include "drivers/transport/stream_transport.h"

namespace veneer {

class TcpTransport final : public StreamTransport {
 public:
  TcpTransport(boost::asio::io_context& io, std::string host, std::string port);

  Status open(OnBytes on_bytes, OnClosed on_closed) override;
  void close() noexcept override;

 private:
  void drop_unsent(int descriptor) noexcept override;
  void connected(const boost::system::error_code& error);
  std::string host_, port_;
  boost::asio::ip::tcp::resolver resolver_;
  boost::asio::ip::tcp::socket socket_;  // until connected; then its descriptor is the stream's
};

}  // namespace veneer
