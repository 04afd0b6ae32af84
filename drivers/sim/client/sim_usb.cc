#include "drivers/sim/client/sim_usb.h"

#include <fmt/format.h>
#include <sys/socket.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/read_until.hpp>
#include <optional>
#include <sstream>
#include <utility>
#include <variant>

namespace veneer::sim {
namespace {

using Protocol = boost::asio::local::stream_protocol;

std::string hex_of(std::string_view bytes) {
  if (bytes.empty()) return "-";
  std::string out;
  for (const char c : bytes) out += fmt::format("{:02x}", static_cast<unsigned char>(c));
  return out;
}

std::optional<std::string> bytes_of(const std::string& hex) {
  std::string out;
  if (hex == "-") return out;
  if (hex.empty() || hex.size() % 2 != 0 || hex.find_first_not_of("0123456789abcdef") != std::string::npos)
    return std::nullopt;
  for (std::size_t i = 0; i < hex.size(); i += 2) out += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
  return out;
}

}  // namespace

SimUsb::SimUsb(boost::asio::io_context& io, std::string path)
    : path_(std::move(path)), socket_(io), generation_(std::make_shared<int>(0)) {}

SimUsb::~SimUsb() { SimUsb::close(); }

Status SimUsb::open(OnReply on_reply, OnClosed on_closed) {
  close();
  boost::system::error_code failed;
  // A name too long for a socket throws nothing else.
  try {
    socket_.connect(Protocol::endpoint(path_), failed);
  } catch (const boost::system::system_error& error) {
    failed = error.code();
  }
  if (failed) {
    close();
    return Error{ErrorCode::kUnavailable,
                 fmt::format("no simulated Lihuiyu board answers at {} ({}): start veneer-twin with controller = "
                             "\"lihuiyu-m2\" or \"lihuiyu-m3\" in [twin.laser], and plug it in",
                             path_, failed.message())};
  }
  on_reply_ = std::move(on_reply);
  on_closed_ = std::move(on_closed);
  receive();
  return Ok();
}

void SimUsb::receive() {
  boost::asio::async_read_until(
      socket_, boost::asio::dynamic_buffer(incoming_), '\n',
      [this, alive = std::weak_ptr<int>(generation_)](const boost::system::error_code& error, std::size_t size) {
        if (alive.expired()) return;
        if (error) return fail("it was unplugged, or the twin ended");
        const std::string line = incoming_.substr(0, size);
        incoming_.erase(0, size);
        take(line);
        if (!alive.expired()) receive();
      });
}

void SimUsb::take(const std::string& line) {
  std::istringstream words(line);
  std::string what, hex;
  std::uint64_t id = 0;
  if (!(words >> what >> id)) return fail("it answers what nobody understands");
  if (id < first_reply_) return;
  if (what == "error") return fail("a transfer failed");
  UsbReply reply;
  reply.done = what == "done";
  if (reply.done) {
    const auto bytes = words >> hex ? bytes_of(hex) : std::nullopt;
    if (!bytes) return fail("it answers what nobody understands");
    reply.bytes = *bytes;
  }
  // A copy: the handler may close this transport.
  const OnReply on_reply = on_reply_;
  on_reply(reply);
}

void SimUsb::submit(UsbRequest request) {
  if (!socket_.is_open()) return;
  const std::uint64_t id = next_id_++;
  const auto timeout = request.timeout.count();
  if (const auto* setup = std::get_if<UsbSetup>(&request.what))
    send(fmt::format("setup {} {} {} {} {} {}\n", id, timeout, setup->request_type, setup->request, setup->value,
                     setup->index));
  else if (const auto* write = std::get_if<UsbWrite>(&request.what))
    send(fmt::format("write {} {} {} {}\n", id, timeout, write->endpoint, hex_of(write->bytes)));
  else if (const auto* read = std::get_if<UsbRead>(&request.what))
    send(fmt::format("read {} {} {} {}\n", id, timeout, read->endpoint, read->most_bytes));
}

void SimUsb::submit_urgent(std::uint8_t endpoint, std::string_view bytes) noexcept {
  if (!socket_.is_open()) return;
  send(fmt::format("urgent {} {}\n", endpoint, hex_of(bytes)));
  first_reply_ = next_id_;
}

// The kernel holds thousands of lines; a twin that takes none at all shows when it is read from.
void SimUsb::send(const std::string& line) noexcept {
  static_cast<void>(::send(socket_.native_handle(), line.data(), line.size(), MSG_NOSIGNAL | MSG_DONTWAIT));
}

void SimUsb::close() noexcept {
  generation_ = std::make_shared<int>(0);
  boost::system::error_code ignored;
  socket_.close(ignored);
  incoming_.clear();
  on_reply_ = nullptr;
  on_closed_ = nullptr;
  first_reply_ = next_id_;
}

void SimUsb::fail(const std::string& why) {
  const OnClosed on_closed = std::move(on_closed_);
  close();
  if (on_closed)
    on_closed({ErrorCode::kDisconnected, fmt::format("the simulated laser's USB link {} is gone: {}", path_, why)});
}

}  // namespace veneer::sim
