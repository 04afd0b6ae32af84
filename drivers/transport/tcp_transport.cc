#include "drivers/transport/tcp_transport.h"

#include <fmt/format.h>

#include <boost/asio/connect.hpp>
#include <utility>

namespace veneer {

using boost::asio::ip::tcp;

TcpTransport::TcpTransport(boost::asio::io_context& io, std::string host, std::string port)
    : StreamTransport(io, fmt::format("{}:{}", host, port)),
      host_(std::move(host)),
      port_(std::move(port)),
      resolver_(io),
      socket_(io) {}

Status TcpTransport::open(OnBytes on_bytes, OnClosed on_closed) {
  close();
  listen(std::move(on_bytes), std::move(on_closed));
  resolver_.async_resolve(host_, port_,
                          [this, alive = generation()](const boost::system::error_code& error,
                                                       const tcp::resolver::results_type& addresses) {
                            if (alive.expired()) return;
                            if (error) return connected(error);
                            boost::asio::async_connect(
                                socket_, addresses,
                                [this, alive](const boost::system::error_code& failed, const tcp::endpoint&) {
                                  if (!alive.expired()) connected(failed);
                                });
                          });
  return Ok();
}

void TcpTransport::connected(const boost::system::error_code& error) {
  boost::system::error_code failed = error;
  if (!failed) socket_.set_option(tcp::no_delay(true), failed);
  if (!failed) socket_.non_blocking(true, failed);
  int descriptor = -1;
  if (!failed) descriptor = socket_.release(failed);
  if (failed)
    return fail({ErrorCode::kUnavailable,
                 fmt::format("no connection to {} ({}): check that the device is switched on and the address is right",
                             name(), failed.message())});
  run_on(descriptor);
}

void TcpTransport::close() noexcept {
  resolver_.cancel();
  boost::system::error_code ignored;
  socket_.close(ignored);
  StreamTransport::close();
}

// What the kernel holds of a TCP stream cannot be taken back.
void TcpTransport::drop_unsent(int) noexcept {}

}  // namespace veneer
