// One WebSocket connection of the event stream. Bound to the reactor; it lives as long as it has work under way.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <deque>
#include <memory>
#include <optional>
#include <string>

#include "daemon/api/api_stream.h"
#include "daemon/api/event_hub.h"

namespace veneer::daemon {

class EventClient : public std::enable_shared_from_this<EventClient> {
 public:
  using Message = std::shared_ptr<const std::string>;
  using Upgrade = boost::beast::http::request<boost::beast::http::string_body>;

  // `hub` outlives the client's membership: it says goodbye to its members before it goes.
  EventClient(ApiStream stream, EventHub& hub, Caller caller, Logger log);

  // Answers the upgrade and joins the hub, where `seen` ended.
  void accept(Upgrade upgrade, const std::optional<SeenEvents>& seen = {});
  void send(Message message);
  const Caller& caller() const { return caller_; }
  // Leaves the hub at once; the reason goes out behind what is being written, and after close_seconds the link is cut.
  void drop(boost::beast::websocket::close_code code, std::string reason);

 private:
  void read();
  void write();
  void leave();
  void cut();

  boost::beast::websocket::stream<ApiStream> socket_;
  boost::asio::steady_timer cut_timer_;
  EventHub* hub_;  // null once it has left
  const Caller caller_;
  std::chrono::seconds close_time_;
  Logger log_;
  boost::beast::flat_buffer received_;
  std::deque<Message> queue_;  // the front is being written
  std::size_t queued_bytes_ = 0;
  bool dropping_ = false;
};

}  // namespace veneer::daemon
