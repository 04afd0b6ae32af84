// From an address in the configuration to a USB link that is not yet open.
//
//   usb:1a86:5512        vendor and product, in hexadecimal; must be the only such device
//   usb:1a86:5512@1-2.4  the one plugged in at this bus and port: these boards have no serial number
//   file:/path           records what is written; answers as a Lihuiyu board does that has burnt each program as soon
//                        as it has it (lihuiyu::LihuiyuOptions::for_recording())
#pragma once

#include <boost/asio/io_context.hpp>
#include <memory>
#include <string_view>

#include "base/result.h"
#include "drivers/usb_transport.h"

namespace veneer {

// kInvalidArgument says what is wrong with the address. `io` must outlive the link.
Result<std::unique_ptr<UsbTransport>> make_usb_transport(std::string_view address, boost::asio::io_context& io);

}  // namespace veneer
