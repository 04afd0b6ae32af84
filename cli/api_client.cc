#include "cli/api_client.h"

#include <fmt/format.h>

#include <array>
#include <boost/asio/connect.hpp>
#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/host_name_verification.hpp>
#include <boost/beast/core/basic_stream.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>
#include <charconv>
#include <limits>
#include <optional>
#include <random>
#include <thread>
#include <vector>

#include "cli/json_read.h"
#include "cli/resolve.h"

namespace veneer::cli {

namespace asio = boost::asio;
namespace http = boost::beast::http;
using boost::system::error_code;

namespace {

constexpr const char* kPrefix = "/api/v1";

ErrorCode code_from(std::string_view name) {
  constexpr std::array kCodes = {ErrorCode::kInvalidArgument, ErrorCode::kNotFound,    ErrorCode::kConflict,
                                 ErrorCode::kRefused,         ErrorCode::kUnavailable, ErrorCode::kTimeout,
                                 ErrorCode::kDisconnected,    ErrorCode::kDeviceFault, ErrorCode::kCancelled,
                                 ErrorCode::kStorage};
  for (const ErrorCode code : kCodes) {
    if (name == to_string(code)) return code;
  }
  if (name == "forbidden") return ErrorCode::kRefused;
  if (name == "too_many_requests") return ErrorCode::kUnavailable;
  if (name == "too_large" || name == "method_not_allowed") return ErrorCode::kInvalidArgument;
  return ErrorCode::kInternal;
}

Error error_from(const nlohmann::json& body, const std::string& otherwise) {
  const nlohmann::json& error = member(body, "error");
  return Error{code_from(text_or(error, "code", "internal")), text_or(error, "message", otherwise)};
}

std::string fresh_key() {
  std::random_device draw;
  std::string key;
  for (int i = 0; i < 4; ++i) key += fmt::format("{:08x}", draw());
  return key;
}

// One request on a connection of its own, run to its end or its deadline.
class Exchange {
 public:
  Exchange(const ApiAddress& address, std::chrono::milliseconds timeout)
      : address_(address), timeout_(timeout), stream_(loop_) {}

  Result<ApiResponse> run(http::request<http::string_body> request) {
    request_ = std::move(request);
    parser_.body_limit(std::numeric_limits<std::uint64_t>::max());  // Beast 1.74 takes "none" for zero
    const auto deadline = std::chrono::steady_clock::now() + timeout_;
    stream_.expires_at(deadline);
    const auto begin = [this](error_code fault) { connected(fault); };
    if (!address_.unix_path.empty()) {
      if (address_.unix_path.size() >= 108) {
        return Error{ErrorCode::kInvalidArgument, "the socket's path is too long: " + address_.unix_path};
      }
      stream_.async_connect(asio::local::stream_protocol::endpoint(address_.unix_path), begin);
    } else {
      if (Status ready = prepare_tls(); !ready) return ready.error();
      // STOP's time counts from here, however long the network takes to say where the cell is.
      const auto found = resolve_within(address_.host, address_.port, timeout_);
      if (!found) return found.error();
      const std::vector<Endpoint> endpoints(found->begin(), found->end());
      stream_.async_connect(endpoints, [begin](error_code fault, const Endpoint&) { begin(fault); });
    }
    loop_.run();
    if (failed_) return *failed_;
    const auto& response = parser_.get();
    ApiResponse out{static_cast<int>(response.result_int()), std::string(response[http::field::content_type]),
                    response.body()};
    const std::string_view age = response[http::field::age];
    std::int64_t seconds = 0;
    if (std::from_chars(age.data(), age.data() + age.size(), seconds).ec == std::errc()) out.age_s = seconds;
    return out;
  }

 private:
  using Plain = boost::beast::basic_stream<asio::generic::stream_protocol>;
  using Endpoint = asio::generic::stream_protocol::endpoint;

  std::string where() const {
    return address_.unix_path.empty() ? address_.host + ":" + std::to_string(address_.port) : address_.unix_path;
  }

  // "[::1]" is written so before a port only.
  std::string host() const {
    const std::string& host = address_.host;
    return host.size() > 2 && host.front() == '[' ? host.substr(1, host.size() - 2) : host;
  }

