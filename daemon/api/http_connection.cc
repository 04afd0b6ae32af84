#include "daemon/api/http_connection.h"

#include <poll.h>

#include <atomic>
#include <boost/asio/dispatch.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/rfc7230.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <limits>
#include <span>
#include <utility>

#include "daemon/api/console_routes.h"
#include "daemon/api/event_client.h"
#include "daemon/api/idempotency.h"
#include "daemon/api/request_reader.h"
#include "daemon/api/url.h"
#include "daemon/threads/worker.h"

namespace veneer::daemon {

namespace asio = boost::asio;
namespace http = boost::beast::http;
using boost::system::error_code;

namespace {

constexpr std::string_view kStopPath = "/api/v1/stop";
constexpr std::string_view kEventsPath = "/api/v1/events";
constexpr std::chrono::seconds kLinger{2};
constexpr std::size_t kMostSwallowed = 256 * 1024;
constexpr std::chrono::milliseconds kDepartureCheck{250};
// What may be read and not yet understood: a header, an extension of a piece of a body, a trailer. Only the first has a
// limit of the parser's.
constexpr std::size_t kMostReadAhead = 128 * 1024;
constexpr std::size_t kHeaderPiece = 4096;       // read at once
constexpr std::ptrdiff_t kMostHeaderLines = 64;  // browsers send some twenty

std::string_view path_of(std::string_view target) { return target.substr(0, target.find('?')); }

// What a client that comes back to the event stream has seen; none of a new one.
Result<std::optional<SeenEvents>> seen_in(std::string_view target) {
  auto parsed = parse_target(target);
  if (!parsed) return Error{ErrorCode::kInvalidArgument, "this is no path of the API"};
  ApiRequest asked;
  asked.query = std::move(parsed->query);
  asked.repeated_query = std::move(parsed->repeated);
  auto query = RequestReader::query_of(asked);
  const auto life = query.text("life");
  const auto since = query.whole("since", {0, 9e15});
  if (life.has_value() != since.has_value())
    query.refuse({ErrorCode::kInvalidArgument, "life and since go together: send both, or neither"});
  if (Status read = query.end(); !read) return read.error();
  if (!life || !since) return std::optional<SeenEvents>();
  return std::optional<SeenEvents>({*life, *since});
}

// "Authorization: Bearer SECRET"; a page cannot give a WebSocket headers, so there it is the protocol "bearer.SECRET".
template <class Fields>
std::string_view session_secret(const Fields& fields) {
  constexpr std::string_view kBearer = "Bearer ", kProtocol = "bearer.";
  const std::string_view authorization = fields[http::field::authorization];
  if (authorization.starts_with(kBearer)) return authorization.substr(kBearer.size());
  for (const std::string_view protocol : http::token_list{fields[http::field::sec_websocket_protocol]})
    if (protocol.starts_with(kProtocol)) return protocol.substr(kProtocol.size());
  return {};
}

template <class Fields>
BrowserHeaders browser_headers(const Fields& fields, bool changes) {
  const auto once = [&fields](http::field name) -> std::optional<std::string_view> {
    if (fields.count(name) == 0) return std::nullopt;
    if (fields.count(name) > 1) return "repeated";  // no host, no origin of ours
    return std::string_view(fields[name]);
  };
  const auto fetched = fields.find("Sec-Fetch-Site");
  return {once(http::field::host).value_or(""),
          once(http::field::origin),
          session_secret(fields),
          cookie_of(once(http::field::cookie).value_or("")),
          fetched == fields.end() ? std::nullopt : std::optional<std::string_view>(fetched->value()),
          fields["Sec-Fetch-Mode"] == "navigate" && fields["Sec-Fetch-Dest"] == "document",
          changes};
}

bool is_stop(const http::request<http::string_body>& request) {
  return request.method() == http::verb::post && path_of(request.target()) == kStopPath;
}

// A form that was sent without a script; scripts and programs take anything.
bool wants_page(const http::request<http::string_body>& request) {
  return std::string_view(request[http::field::accept]).find("text/html") != std::string_view::npos;
}

}  // namespace

// A handler's one way back. Whoever holds it last without having replied replies with 500.
class ReplySlot {
 public:
  ReplySlot(std::weak_ptr<HttpConnection> connection, ApiStream::executor_type reactor, std::uint64_t number)
      : connection_(std::move(connection)), reactor_(std::move(reactor)), number_(number) {}
  ReplySlot(const ReplySlot&) = delete;
  ReplySlot& operator=(const ReplySlot&) = delete;
  ~ReplySlot() { send(ApiReply::error(Error{ErrorCode::kInternal, "the request was dropped: see the daemon's log"})); }

