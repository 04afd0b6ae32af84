// One kind of stream for both doors, so that what is above is written and compiled once.
#pragma once

// boost/asio/awaitable.hpp of 1.74 misses this under g++ 12.
#include <utility>

#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/beast/core/basic_stream.hpp>

namespace veneer::daemon {

using ApiSocket = boost::asio::generic::stream_protocol::socket;
using ApiStream = boost::beast::basic_stream<boost::asio::generic::stream_protocol>;

}  // namespace veneer::daemon