  Status prepare_tls() {
    if (!address_.tls) return Ok();
    context_.emplace(asio::ssl::context::tls_client);
    context_->set_options(asio::ssl::context::default_workarounds | asio::ssl::context::no_tlsv1 |
                          asio::ssl::context::no_tlsv1_1);
    context_->set_verify_mode(asio::ssl::verify_peer);
    error_code fault;
    // Reading all the system's certificates takes some 25 ms, which STOP from another machine would wait.
    if (address_.authority.empty())
      context_->set_default_verify_paths(fault);
    else
      context_->load_verify_file(address_.authority, fault);
    if (fault)
      return Error{ErrorCode::kInvalidArgument,
                   (address_.authority.empty() ? "what this system has" : address_.authority) +
                       " cannot be read as certificates: give a PEM file as --ca"};
    tls_.emplace(stream_, *context_);
    tls_->set_verify_callback(asio::ssl::host_name_verification(host()));
    std::string name = host();
    SSL_set_tlsext_host_name(tls_->native_handle(), name.data());
    return Ok();
  }

  void shake_hands() {
    tls_->async_handshake(asio::ssl::stream_base::client, [this](error_code fault) {
      if (!fault) return write();
      failed_ = Error{ErrorCode::kRefused,
                      fmt::format("{} did not show a certificate that is believed ({}): give the cell's own with --ca, "
                                  "and the name that stands in it",
                                  where(), fault.message())};
      if (fault == boost::beast::error::timeout) failed_ = too_late();
    });
  }

  Error too_late() const {
    return Error{ErrorCode::kTimeout, fmt::format("veneerd at {} has not answered in {:g} s", where(),
                                                  std::chrono::duration<double>(timeout_).count())};
  }

  void connected(error_code fault) {
    if (fault) {
      const bool forbidden = fault == asio::error::access_denied;
      failed_ = Error{ErrorCode::kUnavailable,
                      forbidden ? "you may not use " + where() + ": ask for membership in the cell's operator group"
                                : "veneerd does not answer at " + where() + ": start it, or give its --socket"};
      return;
    }
    if (tls_) return shake_hands();
    write();
  }

  template <class Act>
  void on_stream(const Act& act) {
    if (tls_) return act(*tls_);
    act(stream_);
  }

  void write() {
    on_stream([this](auto& stream) {
      http::async_write(stream, request_, [this](error_code fault, std::size_t) {
        // A refusal may be on its way although the body was not taken.
        if (fault) write_failed_ = true;
        read();
      });
    });
  }

  void read() {
    on_stream([this](auto& stream) {
      http::async_read(stream, buffer_, parser_, [this](error_code fault, std::size_t) {
        if (!fault) return;
        failed_ = fault == boost::beast::error::timeout
                      ? too_late()
                      : Error{ErrorCode::kDisconnected, "veneerd at " + where() + " hung up" +
                                                            (write_failed_ ? " while the request was being sent" : "")};
      });
    });
  }

  const ApiAddress& address_;
  std::chrono::milliseconds timeout_;
  asio::io_context loop_;
  Plain stream_;
  std::optional<asio::ssl::context> context_;
  std::optional<boost::beast::ssl_stream<Plain&>> tls_;
  boost::beast::flat_buffer buffer_;
  http::request<http::string_body> request_;
  http::response_parser<http::string_body> parser_;
  bool write_failed_ = false;
  std::optional<Error> failed_;
};

}  // namespace

bool may_carry_secret(const ApiAddress& address) {
  return address.tls || !address.unix_path.empty() || is_loopback(address.host);
}

Result<ApiResponse> ApiClient::raw(const std::string& method, const std::string& path, const std::string& body,
                                   const std::string& content_type,
                                   const std::vector<std::pair<std::string, std::string>>& headers) const {
  if (!address_.secret.empty() && !may_carry_secret(address_))
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("a sign-in would go to {} in clear text: use https://{} with the port of listen_tls, or "
                             "unset VENEERD_TOKEN",
                             address_.host, address_.host)};
  http::request<http::string_body> request;
  request.version(11);
  request.method_string(method);
  request.target(path);
  request.set(http::field::host,
              address_.unix_path.empty() ? address_.host + ":" + std::to_string(address_.port) : "localhost");
  request.set(http::field::connection, "close");
  if (!content_type.empty()) request.set(http::field::content_type, content_type);
  if (!address_.secret.empty()) request.set(http::field::authorization, "Bearer " + address_.secret);
  for (const auto& [name, value] : headers) request.set(name, value);
  request.body() = body;
  request.prepare_payload();
  return Exchange(address_, timeout_).run(std::move(request));
}

