// One kind of stream for all doors, so that what is above is written and compiled once: bytes as they are, or through
// TLS.
#pragma once

// boost/asio/awaitable.hpp of 1.74 misses this under g++ 12.
#include <utility>

#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/beast/core/basic_stream.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <boost/beast/websocket/teardown.hpp>
#include <chrono>
#include <memory>

namespace veneer::daemon {

using ApiSocket = boost::asio::generic::stream_protocol::socket;

class ApiStream {
 public:
  using Plain = boost::beast::basic_stream<boost::asio::generic::stream_protocol>;
  using Tls = boost::beast::ssl_stream<Plain&>;
  using executor_type = Plain::executor_type;
  using next_layer_type = Plain;

  // With a context, which outlives it, every byte goes through TLS once async_handshake() is done.
  ApiStream(ApiSocket socket, boost::asio::ssl::context* tls)
      : plain_(std::make_unique<Plain>(std::move(socket))),
        executor_(plain_->get_executor()),
        tls_(tls ? std::make_unique<Tls>(*plain_, *tls) : nullptr) {}
  // What it was moved from is closed.
  ApiStream(ApiStream&&) noexcept = default;
  ApiStream& operator=(ApiStream&&) noexcept = default;

  executor_type get_executor() { return executor_; }
  // Carries the deadlines.
  Plain& next_layer() { return *plain_; }
  ApiSocket& socket() { return plain_->socket(); }
  bool through_tls() const { return tls_ != nullptr; }

  void expires_after(std::chrono::milliseconds time) { plain_->expires_after(time); }
  void expires_never() { plain_->expires_never(); }
  void close() {
    if (plain_) plain_->close();
  }

  // `said` is what the client has said already; it outlives the handshake.
  template <class Buffers, class Handler>
  void async_handshake(const Buffers& said, Handler&& handler) {
    tls_->async_handshake(boost::asio::ssl::stream_base::server, said, std::forward<Handler>(handler));
  }
  template <class Buffers, class Handler>
  void async_read_some(const Buffers& buffers, Handler&& handler) {
    if (tls_) return tls_->async_read_some(buffers, std::forward<Handler>(handler));
    plain_->async_read_some(buffers, std::forward<Handler>(handler));
  }
  template <class Buffers, class Handler>
  void async_write_some(const Buffers& buffers, Handler&& handler) {
    if (tls_) return tls_->async_write_some(buffers, std::forward<Handler>(handler));
    plain_->async_write_some(buffers, std::forward<Handler>(handler));
  }

  // How a WebSocket ends. Whoever has said goodbye there needs no goodbye of TLS.
  template <class Handler>
  friend void async_teardown(boost::beast::role_type role, ApiStream& stream, Handler&& handler) {
    using boost::beast::websocket::async_teardown;
    async_teardown(role, *stream.plain_, std::forward<Handler>(handler));
  }

 private:
  std::unique_ptr<Plain> plain_;
  executor_type executor_;
  std::unique_ptr<Tls> tls_;  // reads and writes plain_
};

}  // namespace veneer::daemon
