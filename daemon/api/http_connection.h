// One HTTP connection: reads requests one after the other, asks who sends them, hands them to their handlers, writes
// the replies. Bound to the reactor; kept alive by its ConnectionOwner and by its own work under way.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "base/sha256.h"
#include "daemon/api/access.h"
#include "daemon/api/api_stream.h"
#include "daemon/api/http_server.h"
#include "daemon/api/tls.h"
#include "daemon/api/tls_gate.h"
#include "daemon/api/tls_hello.h"
#include "daemon/api/turns.h"

namespace veneer::daemon {

class HttpConnection;

// What all connections of a server share. Outlives them.
struct ServerShared {
  HttpServerOptions options;
  const Router& router;
  EventHub& hub;
  const Accounts& accounts;
  std::function<ApiReply(const WhoAsks&)> on_stop;
  Logger log;
  std::unique_ptr<TlsIdentity> tls;  // null without TLS
  int tcp_port = 0, tls_port = 0;
  ClientShares shares;
  TlsGate gate;
  std::uint64_t activity = 0;  // counts every step any connection makes
  Turns turns;                 // of requests that are to be looked at
  bool gives_turns = false;
  std::function<void(const HttpConnection&)> on_gone;
  std::function<void()> on_waiting;  // a handshake at the gate
};

class HttpConnection : public std::enable_shared_from_this<HttpConnection> {
 public:
  enum class Doing { kReading, kHandling, kWriting };

  // Who has come in by which door. `peer` is the caller over the Unix socket; over TCP each request says for itself.
  struct Visitor {
    TransportKind door = TransportKind::kTcp;
    std::string address;  // of the other end, over TCP
    std::optional<Caller> peer = std::nullopt;
  };
  HttpConnection(ApiSocket socket, std::shared_ptr<ServerShared> shared, Visitor visitor);

  void start();
  void drop();  // at once; a reply that comes later goes nowhere

  Doing doing() const { return doing_; }
  std::uint64_t last_activity() const { return last_activity_; }
  // Its last request came from an operator.
  bool trusted() const { return caller_.role >= Role::kOperator; }
  // Whose last request was (identity_of); over TCP anonymous until a header has said more.
  const std::string& identity() const { return identity_; }

 private:
  using RequestParser = boost::beast::http::request_parser<boost::beast::http::string_body>;
  using Response = boost::beast::http::response<boost::beast::http::string_body>;
  friend class ReplySlot;

  void step(Doing doing);
  void limit_handshake(std::chrono::milliseconds time);
  void read_hello();
  void wait_for_turn();
  bool shake_hands();
  void read_header();
  void parse_header();
  void on_header(boost::system::error_code fault);
  void on_parse_fault(boost::system::error_code fault);
  void take_turn(void (HttpConnection::*then)());
  static void give_turns(const std::shared_ptr<ServerShared>& shared, const ApiStream::executor_type& reactor);
  void look_at_request();
  void upgrade();
  void route();
  void say_continue();
  void read_body();
  void read_more();
  void hash_more();
  void handle();
  void run_handler(const ApiRequest& request);
  void notice_departure();
  bool client_is_gone();
  void take_reply(std::uint64_t number, ApiReply reply);
  void answer(ApiReply reply, bool close_after = false);
  void linger();
  void swallow();
  void gone();

  std::shared_ptr<ServerShared> shared_;
  ApiStream stream_;
  boost::asio::steady_timer reply_timer_;
  boost::asio::steady_timer departure_timer_;
  const Visitor visitor_;
  boost::beast::flat_buffer buffer_;
  std::ptrdiff_t header_lines_ = 0;  // of this request, that the parser has taken
  std::size_t header_bytes_ = 0;     // the same
  std::optional<TlsHello> hello_;    // until the handshake is over
  TlsGate::OpenHandshake open_handshake_;
  std::optional<RequestParser> parser_;
  std::optional<Sha256> body_hash_;  // of a body that comes with a key
  std::size_t hashed_ = 0;           // of it
  std::optional<Response> response_;
  Caller caller_;
  std::string identity_;
  Router::Match match_;
  Doing doing_ = Doing::kReading;
  std::uint64_t last_activity_ = 0;
  std::uint64_t request_number_ = 0;
  std::size_t swallowed_ = 0;  // after the last reply
  bool awaiting_turn_ = false;
  bool awaiting_reply_ = false;
  std::stop_source gone_;  // of the request that is being handled
  ClientShares::Share request_share_, upload_share_, reply_share_;
};

}  // namespace veneer::daemon