  void send(ApiReply reply) {
    if (sent_.exchange(true)) return;
    asio::dispatch(reactor_, [connection = connection_, number = number_, reply = std::move(reply)]() mutable {
      if (const auto alive = connection.lock()) alive->take_reply(number, std::move(reply));
    });
  }

 private:
  std::weak_ptr<HttpConnection> connection_;
  ApiStream::executor_type reactor_;
  std::uint64_t number_;
  std::atomic<bool> sent_{false};
};

HttpConnection::HttpConnection(ApiSocket socket, std::shared_ptr<ServerShared> shared, Visitor visitor)
    : shared_(std::move(shared)),
      stream_(std::move(socket), visitor.door == TransportKind::kTls ? &shared_->tls->context() : nullptr),
      reply_timer_(stream_.get_executor()),
      departure_timer_(stream_.get_executor()),
      visitor_(std::move(visitor)),
      buffer_(kMostReadAhead),
      caller_(visitor_.peer ? *visitor_.peer : caller_over_tcp({}, shared_->accounts, visitor_.door, visitor_.address)),
      identity_(identity_of(caller_, visitor_.address)) {
  step(Doing::kReading);
}

void HttpConnection::start() {
  if (!stream_.through_tls()) return read_header();
  hello_.emplace();
  limit_handshake(shared_->options.header_timeout);
  read_hello();
}

void HttpConnection::step(Doing doing) {
  doing_ = doing;
  last_activity_ = ++shared_->activity;
}

void HttpConnection::drop() {
  awaiting_turn_ = awaiting_reply_ = false;
  gone_.request_stop();
  reply_timer_.cancel();
  departure_timer_.cancel();
  open_handshake_.reset();
  request_share_ = {};
  upload_share_ = {};
  reply_share_ = {};
  stream_.close();
}

void HttpConnection::gone() {
  drop();
  if (shared_->on_gone) shared_->on_gone(*this);
}

void HttpConnection::read_header() {
  step(Doing::kReading);
  ++request_number_;
  parser_.emplace();
  header_lines_ = 0;
  header_bytes_ = 0;
  parser_->header_limit(static_cast<std::uint32_t>(shared_->options.max_header_bytes));
  parser_->body_limit(std::numeric_limits<std::uint64_t>::max());  // lowered once we know who sends it where
  parser_->eager(false);
  stream_.expires_after(shared_->options.header_timeout);
  parse_header();
}

// Beast sorts the fields by name as it reads them, a microsecond each: two hundred connections that send a thousand of
// them would keep the reactor from STOP for a fifth of a second. So their lines are counted before.
void HttpConnection::parse_header() {
  const std::string_view said(static_cast<const char*>(buffer_.cdata().data()), buffer_.size());
  // The parser takes line by line: of a header that came apart there, only its last line's end is left.
  const std::size_t end = header_lines_ > 0 && said.starts_with("\r\n") ? 0 : said.find("\r\n\r\n");
  const auto lines = std::ranges::count(said.substr(0, end), '\n') + (end == std::string_view::npos ? 0 : 1);
  if (header_lines_ + lines > kMostHeaderLines)
    return answer(ApiReply::error(431, "too_large",
                                  "the request's header has more than " + std::to_string(kMostHeaderLines) +
                                      " lines: send fewer fields"),
                  true);
  if (header_bytes_ + std::min(end, said.size()) > shared_->options.max_header_bytes)
    return on_parse_fault(http::error::header_limit);
  error_code fault;
  if (!said.empty()) {
    const std::size_t understood = parser_->put(buffer_.cdata(), fault);
    header_lines_ += std::ranges::count(said.substr(0, understood), '\n');
    header_bytes_ += understood;
    buffer_.consume(understood);
  }
  if (fault == http::error::need_more) fault = {};
  if (fault || parser_->is_header_done()) return on_header(fault);
  const std::size_t room = boost::beast::read_size(buffer_, kHeaderPiece);
  stream_.async_read_some(buffer_.prepare(room), [self = shared_from_this()](error_code cut_off, std::size_t bytes) {
    if (cut_off) return self->on_header(cut_off);
    self->buffer_.commit(bytes);
    self->parse_header();
  });
}

void HttpConnection::on_parse_fault(error_code fault) {
  upload_share_ = {};
  if (fault == http::error::header_limit) {
    return answer(ApiReply::error(431, "too_large", "the request's header is too large: send fewer or shorter fields"),
                  true);
  }
  if (fault == http::error::body_limit) {
    return answer(ApiReply::error(413, "too_large", "the request's body is too large: send less"), true);
  }
  if (fault == http::error::buffer_overflow) {
    return answer(ApiReply::error(413, "too_large",
                                  "what stands between the pieces of the request's body is too large: leave it out"),
                  true);
  }
  const bool malformed = fault.category() == http::make_error_code(http::error::bad_method).category() &&
                         fault != http::error::end_of_stream && fault != http::error::partial_message;
  if (malformed)
    return answer(ApiReply::error(400, "invalid_argument", "this is not HTTP (" + fault.message() + "): send HTTP/1.1"),
                  true);
  gone();
}

void HttpConnection::on_header(error_code fault) {
  if (fault) return on_parse_fault(fault);
  step(Doing::kReading);
  const auto& request = parser_->get();
  const BrowserHeaders headers = browser_headers(request, request.method() != http::verb::get);
  if (!visitor_.peer) {
    const bool page = !path_of(request.target()).starts_with("/api/");
    const bool tls = visitor_.door == TransportKind::kTls;
    const ListeningAddress at =
        tls ? ListeningAddress{&*shared_->tls, shared_->tls_port} : ListeningAddress{nullptr, shared_->tcp_port};
    if (auto refusal = refuse_foreign(headers, at, page)) return answer(std::move(*refusal), true);
  }
  const auto who_asks = [&]() -> const Caller& {
    caller_ =
        visitor_.peer ? *visitor_.peer : caller_over_tcp(headers, shared_->accounts, visitor_.door, visitor_.address);
    return caller_;
  };
  if (is_stop(request)) {
    // Before anything that may wait, a line of the log and a look at who it is included.
    ApiReply told = shared_->on_stop(who_asks);
    answer(wants_page(request) ? stopped_page(std::move(told)) : std::move(told), !parser_->is_done());
    shared_->log->warn("STOP from {}", caller_.who);
    return;
  }
  identity_ = identity_of(who_asks(), visitor_.address);
  take_turn(&HttpConnection::look_at_request);
}

void HttpConnection::take_turn(void (HttpConnection::*then)()) {
  awaiting_turn_ = true;
  shared_->turns.wait(identity_, [weak = weak_from_this(), then] {
    const auto self = weak.lock();
    if (self && std::exchange(self->awaiting_turn_, false)) (self.get()->*then)();
  });
  if (!std::exchange(shared_->gives_turns, true)) give_turns(shared_, stream_.get_executor());
}

// One each time the loop comes round.
void HttpConnection::give_turns(const std::shared_ptr<ServerShared>& shared, const ApiStream::executor_type& reactor) {
  asio::post(reactor, [shared, reactor] {
    shared->turns.next()();
    if (shared->turns.empty())
      shared->gives_turns = false;
    else
      give_turns(shared, reactor);
  });
}

void HttpConnection::look_at_request() {
  const auto& request = parser_->get();
  if (request.method() == http::verb::get && path_of(request.target()) == kEventsPath) return upgrade();
  route();
}

void HttpConnection::upgrade() {
  if (caller_.role < Role::kViewer)
    return answer(ApiReply::error(403, "forbidden", role_needed(caller_, Role::kViewer)), true);
  if (!boost::beast::websocket::is_upgrade(parser_->get())) {
    return answer(ApiReply::error(400, "invalid_argument", "this is the event stream: open it as a WebSocket"), true);
  }
  const auto seen = seen_in(std::string_view(parser_->get().target()));
  if (!seen) return answer(ApiReply::error(seen.error()), true);
  switch (shared_->hub.make_room_for(caller_)) {
    case EventHub::Room::kTooManyOfThisIdentity:
      return answer(ApiReply::too_many("too many of you listen to the event stream already"), true);
    case EventHub::Room::kFull:
      return answer(ApiReply::busy("too many listen to the event stream already"), true);
    case EventHub::Room::kFree:
      break;
  }
  const auto client = std::make_shared<EventClient>(std::move(stream_), shared_->hub, caller_, shared_->log);
  client->accept(parser_->release(), *seen);
  if (shared_->on_gone) shared_->on_gone(*this);
}

void HttpConnection::route() {
  const auto& request = parser_->get();
  match_ = shared_->router.match(std::string_view(request.method_string()), std::string_view(request.target()));
  if (!match_.route) return answer(std::move(match_.refusal), !parser_->is_done());
  if (caller_.role < match_.route->role) {
    return answer(ApiReply::error(403, "forbidden", role_needed(caller_, match_.route->role)), !parser_->is_done());
  }
  const std::size_t max_body = match_.route->max_body;
  const auto length = parser_->content_length();
  if (length && *length > max_body) {
    return answer(ApiReply::error(413, "too_large",
                                  "the body is larger than " + std::to_string(max_body / 1024) + " KiB: send less"),
                  true);
  }
  parser_->body_limit(max_body);
  if (max_body > kSmallBody && (length ? *length > kSmallBody : !parser_->is_done())) {
    if (auto refusal = shared_->shares.begin_upload(identity_, upload_share_)) return answer(std::move(*refusal), true);
  }
  if (request[http::field::expect] == "100-continue") return say_continue();
  read_body();
}

void HttpConnection::say_continue() {
  stream_.expires_after(shared_->options.write_timeout);
  static constexpr std::string_view kContinue = "HTTP/1.1 100 Continue\r\n\r\n";
  asio::async_write(stream_, asio::buffer(kContinue), [self = shared_from_this()](error_code fault, std::size_t) {
    if (fault) return self->gone();
    self->read_body();
  });
}

void HttpConnection::read_body() {
  if (parser_->is_done()) return handle();
  stream_.expires_after(shared_->options.body_timeout);
  parser_->eager(true);
  hashed_ = 0;
  body_hash_.reset();
  if (match_.route->changes && parser_->get().find("Idempotency-Key") != parser_->get().end()) body_hash_.emplace();
  read_more();
}

void HttpConnection::read_more() {
  http::async_read_some(stream_, buffer_, *parser_, [self = shared_from_this()](error_code fault, std::size_t) {
    if (fault) return self->on_parse_fault(fault);
    self->hash_more();
    if (!self->parser_->is_done()) return self->read_more();
    self->take_turn(&HttpConnection::handle);
  });
}

void HttpConnection::hash_more() {
  const std::string& body = parser_->get().body();
  if (!body_hash_ || body.size() == hashed_) return;
  body_hash_->add(std::as_bytes(std::span(body).subspan(hashed_)));
  hashed_ = body.size();
}

void HttpConnection::handle() {
  step(Doing::kHandling);
  stream_.expires_never();
  auto& message = parser_->get();
  ApiRequest request;
  request.method = std::string(message.method_string());
  request.path = std::string(path_of(message.target()));
  request.path_params = std::move(match_.path_params);
  request.query = std::move(match_.query);
  request.repeated_query = std::move(match_.repeated_query);
  request.content_type = std::string(message[http::field::content_type]);
  if (body_hash_ && message.body().size() > kHashedWhole) request.body_sha256 = body_hash_->hex();
  body_hash_.reset();
  request.body = std::move(message.body());
  request.idempotency_key = std::string(message["Idempotency-Key"]);
  request.if_none_match = std::string(message[http::field::if_none_match]);
  request.accept_encoding = std::string(message[http::field::accept_encoding]);
  request.caller = caller_;
  request.address = visitor_.address;
  if (auto refusal = shared_->shares.begin_request(identity_, request_share_)) {
    upload_share_ = {};
    return answer(std::move(*refusal));
  }
  gone_ = std::stop_source();
  request.gone = gone_.get_token();

  awaiting_reply_ = true;
  reply_timer_.expires_after(shared_->options.reply_timeout);
  reply_timer_.async_wait([self = shared_from_this(), number = request_number_](error_code fault) {
    if (fault) return;
    self->gone_.request_stop();  // what waits for it is in vain now
    self->take_reply(number, ApiReply::error(Error{ErrorCode::kTimeout, "the daemon has no answer yet: ask again"}));
  });
  if (!match_.route->changes) notice_departure();
  run_handler(request);
}

// What a handler throws costs its request. A change may be half done then, and whoever owns the machine is told.
void HttpConnection::run_handler(const ApiRequest& request) {
  // Copied: the handler may bind further routes.
  const Handler handler = match_.route->handler;
  const bool changes = match_.route->changes;
  const auto slot = std::make_shared<ReplySlot>(weak_from_this(), stream_.get_executor(), request_number_);
  try {
    handler(request, [slot](ApiReply reply) { slot->send(std::move(reply)); });
  } catch (...) {
    const Error thrown = error_of_exception();
    shared_->log->error("{} {} of {}: {}", request.method, request.path, request.caller.who, thrown.message);
    if (changes && shared_->options.on_broken_change)
      shared_->options.on_broken_change(request.method + " " + request.path + ": " + thrown.message);
    slot->send(ApiReply::error(thrown));
  }
}

// A client that hangs up while its question waits is noticed, so that nobody works for it. What changes something is
// done all the same.
void HttpConnection::notice_departure() {
  const auto look = [self = shared_from_this(), number = request_number_](error_code fault) {
    if (fault || !self->awaiting_reply_ || number != self->request_number_) return;
    if (self->client_is_gone()) return self->gone();
    // It has sent its next request ahead: there is something to read from now on, and only time tells of its end.
    self->departure_timer_.expires_after(kDepartureCheck);
    self->departure_timer_.async_wait([self, number](error_code ended) {
      if (!ended && self->awaiting_reply_ && number == self->request_number_) self->notice_departure();
    });
  };
  stream_.socket().async_wait(ApiSocket::wait_read, look);
}

bool HttpConnection::client_is_gone() {
  pollfd client{stream_.socket().native_handle(), POLLRDHUP, 0};
  return ::poll(&client, 1, 0) < 0 || (client.revents & (POLLRDHUP | POLLHUP | POLLERR | POLLNVAL)) != 0;
}

void HttpConnection::take_reply(std::uint64_t number, ApiReply reply) {
  if (!awaiting_reply_ || number != request_number_) return;
  awaiting_reply_ = false;
  reply_timer_.cancel();
  departure_timer_.cancel();
  request_share_ = {};
  upload_share_ = {};
  answer(std::move(reply));
}

void HttpConnection::answer(ApiReply reply, bool close_after) {
  step(Doing::kWriting);
  if (reply.body.size() > kSmallBody)
    if (auto refusal = shared_->shares.begin_reply(identity_, reply.body.size(), reply_share_))
      reply = std::move(*refusal);
  const bool known = parser_->is_header_done();
  const auto& request = parser_->get();
  response_.emplace();
  response_->version(known ? request.version() : 11);
  response_->result(static_cast<unsigned>(reply.status));
  response_->set(http::field::server, "veneerd");
  response_->set(http::field::cache_control, reply.etag.empty() ? "no-store" : "private, no-cache");
  if (!reply.etag.empty()) response_->set(http::field::etag, reply.etag);
  response_->set("X-Content-Type-Options", "nosniff");
  response_->set("Cross-Origin-Resource-Policy", "same-origin");
  if (!reply.content_type.empty()) response_->set(http::field::content_type, reply.content_type);
  for (const auto& [name, value] : reply.headers) response_->set(name, value);
  response_->body() = std::move(reply.body);
  response_->keep_alive(known && request.keep_alive() && !close_after);
  response_->prepare_payload();
  stream_.expires_after(shared_->options.write_timeout);
  http::async_write(stream_, *response_, [self = shared_from_this()](error_code fault, std::size_t) {
    if (fault) return self->gone();
    const bool last = self->response_->need_eof();
    self->response_.reset();
    self->reply_share_ = {};
    if (last) return self->linger();
    self->read_header();
  });
}

// Closing with unread bytes would reset the connection, and the client might never see why it was refused. Whoever goes
// on sending is not listening: its bytes would only keep the reactor busy.
void HttpConnection::linger() {
  step(Doing::kReading);
  swallowed_ = 0;
  error_code ignored;
  stream_.socket().shutdown(ApiSocket::shutdown_send, ignored);
  stream_.expires_after(kLinger);
  swallow();
}

void HttpConnection::swallow() {
  buffer_.clear();
  stream_.async_read_some(buffer_.prepare(16 * 1024), [self = shared_from_this()](error_code fault, std::size_t bytes) {
    self->swallowed_ += bytes;
    if (fault || self->swallowed_ > kMostSwallowed) return self->gone();
    self->swallow();
  });
}

}  // namespace veneer::daemon
