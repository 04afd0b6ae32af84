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

Result<tcp::endpoint> parse_loopback(std::string_view listen) {
  const std::string shown(listen);
  const std::size_t colon = listen.rfind(':');
  std::string host(listen.substr(0, colon));
  std::string_view port_text = colon == std::string_view::npos ? std::string_view() : listen.substr(colon + 1);
  unsigned port = 0;
  const auto [end, fault] = std::from_chars(port_text.data(), port_text.data() + port_text.size(), port);
  if (port_text.empty() || fault != std::errc() || end != port_text.data() + port_text.size() || port > 65535) {
    return Error{ErrorCode::kInvalidArgument, "listen = \"" + shown + "\" has no port: write 127.0.0.1:8765"};
  }
  if (host == "localhost") host = "127.0.0.1";
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  error_code bad_address;
  const auto address = asio::ip::make_address(host, bad_address);
  if (bad_address || !address.is_loopback()) {
    return Error{ErrorCode::kInvalidArgument,
                 "listen = \"" + shown + "\" is not a loopback address: write 127.0.0.1:" + std::string(port_text) +
                     " (beyond this machine the API needs TLS and accounts, which it does not have yet)"};
  }
  return tcp::endpoint(address, static_cast<unsigned short>(port));
}

Result<tcp::acceptor> listen_on_loopback(asio::io_context& reactor, std::string_view listen) {
  const auto endpoint = parse_loopback(listen);
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
