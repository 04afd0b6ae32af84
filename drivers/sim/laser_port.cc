#include "drivers/sim/laser_port.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/inotify.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/write.hpp>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

#include "drivers/sim/port_times.h"
#include "drivers/sim/random.h"
#include "drivers/sim/world.h"

namespace veneer::sim {

namespace asio = boost::asio;
namespace fs = std::filesystem;
using boost::system::error_code;

namespace {

constexpr std::size_t kMostPending = 1 << 16;

GrblOptions options_of(const LaserPortOptions& options) {
  GrblOptions out;
  out.boot_time = std::chrono::duration_cast<Duration>(std::chrono::duration<double>(options.boot_seconds));
  return out;
}

}  // namespace

LaserPort::LaserPort(asio::io_context& io, const Clock& clock, World& world, LaserPortOptions options, Logger log)
    : clock_(clock),
      world_(world),
      options_(std::move(options)),
      log_(std::move(log)),
      controller_(GrblSettings::laser_cutter(options_.travel_x_mm, options_.travel_y_mm), options_of(options_),
                  options_.seed, &world),
      master_(io),
      openers_(io),
      wake_(io),
      flush_(io) {
  Random random(options_.seed, "head");
  controller_.put_head(
      {-random.uniform(0.1, 0.9) * options_.travel_x_mm, -random.uniform(0.1, 0.9) * options_.travel_y_mm});
  controller_.power_on(clock_.now());
  flush_now_and_then();
}

LaserPort::~LaserPort() {
  close_port();
  std::error_code ignored;
  fs::remove(options_.link, ignored);
}

Status LaserPort::open() {
  const int fd = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK);
  std::array<char, 128> name{};
  if (fd < 0 || ::grantpt(fd) != 0 || ::unlockpt(fd) != 0 || ::ptsname_r(fd, name.data(), name.size()) != 0) {
    const int reason = errno;
    if (fd >= 0) ::close(fd);
    return Error{ErrorCode::kUnavailable,
                 fmt::format("the simulated laser gets no pseudo-terminal (errno {})", reason)};
  }
  port_ = name.data();
  master_.assign(fd);
  if (Status watched = watch_openers(); !watched.ok()) return watched;
  std::error_code failed;
  const fs::path fresh = options_.link.string() + ".new";
  fs::remove(fresh, failed);
  fs::create_symlink(port_, fresh, failed);
  if (!failed) fs::rename(fresh, options_.link, failed);
  if (failed) {
    return Error{ErrorCode::kStorage,
                 fmt::format("cannot link {} to {}: {}", options_.link.string(), port_, failed.message())};
  }
  return Ok();
}

void LaserPort::close_port() {
  openers_count_ = 0;
  pending_.clear();
  error_code ignored;
  if (openers_.is_open()) openers_.close(ignored);
  if (master_.is_open()) master_.close(ignored);
}

Status LaserPort::watch_openers() {
  const int fd = ::inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
  if (fd < 0 || ::inotify_add_watch(fd, port_.c_str(), IN_OPEN | IN_CLOSE) < 0) {
    const int reason = errno;
    if (fd >= 0) ::close(fd);
    return Error{ErrorCode::kUnavailable, fmt::format("the twin cannot watch {} (errno {})", port_, reason)};
  }
  openers_count_ = 0;
  openers_.assign(fd);
  wait_for_openers();
  return Ok();
}

void LaserPort::wait_for_openers() {
  openers_.async_wait(asio::posix::stream_descriptor::wait_read, [this](error_code failed) {
    if (failed || !openers_.is_open()) return;
    count_openers();
    wait_for_openers();
  });
}

// Takes note of who opened and closed the other end since the last call. Called before bytes are taken, so that those
// of a new opener come after the reset its opening caused.
void LaserPort::count_openers() {
  alignas(inotify_event) std::array<char, 4096> events{};
  for (;;) {
    const ssize_t length = openers_.is_open() ? ::read(openers_.native_handle(), events.data(), events.size()) : 0;
    if (length <= 0) return;
    for (std::size_t at = 0; at < static_cast<std::size_t>(length);) {
      inotify_event event{};
      std::memcpy(&event, events.data() + at, sizeof(event));
      at += sizeof(event) + event.len;
      if ((event.mask & IN_OPEN) != 0 && ++openers_count_ == 1) attached();
      if ((event.mask & IN_CLOSE) != 0 && openers_count_ > 0 && --openers_count_ == 0) {
        log_->debug("{} was closed", port_);
        pending_.clear();
      }
    }
  }
}

void LaserPort::attached() {
  // Set through the master, before the first byte goes out: an echo would come back as commands.
  termios mode{};
  if (::tcgetattr(master_.native_handle(), &mode) == 0) {
    ::cfmakeraw(&mode);
    ::tcsetattr(master_.native_handle(), TCSANOW, &mode);
  }
  log_->debug("{} was opened", port_);
  // What it said while nobody listened is lost.
  controller_.advance_to(clock_.now());
  static_cast<void>(controller_.take_output());
  if (power_ && options_.reset_on_open) controller_.power_on(clock_.now());
  pump();
  read();
}

