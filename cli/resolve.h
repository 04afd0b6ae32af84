// Where a host is, found within a time: looking a name up has no end of its own when the network is gone.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "base/result.h"

namespace veneer::cli {

using TcpEndpoints = std::vector<boost::asio::ip::tcp::endpoint>;
// Blocks as long as it likes; empty when nobody knows the name.
using Lookup = std::function<TcpEndpoints(const std::string& host, const std::string& port)>;
TcpEndpoints ask_the_network(const std::string& host, const std::string& port);

// Is `host` this machine itself, by its address? "localhost", "127.0.0.1", "::1", "[::1]".
bool is_loopback(const std::string& host);

// Of an address at once, of a name as `lookup` says, on a thread of its own that is left behind when time is over:
// kTimeout. kInvalidArgument when nobody knows the name.
Result<TcpEndpoints> resolve_within(const std::string& host, int port, std::chrono::milliseconds time,
                                    const Lookup& lookup = ask_the_network);

}  // namespace veneer::cli
