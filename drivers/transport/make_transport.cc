#include "drivers/transport/make_transport.h"

#include <fmt/format.h>

#include <charconv>
#include <optional>
#include <string>

#include "drivers/transport/serial_transport.h"
#include "drivers/transport/tcp_transport.h"

namespace veneer {
namespace {

Error bad(std::string_view address, std::string_view what) {
  return {ErrorCode::kInvalidArgument,
          fmt::format("the port \"{}\" {}: write serial:/dev/ttyUSB0?baud=115200 or tcp:HOST:PORT", address, what)};
}

std::optional<unsigned> whole_number(std::string_view text) {
  unsigned value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

Result<std::unique_ptr<Transport>> make_serial(std::string_view address, std::string_view rest,
                                               boost::asio::io_context& io) {
  unsigned baud = 115200;
  const auto question = rest.find('?');
  if (question != std::string_view::npos) {
    const std::string_view query = rest.substr(question + 1);
    if (query.substr(0, 5) != "baud=") return bad(address, "has an unknown option");
    const auto number = whole_number(query.substr(5));
    if (!number || !SerialTransport::supports_baud(*number)) return bad(address, "has an unusable baud rate");
    baud = *number;
  }
  const std::string_view path = rest.substr(0, question);
  if (path.empty() || path.front() != '/') return bad(address, "names no device by its full path");
  return std::unique_ptr<Transport>(std::make_unique<SerialTransport>(io, std::string(path), baud));
}

Result<std::unique_ptr<Transport>> make_tcp(std::string_view address, std::string_view rest,
                                            boost::asio::io_context& io) {
  const auto colon = rest.rfind(':');
  if (colon == std::string_view::npos) return bad(address, "has no port number");
  std::string_view host = rest.substr(0, colon);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  const auto port = whole_number(rest.substr(colon + 1));
  if (host.empty()) return bad(address, "has no host");
  if (!port || *port == 0 || *port > 65535) return bad(address, "has an unusable port number");
  return std::unique_ptr<Transport>(std::make_unique<TcpTransport>(io, std::string(host), std::to_string(*port)));
}

}  // namespace

Result<std::unique_ptr<Transport>> make_transport(std::string_view address, boost::asio::io_context& io) {
  const auto colon = address.find(':');
  if (colon == std::string_view::npos) return bad(address, "names no kind of link");
  const std::string_view kind = address.substr(0, colon), rest = address.substr(colon + 1);
  if (kind == "serial") return make_serial(address, rest, io);
  if (kind == "tcp") return make_tcp(address, rest, io);
  return bad(address, fmt::format("is of the unknown kind \"{}\"", kind));
}

}  // namespace veneer