void LaserPort::read() {
  if (reading_ || !master_.is_open()) return;
  reading_ = true;
  master_.async_read_some(asio::buffer(chunk_), [this](error_code failed, std::size_t count) {
    reading_ = false;
    if (failed == asio::error::operation_aborted || !master_.is_open()) return;
    count_openers();
    // An error means that nobody has the other end open; the controller goes on with what it has.
    if (failed && openers_count_ == 0) return;
    controller_.receive(std::string_view(chunk_.data(), count), clock_.now());
    pump();
    read();
  });
}

void LaserPort::pump() {
  const TimePoint now = clock_.now();
  controller_.advance_to(now);
  signal_at_burn_.look(controller_.beam_on(), controller_.beam_log().burnt_mm);
  const std::string said = controller_.take_output();
  if (openers_count_ > 0 && pending_.size() < kMostPending) pending_ += said;
  write();
  if (!controller_.link_up() && master_.is_open()) {
    log_->info("the laser's plug came out");
    close_port();
    std::error_code ignored;
    fs::remove(options_.link, ignored);
  }
  const std::optional<TimePoint> next = controller_.next_event_time();
  if (!next) {
    wake_.cancel();
    return;
  }
  const Duration wait = clock_.real_delay(*next - now);
  wake_.expires_after(std::max<std::chrono::nanoseconds>(wait, kShortestWait));
  wake_.async_wait([this](error_code failed) {
    if (!failed) pump();
  });
}

void LaserPort::write() {
  if (writing_ || pending_.empty() || openers_count_ == 0 || !master_.is_open()) return;
  writing_ = true;
  const auto bytes = std::make_shared<std::string>(std::move(pending_));
  pending_.clear();
  asio::async_write(master_, asio::buffer(*bytes), [this, bytes](error_code, std::size_t) {
    // A failure means that nobody reads any more, which read() finds out.
    writing_ = false;
    write();
  });
}

void LaserPort::flush_now_and_then() {
  flush_.expires_after(kFlushEvery);
  flush_.async_wait([this](error_code failed) {
    if (failed) return;
    // A stroke under way is left whole.
    if (!controller_.beam_on()) world_.flush_burns();
    flush_now_and_then();
  });
}

void LaserPort::set_lid(bool open) {
  lid_open_ = open;
  controller_.set_lid(open, clock_.now());
  pump();
}

void LaserPort::set_power(bool on) {
  if (on == power_) return;
  power_ = on;
  if (on) {
    controller_.power_on(clock_.now());
    controller_.set_lid(lid_open_, clock_.now());
  } else {
    controller_.power_off(clock_.now());
  }
  pump();
}

void LaserPort::unplug() {
  controller_.unplug(clock_.now());
  pump();
}

Status LaserPort::replug() {
  controller_.plug();
  if (master_.is_open()) return Ok();
  return open();
}

Status LaserPort::inject(const FaultRequest& request) {
  const Result<FaultKind> kind = fault_kind(request.name);
  if (!kind.ok()) return kind.error();
  // What a fault waits for is its `after`; the short form gives it as the value where a fault has no value of its own.
  const bool has_value = *kind == FaultKind::kError || *kind == FaultKind::kAlarm || *kind == FaultKind::kSlip;
  Fault fault{*kind, 1, 0};
  const double after = request.after.value_or(has_value ? 1 : request.value.value_or(1));
  if (!(after >= 1 && after <= 1e12))
    return Error{ErrorCode::kInvalidArgument, fmt::format("fault {} happens after 1 or more", request.name)};
  fault.after = static_cast<std::uint64_t>(after);
  if (has_value && request.value) fault.value = static_cast<int>(std::clamp(*request.value, -1e6, 1e6));
  controller_.inject(fault);
  return Ok();
}

void LaserPort::set_consent(bool given) { controller_.set_consent(given); }

nlohmann::json LaserPort::describe() const {
  const BeamLog& log = controller_.beam_log();
  return {{"port", options_.link.string()},
          {"state", controller_.state()},
          {"lid", lid_open_ ? "open" : "closed"},
          {"power", power_},
          {"plugged", master_.is_open()},
          {"beam", controller_.beam_on()},
          {"homed", controller_.homed()},
          {"watchdog",
           {{"beam_on_s", log.beam_on_s},
            {"beam_at_rest_s", log.beam_at_rest_s},
            {"burnt_mm", log.burnt_mm},
            {"burnt_unhomed_mm", log.burnt_unhomed_mm},
            {"moved_without_consent_mm", log.moved_without_consent_mm},
            {"burnt_without_consent_mm", log.burnt_without_consent_mm},
            {"beam_while_lid_open_s", log.beam_while_lid_open_s},
            {"longest_queued_motion_s", log.longest_queued_motion_s},
            {"lost_bytes", log.lost_bytes}}}};
}

}  // namespace veneer::sim
