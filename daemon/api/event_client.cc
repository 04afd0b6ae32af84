#include "daemon/api/event_client.h"

#include <boost/asio/buffer.hpp>
#include <boost/beast/http/rfc7230.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <utility>

namespace veneer::daemon {

namespace websocket = boost::beast::websocket;
using boost::system::error_code;

EventClient::EventClient(ApiStream stream, EventHub& hub, Caller caller, Logger log)
    : socket_(std::move(stream)),
      cut_timer_(socket_.get_executor()),
      hub_(&hub),
      caller_(std::move(caller)),
      close_time_(hub.options().close_seconds),
      log_(std::move(log)) {}

void EventClient::accept(Upgrade upgrade, const std::optional<SeenEvents>& seen) {
  // From here the WebSocket's own timeouts count: a handshake or close that hangs, and silence.
  socket_.next_layer().expires_never();
  websocket::stream_base::timeout timeout{};
  timeout.handshake_timeout = close_time_;
  timeout.idle_timeout = std::chrono::seconds(2 * hub_->options().ping_seconds);
  timeout.keep_alive_pings = true;
  socket_.set_option(timeout);
  socket_.read_message_max(4096);
  socket_.text(true);
  // A browser hangs up unless one of the protocols it offered is taken.
  constexpr std::string_view kProtocol = "veneer.events";
  const std::string_view offered = upgrade[boost::beast::http::field::sec_websocket_protocol];
  if (boost::beast::http::token_list{offered}.exists(kProtocol))
    socket_.set_option(websocket::stream_base::decorator([kProtocol](websocket::response_type& response) {
      response.set(boost::beast::http::field::sec_websocket_protocol, kProtocol);
    }));
  hub_->join(shared_from_this(), seen);
  auto request = std::make_shared<Upgrade>(std::move(upgrade));
  socket_.async_accept(*request, [self = shared_from_this(), request](error_code fault) {
    if (fault) return self->leave();
    self->read();
    if (!self->queue_.empty()) self->write();
  });
}

// Clients have nothing to say; reading is what answers pings and notices their end.
void EventClient::read() {
  socket_.async_read(received_, [self = shared_from_this()](error_code fault, std::size_t) {
    if (fault) {
      self->leave();
      self->cut_timer_.cancel();
      return;
    }
    self->received_.clear();
    self->read();
  });
}

void EventClient::send(Message message) {
  if (dropping_ || !hub_) return;
  // What waits already counts: one large event is nobody's slowness.
  if (queue_.size() >= hub_->options().max_queued_messages || queued_bytes_ > hub_->options().max_queued_bytes) {
    drop(websocket::close_code::try_again_later, "you read too slowly: connect again and get the status anew");
    return;
  }
  queued_bytes_ += message->size();
  queue_.push_back(std::move(message));
  if (queue_.size() == 1 && socket_.is_open()) write();
}

void EventClient::write() {
  socket_.async_write(boost::asio::buffer(*queue_.front()), [self = shared_from_this()](error_code fault, std::size_t) {
    if (fault) return self->leave();
    if (self->dropping_) return;
    self->queued_bytes_ -= self->queue_.front()->size();
    self->queue_.pop_front();
    if (!self->queue_.empty()) self->write();
  });
}

void EventClient::drop(websocket::close_code code, std::string reason) {
  if (dropping_) return;
  dropping_ = true;
  while (queue_.size() > 1) queue_.pop_back();  // the front belongs to the write under way
  log_->debug("event client dropped: {}", reason);
  const auto self = shared_from_this();
  leave();
  cut_timer_.expires_after(close_time_);
  cut_timer_.async_wait([self](error_code fault) {
    if (!fault) self->cut();
  });
  if (!socket_.is_open()) return cut();
  socket_.async_close({code, std::move(reason)}, [self](error_code) { self->cut_timer_.cancel(); });
}

void EventClient::leave() {
  if (EventHub* hub = std::exchange(hub_, nullptr)) hub->leave(shared_from_this());
}

void EventClient::cut() {
  cut_timer_.cancel();
  error_code ignored;
  socket_.next_layer().socket().close(ignored);
}

}  // namespace veneer::daemon
