// A POST to a web server that somebody else keeps.
#include <fmt/format.h>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/host_name_verification.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <fstream>

#include "daemon/orders/notify_work.h"

namespace veneer::daemon {
namespace {

namespace http = boost::beast::http;
namespace ssl = boost::asio::ssl;
using boost::asio::ip::tcp;

template <class Stream>
Status post_to(Stream& stream, const CallWebhook& order, const http::request<http::string_body>& request) {
  boost::system::error_code fault;
  http::write(stream, request, fault);
  boost::beast::flat_buffer received;
  http::response_parser<http::empty_body> answer;
  answer.header_limit(8 * 1024);
  if (!fault) http::read_header(stream, received, answer, fault);
  if (fault)
    return Error{ErrorCode::kUnavailable, fmt::format("{} port {} took no request: {}; look whether a web server is "
                                                      "there",
                                                      order.host, order.port, fault.message())};
  const unsigned status = answer.get().result_int();
  if (status >= 200 && status < 300) return Ok();
  return Error{ErrorCode::kRefused, fmt::format("{} answered {}: look at the address{}", order.host, status,
                                                status == 401 || status == 403 ? " and the token" : "")};
}

std::string first_line(const std::string& file) {
  std::string line;
  if (!file.empty()) {
    std::ifstream in(file);
    std::getline(in, line);
  }
  return line;
}

}  // namespace

Status call_webhook(const CallWebhook& order) {
  http::request<http::string_body> request{http::verb::post, order.path, 11};
  const std::string host = order.host.find(':') == std::string::npos ? order.host : "[" + order.host + "]";  // IPv6
  request.set(http::field::host, fmt::format("{}:{}", host, order.port));
  request.set(http::field::user_agent, "veneerd");
  request.set(http::field::connection, "close");
  request.set(http::field::content_type, order.content_type);
  request.set("Title", order.title);
  request.set("Priority", order.priority);
  if (const std::string token = first_line(order.token_file); !token.empty())
    request.set(http::field::authorization, "Bearer " + token);
  else if (!order.token_file.empty())
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("{} has no token in its first line, or veneerd may not read it", order.token_file)};
  request.body() = order.body;
  request.prepare_payload();

  boost::asio::io_context io;
  boost::system::error_code fault;
  tcp::resolver resolver(io);
  const auto found = resolver.resolve(order.host, std::to_string(order.port), fault);
  if (fault) return Error{ErrorCode::kUnavailable, fmt::format("{}: {}", order.host, fault.message())};
  const auto not_reached = [&] {
    return Error{ErrorCode::kUnavailable,
                 fmt::format("{} port {}: {}; the shipped unit lets veneerd speak to this machine only "
                             "(notifications.conf)",
                             order.host, order.port, fault.message())};
  };
  if (!order.tls) {
    tcp::socket socket(io);
    boost::asio::connect(socket, found, fault);
    return fault ? Status(not_reached()) : post_to(socket, order, request);
  }
  ssl::context trusted(ssl::context::tls_client);
  trusted.set_default_verify_paths(fault);
  ssl::stream<tcp::socket> stream(io, trusted);
  stream.set_verify_mode(ssl::verify_peer, fault);
  stream.set_verify_callback(ssl::host_name_verification(order.host), fault);
  boost::asio::connect(stream.next_layer(), found, fault);
  if (fault) return not_reached();
  SSL_set_tlsext_host_name(stream.native_handle(), order.host.c_str());
  stream.handshake(ssl::stream_base::client, fault);
  if (fault) return Error{ErrorCode::kRefused, fmt::format("{} is not trusted: {}", order.host, fault.message())};
  return post_to(stream, order, request);
}

}  // namespace veneer::daemon
