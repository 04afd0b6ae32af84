// Opening the doors: the Unix socket, the loopback port and the one for TLS.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"

namespace veneer::daemon {

// "127.0.0.1:8765", "[::1]:8765", "localhost:8765". kInvalidArgument for anything that is not loopback.
Result<boost::asio::ip::tcp::endpoint> parse_loopback(std::string_view listen);

Result<boost::asio::ip::tcp::acceptor> listen_on_loopback(boost::asio::io_context& reactor, std::string_view listen);
// Any address of this machine: "0.0.0.0:8443", "[::]:8443", "192.168.1.5:8443". Only for what speaks TLS.
Result<boost::asio::ip::tcp::acceptor> listen_anywhere(boost::asio::io_context& reactor, std::string_view listen);

// Anybody on the machine may connect (mode 0666): STOP needs no login, and everything else asks the peer's credentials.
// A socket that nobody answers at is replaced; kConflict when somebody does.
Result<boost::asio::local::stream_protocol::acceptor> listen_on_socket(boost::asio::io_context& reactor,
                                                                       const std::filesystem::path& path);

}  // namespace veneer::daemon
