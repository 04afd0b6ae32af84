#include "drivers/transport/make_usb_transport.h"

#include <fmt/format.h>

#include <charconv>
#include <optional>
#include <string>

#include "drivers/transport/usb_file.h"
#include "drivers/transport/usb_port.h"

namespace veneer {
namespace {

Error bad_usb_address(std::string_view address, std::string_view what) {
  return {ErrorCode::kInvalidArgument,
          fmt::format("the port \"{}\" {}: write usb:1a86:5512, usb:1a86:5512@1-2 or file:/path", address, what)};
}

std::optional<std::uint16_t> four_hex_digits(std::string_view text) {
  std::uint16_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (error != std::errc() || end != text.data() + text.size() || text.size() != 4) return std::nullopt;
  return value;
}

bool is_place(std::string_view place) {
  return !place.empty() && place.find_first_not_of("0123456789-.") == std::string_view::npos &&
         place.find('-') != std::string_view::npos;
}

}  // namespace

Result<std::unique_ptr<UsbTransport>> make_usb_transport(std::string_view address, boost::asio::io_context& io) {
  const auto colon = address.find(':');
  if (colon == std::string_view::npos) return bad_usb_address(address, "names no kind of link");
  const std::string_view kind = address.substr(0, colon), rest = address.substr(colon + 1);
  if (kind == "file") {
    if (rest.empty() || rest.front() != '/') return bad_usb_address(address, "names no file by its full path");
    return std::unique_ptr<UsbTransport>(std::make_unique<UsbFile>(io, std::string(rest)));
  }
  if (kind != "usb") return bad_usb_address(address, fmt::format("is of the unknown kind \"{}\"", kind));
  UsbAddress usb;
  const auto at = rest.find('@');
  const std::string_view ids = rest.substr(0, at);
  if (at != std::string_view::npos) {
    usb.place = rest.substr(at + 1);
    if (!is_place(usb.place)) return bad_usb_address(address, "has an unusable place");
  }
  const auto middle = ids.find(':');
  const auto vendor = four_hex_digits(ids.substr(0, middle));
  const auto product = middle == std::string_view::npos ? std::nullopt : four_hex_digits(ids.substr(middle + 1));
  if (!vendor || !product) return bad_usb_address(address, "has no vendor and product of four hexadecimal digits each");
  usb.vendor = *vendor;
  usb.product = *product;
  return std::unique_ptr<UsbTransport>(std::make_unique<UsbPort>(io, usb));
}

}  // namespace veneer
