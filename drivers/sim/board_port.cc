#include "drivers/sim/board_port.h"

#include <fmt/format.h>
#include <sys/socket.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <utility>

#include "drivers/sim/port_times.h"
#include "drivers/sim/random.h"
#include "drivers/sim/world.h"

namespace veneer::sim {

namespace asio = boost::asio;
using boost::system::error_code;

namespace {

BoardOptions options_of(const BoardPortOptions& options) {
  BoardOptions out;
  out.m3 = options.m3;
  out.travel_x_mm = options.travel_x_mm, out.travel_y_mm = options.travel_y_mm;
  out.boot_time = std::chrono::duration_cast<Duration>(std::chrono::duration<double>(options.boot_seconds));
  return out;
}

std::string hex_of(const std::string& bytes) {
  std::string out;
  for (const char c : bytes) out += fmt::format("{:02x}", static_cast<unsigned char>(c));
  return out.empty() ? "-" : out;
}

std::optional<std::string> bytes_of(const std::string& hex) {
  std::string out;
  if (hex == "-") return out;
  if (hex.size() % 2 != 0 || hex.find_first_not_of("0123456789abcdef") != std::string::npos) return std::nullopt;
  for (std::size_t i = 0; i < hex.size(); i += 2) out += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
  return out;
}

}  // namespace

BoardPort::BoardPort(asio::io_context& io, const Clock& clock, World& world, BoardPortOptions options, Logger log)
    : clock_(clock),
      world_(world),
      options_(std::move(options)),
      log_(std::move(log)),
      board_(options_of(options_), options_.seed, &world),
      host_(board_),
      acceptor_(io),
      client_(io),
      visitor_(io),
      wake_(io),
      flush_(io) {
  Random random(options_.seed, "head");
  board_.put_head({-random.uniform(0.1, 0.9) * options_.travel_x_mm, -random.uniform(0.1, 0.9) * options_.travel_y_mm});
  board_.power_on(clock_.now());
  flush_now_and_then();
}

BoardPort::~BoardPort() {
  std::error_code ignored;
  std::filesystem::remove(options_.path, ignored);
}

Status BoardPort::open() {
  std::error_code ignored;
  std::filesystem::remove(options_.path, ignored);  // of a twin that was killed
  try {
    acceptor_.open();
    acceptor_.bind(Protocol::endpoint(options_.path.string()));
    acceptor_.listen();
  } catch (const boost::system::system_error& error) {
    return Error{ErrorCode::kStorage, fmt::format("the simulated laser gets no socket at {}: {}",
                                                  options_.path.string(), error.code().message())};
  }
  accept();
  pump();
  return Ok();
}

void BoardPort::accept() {
  acceptor_.async_accept(visitor_, [this](error_code failed) {
    if (failed) return;
    char nothing = 0;
    // Whoever had it may be gone without our having heard.
    if (client_.is_open() && ::recv(client_.native_handle(), &nothing, 1, MSG_PEEK | MSG_DONTWAIT) == 0) hang_up();
    error_code ignored;
    if (client_.is_open() || !board_.plugged()) {
      visitor_.close(ignored);  // taken, or not there
    } else {
      client_ = std::move(visitor_);
      visitor_ = Protocol::socket(acceptor_.get_executor());
      host_.reopen();
      log_->debug("{} was opened", options_.path.string());
      receive();
    }
    accept();
  });
}

void BoardPort::receive() {
  asio::async_read_until(client_, asio::dynamic_buffer(incoming_), '\n', [this](error_code failed, std::size_t size) {
    if (failed == asio::error::operation_aborted || !client_.is_open()) return;
    const std::string line = incoming_.substr(0, size);
    incoming_.erase(0, size);
    if (failed || !take(line)) return hang_up();
    pump();
    if (client_.is_open()) receive();
  });
}

bool BoardPort::take(const std::string& line) {
  std::istringstream words(line);
  std::string what, hex;
  HostTransfer transfer;
  unsigned endpoint = 0;
  words >> what;
  const bool urgent = what == "urgent";
  if (!urgent) {
    Duration::rep timeout = 0;
    words >> transfer.id >> timeout;
    transfer.timeout = Duration(timeout);
  }
  if (what == "setup") {
    unsigned type = 0, request = 0, value = 0, index = 0;
    words >> type >> request >> value >> index;
    transfer.what = HostSetup{static_cast<std::uint8_t>(type), static_cast<std::uint8_t>(request),
                              static_cast<std::uint16_t>(value), static_cast<std::uint16_t>(index)};
  } else if (what == "read") {
    std::size_t most = 0;
    words >> endpoint >> most;
    transfer.what = HostRead{static_cast<std::uint8_t>(endpoint), most};
  } else if (what == "write" || urgent) {
    words >> endpoint >> hex;
    const auto bytes = bytes_of(hex);
    if (!bytes) return false;
    transfer.what = HostWrite{static_cast<std::uint8_t>(endpoint), *bytes};
  } else {
    return false;
  }
  if (!words) return false;
  host_.advance_to(clock_.now());
  if (urgent) {
    host_.cancel_all();
    transfer.timeout = std::chrono::seconds(2);
  }
  host_.submit(std::move(transfer), clock_.now());
  return true;
}

void BoardPort::hang_up() {
  error_code ignored;
  client_.close(ignored);
  incoming_.clear();
  host_.cancel_all();
  static_cast<void>(host_.take_replies());
  log_->debug("{} was closed", options_.path.string());
}

void BoardPort::pump() {
  const TimePoint now = clock_.now();
  host_.advance_to(now);
  signal_at_burn_.look(board_.beam_on(), board_.log().burnt_mm);
  for (const HostReply& reply : host_.take_replies()) {
    if (reply.id == 0 || !client_.is_open()) continue;
    const std::string words = reply.end == HostReply::End::kDone
                                  ? fmt::format("done {} {}\n", reply.id, hex_of(reply.bytes))
                              : reply.end == HostReply::End::kTimedOut ? fmt::format("late {}\n", reply.id)
                                                                       : fmt::format("error {}\n", reply.id);
    error_code ignored;  // nobody reads any more, which receive() finds out
    asio::write(client_, asio::buffer(words), ignored);
  }
  if (client_.is_open() && host_.gone()) {
    log_->info("the laser's plug came out");
    hang_up();
  }
  const std::optional<TimePoint> next = host_.next_event_time();
  if (!next) {
    wake_.cancel();
    return;
  }
  wake_.expires_after(std::max<std::chrono::nanoseconds>(clock_.real_delay(*next - now), kShortestWait));
  wake_.async_wait([this](error_code failed) {
    if (!failed) pump();
  });
}

void BoardPort::flush_now_and_then() {
  flush_.expires_after(kFlushEvery);
  flush_.async_wait([this](error_code failed) {
    if (failed) return;
    // A stroke under way is left whole.
    if (!board_.beam_on()) world_.flush_burns();
    flush_now_and_then();
  });
}

void BoardPort::set_lid(bool open) {
  lid_open_ = open;
  host_.advance_to(clock_.now());
  board_.set_lid(open, clock_.now());
  pump();
}

void BoardPort::set_power(bool on) {
  if (on == std::exchange(power_, on)) return;
  host_.advance_to(clock_.now());
  if (on)
    board_.power_on(clock_.now());
  else
    board_.power_off(clock_.now());
  pump();
}

void BoardPort::unplug() {
  host_.advance_to(clock_.now());
  board_.unplug();
  pump();
}

Status BoardPort::replug() {
  board_.plug();
  pump();
  return Ok();
}

Status BoardPort::inject(const FaultRequest& request) {
  const Result<BoardFaultKind> kind = board_fault_kind(request.name);
  if (!kind.ok()) return kind.error();
  BoardFault fault{*kind};
  if (request.after) fault.after = static_cast<std::uint64_t>(*request.after);
  if (request.value) fault.value = static_cast<int>(std::clamp(*request.value, 0.0, 1e6));
  board_.inject(fault);
  return Ok();
}

void BoardPort::set_consent(bool given) { board_.set_consent(given); }

nlohmann::json BoardPort::describe() const {
  const BoardLog& log = board_.log();
  return {{"port", options_.path.string()},
          {"state", board_.state()},
          {"lid", lid_open_ ? "open" : "closed"},
          {"power", power_},
          {"plugged", board_.plugged()},
          {"beam", board_.beam_on()},
          {"homed", board_.homed()},
          {"watchdog",
           {{"beam_on_s", log.beam_on_s},
            {"beam_at_rest_s", log.beam_at_rest_s},
            {"burnt_mm", log.burnt_mm},
            {"burnt_unhomed_mm", log.burnt_unhomed_mm},
            {"moved_without_consent_mm", log.moved_without_consent_mm},
            {"burnt_without_consent_mm", log.burnt_without_consent_mm},
            {"beam_while_lid_open_s", log.beam_while_lid_open_s},
            {"longest_queued_motion_s", log.longest_queued_motion_s},
            {"ground_mm", log.ground_mm},
            {"rejected_packets", log.rejected}}}};
}

}  // namespace veneer::sim
