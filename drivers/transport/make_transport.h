// From an address in the configuration to a link that is not yet open.
//
//   serial:/dev/ttyUSB0?baud=115200    a serial line or pseudo-terminal, symlinks followed; baud defaults to 115200
//   tcp:HOST:PORT                      a raw byte stream; [v6] addresses in brackets
#pragma once

#include <boost/asio/io_context.hpp>
#include <memory>
#include <string_view>

#include "base/result.h"
#include "drivers/transport.h"

namespace veneer {

// kInvalidArgument says what is wrong with the address. `io` must outlive the link.
Result<std::unique_ptr<Transport>> make_transport(std::string_view address, boost::asio::io_context& io);

}  // namespace veneer