Result<nlohmann::json> ApiClient::request(const std::string& method, const std::string& target, const std::string& body,
                                          const std::string& content_type) const {
  std::vector<std::pair<std::string, std::string>> headers;
  const bool keyed = method != "GET" && target != "/stop";
  if (keyed) headers.emplace_back("Idempotency-Key", fresh_key());
  auto response = raw(method, kPrefix + target, body, content_type, headers);
  if (!response && keyed && response.error().code == ErrorCode::kDisconnected)
    response = raw(method, kPrefix + target, body, content_type, headers);
  if (!response) return response.error();
  nlohmann::json parsed = nlohmann::json::parse(response->body, nullptr, /*allow_exceptions=*/false);
  if (response->status >= 400) {
    return error_from(parsed, "veneerd answered with HTTP status " + std::to_string(response->status));
  }
  if (parsed.is_discarded()) return Error{ErrorCode::kInternal, "veneerd's answer to " + target + " is not JSON"};
  return parsed;
}

Result<nlohmann::json> ApiClient::get_all(const std::string& target, const std::string& list) const {
  const std::string pages = target + (target.find('?') == std::string::npos ? "?" : "&") + "limit=1000";
  auto whole = get(pages);
  while (whole && !member(*whole, "next").is_null()) {
    // A number, or a name.
    const nlohmann::json& next = member(*whole, "next");
    const auto page = get(pages + "&cursor=" + (next.is_string() ? url_encode(next.get<std::string>()) : next.dump()));
    if (!page) return page.error();
    const nlohmann::json& more = member(*page, list.c_str());
    const bool goes_on = !member(*page, "next").is_null();
    if (!more.is_array() || (more.empty() && goes_on) || !member(*whole, list.c_str()).is_array())
      return Error{ErrorCode::kInternal, "veneerd's answer to " + target + " breaks off"};
    for (const nlohmann::json& item : more) (*whole)[list].push_back(item);
    // What a search could not look at is of each page, too.
    if (const nlohmann::json& left = member(*page, "not_searched"); left.is_array())
      for (const nlohmann::json& item : left) (*whole)["not_searched"].push_back(item);
    (*whole)["next"] = member(*page, "next");
  }
  return whole;
}

Result<nlohmann::json> ApiClient::post(const std::string& target, const nlohmann::json& body) const {
  return request("POST", target, body.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace),
                 "application/json");
}

Result<std::string> ApiClient::get_bytes(const std::string& target) const {
  auto picture = get_picture(target);
  if (!picture) return picture.error();
  return std::move(picture->bytes);
}

Result<SentPicture> ApiClient::get_picture(const std::string& target) const {
  auto response = raw("GET", kPrefix + target, "", "");
  if (!response) return response.error();
  if (response->status >= 400) {
    return error_from(nlohmann::json::parse(response->body, nullptr, false),
                      "veneerd answered with HTTP status " + std::to_string(response->status));
  }
  return SentPicture{std::move(response->body), response->age_s};
}

Result<nlohmann::json> ApiClient::wait_task(std::int64_t task, const OnProgress& on_progress) const {
  const std::string target = "/tasks/" + std::to_string(task);
  std::chrono::milliseconds pause(20);
  bool cancelled = false;
  while (true) {
    const auto view = get(target);
    if (!view) return view.error();
    const std::string state = text_or(*view, "state", "");
    const bool go_on = !on_progress || on_progress(*view);
    if (state == "done") return member(*view, "result");
    if (state == "failed" || state == "cancelled") return error_from(*view, "the work failed without saying why");
    if (!go_on && !cancelled) {
      cancelled = true;
      // It may have ended meanwhile; the next look tells.
      if (const auto asked = request("DELETE", target, "", ""); !asked && asked.error().code != ErrorCode::kConflict) {
        return asked.error();
      }
    }
    std::this_thread::sleep_for(pause);
    pause = std::min(pause * 3 / 2, std::chrono::milliseconds(250));
  }
}

Result<nlohmann::json> ApiClient::post_and_wait(const std::string& target, const nlohmann::json& body,
                                                const OnProgress& on_progress) const {
  const auto started = post(target, body);
  if (!started) return started.error();
  const std::int64_t task = whole_or(*started, "task", 0);
  if (task == 0) return Error{ErrorCode::kInternal, "veneerd began no task for " + target};
  return wait_task(task, on_progress);
}

std::string url_encode(std::string_view text) {
  constexpr std::string_view kHex = "0123456789ABCDEF";
  std::string encoded;
  for (const char c : text) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
                       c == '_' || c == '.' || c == '~';
    if (plain) {
      encoded += c;
    } else {
      const auto byte = static_cast<unsigned char>(c);
      encoded += '%';
      encoded += kHex[byte >> 4];
      encoded += kHex[byte & 15U];
    }
  }
  return encoded;
}

}  // namespace veneer::cli
