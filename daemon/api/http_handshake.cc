// How a connection through TLS begins: the client's first message, a turn at the gate, and the rest without delay.
#include <algorithm>
#include <boost/asio/read.hpp>
#include <utility>

#include "daemon/api/http_connection.h"
#include "daemon/api/network.h"

namespace veneer::daemon {

namespace asio = boost::asio;
using boost::system::error_code;

namespace {

constexpr std::chrono::milliseconds kHandshake{2'000};  // after its first message

}  // namespace

void HttpConnection::limit_handshake(std::chrono::milliseconds time) {
  reply_timer_.expires_after(time);
  reply_timer_.async_wait([self = shared_from_this()](error_code fault) {
    if (!fault && self->hello_) self->gone();
  });
}

void HttpConnection::read_hello() {
  const auto missing = hello_->missing();
  if (!missing) return gone();
  if (*missing == 0) return wait_for_turn();
  const std::size_t have = hello_->bytes.size();
  hello_->bytes.resize(have + *missing);
  asio::async_read(stream_.next_layer(), asio::buffer(hello_->bytes.data() + have, *missing),
                   [self = shared_from_this()](error_code fault, std::size_t) {
                     if (fault) return self->gone();
                     self->read_hello();
                   });
}

void HttpConnection::wait_for_turn() {
  open_handshake_ = shared_->gate.wait(network_of(visitor_.address), [weak = weak_from_this()] {
    const auto self = weak.lock();
    return self && self->shake_hands();
  });
  if (!open_handshake_) return gone();
  shared_->on_waiting();
}

// The rest of it has little time: a crowd could keep back what costs, and send it all at once.
bool HttpConnection::shake_hands() {
  if (!open_handshake_) return false;
  if (client_is_gone()) {
    gone();
    return false;
  }
  limit_handshake(std::min(shared_->options.header_timeout, kHandshake));
  stream_.async_handshake(asio::buffer(std::as_const(hello_->bytes)),
                          [self = shared_from_this()](error_code fault, std::size_t) {
                            if (fault) return self->gone();
                            self->reply_timer_.cancel();
                            self->hello_.reset();
                            self->open_handshake_.reset();
                            self->read_header();
                          });
  return true;
}

}  // namespace veneer::daemon
