#include "daemon/api/listen.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <boost/asio/ip/address.hpp>
#include <charconv>
#include <utility>

namespace veneer::daemon {

namespace asio = boost::asio;
using asio::ip::tcp;
using asio::local::stream_protocol;
using boost::system::error_code;

namespace {

Result<tcp::endpoint> parse(std::string_view key, std::string_view listen, std::string_view example) {
  const std::string shown = std::string(key) + " = \"" + std::string(listen) + "\"";
  const std::size_t colon = listen.rfind(':');
  std::string host(listen.substr(0, colon));
  std::string_view port_text = colon == std::string_view::npos ? std::string_view() : listen.substr(colon + 1);
  unsigned port = 0;
  const auto [end, fault] = std::from_chars(port_text.data(), port_text.data() + port_text.size(), port);
  if (port_text.empty() || fault != std::errc() || end != port_text.data() + port_text.size() || port > 65535)
    return Error{ErrorCode::kInvalidArgument, shown + " has no port: write " + std::string(example)};
  if (host == "localhost") host = "127.0.0.1";
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  error_code bad_address;
  const auto address = asio::ip::make_address(host, bad_address);
  if (bad_address)
    return Error{ErrorCode::kInvalidArgument, shown + " is not an address: write " + std::string(example)};
  return tcp::endpoint(address, static_cast<unsigned short>(port));
}

Result<tcp::acceptor> listen_at(asio::io_context& reactor, const Result<tcp::endpoint>& endpoint,
                                std::string_view listen) {
  if (!endpoint) return endpoint.error();
  error_code fault;
  tcp::acceptor acceptor(reactor);
  acceptor.open(endpoint->protocol(), fault);
  if (!fault) acceptor.set_option(tcp::acceptor::reuse_address(true), fault);
  if (!fault) acceptor.bind(*endpoint, fault);
  if (!fault) acceptor.listen(asio::socket_base::max_listen_connections, fault);
  if (fault) {
    return Error{ErrorCode::kConflict,
                 "cannot listen on " + std::string(listen) + " (" + fault.message() + "): is another veneerd running?"};
  }
  return acceptor;
}

}  // namespace

Result<tcp::endpoint> parse_loopback(std::string_view listen) {
  auto endpoint = parse("listen", listen, "127.0.0.1:8765");
  if (!endpoint || endpoint->address().is_loopback()) return endpoint;
  return Error{ErrorCode::kInvalidArgument,
               "listen = \"" + std::string(listen) +
                   "\" is not a loopback address, and beyond this machine the API is reached through TLS only: write "
                   "listen_tls = \"" +
                   std::string(listen) + "\" with tls_certificate and tls_key, and leave listen on 127.0.0.1"};
}

Result<tcp::acceptor> listen_on_loopback(asio::io_context& reactor, std::string_view listen) {
  return listen_at(reactor, parse_loopback(listen), listen);
}

Result<tcp::acceptor> listen_anywhere(asio::io_context& reactor, std::string_view listen) {
  return listen_at(reactor, parse("listen_tls", listen, "0.0.0.0:8443"), listen);
}

namespace {

Status make_room(asio::io_context& reactor, const std::filesystem::path& path) {
  std::error_code fault;
  const auto kind = std::filesystem::symlink_status(path, fault).type();
  if (kind == std::filesystem::file_type::not_found) return Ok();
  if (kind != std::filesystem::file_type::socket) {
    return Error{ErrorCode::kConflict, path.string() + " is there and is not a socket: move it away"};
  }
  stream_protocol::socket probe(reactor);
  error_code refused;
  probe.connect(stream_protocol::endpoint(path.string()), refused);
  if (!refused) return Error{ErrorCode::kConflict, "another veneerd answers at " + path.string() + ": stop it first"};
  std::filesystem::remove(path, fault);
  return Ok();
}

}  // namespace

Result<stream_protocol::acceptor> listen_on_socket(asio::io_context& reactor, const std::filesystem::path& path) {
  // STOP needs no login. Who may do more is judged by the peer's credentials, not by who can open the file.
  constexpr mode_t kMode = 0666;
  if (path.string().size() >= 108) {
    return Error{ErrorCode::kInvalidArgument, "the socket's path is too long (107 bytes at most): " + path.string()};
  }
  if (Status room = make_room(reactor, path); !room) return room.error();
  error_code fault;
  stream_protocol::acceptor acceptor(reactor);
  acceptor.open(stream_protocol(), fault);
  if (fault) return Error{ErrorCode::kStorage, "cannot make a socket (" + fault.message() + ")"};
  acceptor.bind(stream_protocol::endpoint(path.string()), fault);
  if (fault) {
    return Error{ErrorCode::kStorage, "cannot make the socket " + path.string() + " (" + fault.message() +
                                          "): does its folder exist, and may this user write there?"};
  }
  if (chmod(path.c_str(), kMode) != 0) {
    return Error{ErrorCode::kStorage, "cannot set the mode of the socket " + path.string()};
  }
  acceptor.listen(asio::socket_base::max_listen_connections, fault);
  if (fault) return Error{ErrorCode::kStorage, "cannot listen on " + path.string() + " (" + fault.message() + ")"};
  return acceptor;
}

}  // namespace veneer::daemon
