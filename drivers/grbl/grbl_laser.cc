#include "drivers/grbl/grbl_laser.h"

#include <boost/asio/post.hpp>

#include <algorithm>
#include <utility>

namespace veneer::grbl {
namespace {

constexpr std::string_view kSoftReset = "\x18";
// A clock that stands still asks for timers of no length; the reactor must get round to other things in between.
constexpr Duration kShortestTimer = std::chrono::microseconds(200);

}  // namespace

GrblLaser::GrblLaser(std::unique_ptr<Transport> transport, const Clock& clock, boost::asio::io_context& io, Logger log,
                     GrblOptions options)
    : transport_(std::move(transport)),
      clock_(clock),
      io_(io),
      log_(std::move(log)),
      core_(options),
      timer_(io),
      alive_(std::make_shared<int>(0)) {}

GrblLaser::~GrblLaser() {
  alive_.reset();
  transport_->write_urgent(kSoftReset);
  transport_->close();
}

void GrblLaser::connect(OnEvent on_event) {
  on_event_ = std::move(on_event);
  transport_->close();
  const std::weak_ptr<int> alive = alive_;
  const Status opened = transport_->open(
      [this, alive](std::string_view bytes) {
        if (alive.expired()) return;
        core_.receive(bytes, clock_.now());
        pump();
      },
      [this, alive](const Error& error) {
        if (alive.expired()) return;
        log_->warn("laser link: {}", error.message);
        core_.link_lost(error, clock_.now());
        pump();
      });
  if (!opened.ok()) {
    boost::asio::post(io_, [this, alive, error = opened.error()] {
      if (!alive.expired() && on_event_) on_event_(laser_event::Failed{error});
    });
    return;
  }
  core_.connect(clock_.now());
  pump();
}

void GrblLaser::home() {
  core_.home(clock_.now());
  pump();
}

void GrblLaser::start(LaserJob job) {
  core_.start(std::move(job), clock_.now());
  pump();
}

void GrblLaser::hold() {
  core_.hold(clock_.now());
  pump();
}

void GrblLaser::resume() {
  core_.resume(clock_.now());
  pump();
}

void GrblLaser::stop_after_piece() {
  core_.stop_after_piece();
  pump();
}

void GrblLaser::abort() noexcept {
  transport_->write_urgent(kSoftReset);
  core_.abort(clock_.now());
  // The byte is out already; a second one would only lengthen the controller's restart.
  core_.discard_urgent();
  pump();
}

LaserStatus GrblLaser::status() const { return core_.status(); }

Status GrblLaser::check(LaserJob job) {
  const Status taken = core_.check(std::move(job), clock_.now());
  pump();
  return taken;
}

Status GrblLaser::jog(Millimetres dx, Millimetres dy, MmPerSecond speed) {
  const Status taken = core_.jog(dx, dy, speed, clock_.now());
  pump();
  return taken;
}

void GrblLaser::stop_jog() {
  core_.stop_jog(clock_.now());
  pump();
}

Status GrblLaser::set_overrides(const LaserOverrides& overrides) {
  const Status taken = core_.set_overrides(overrides, clock_.now());
  pump();
  return taken;
}

void GrblLaser::pump() {
  flush_output();
  arm_timer();
  deliver_later();
}

void GrblLaser::flush_output() {
  const GrblOutput output = core_.take_output();
  if (!output.urgent.empty()) transport_->write_urgent(output.urgent);
  if (!output.bytes.empty()) transport_->write(output.bytes);
  if (output.close) transport_->close();
}

void GrblLaser::arm_timer() {
  const TimePoint next = core_.next_deadline();
  if (next == TimePoint::max()) {
    timer_.cancel();
    return;
  }
  const Duration wait = std::max(kShortestTimer, clock_.real_delay(next - clock_.now()));
  timer_.expires_after(std::chrono::duration_cast<boost::asio::steady_timer::duration>(wait));
  timer_.async_wait([this, alive = std::weak_ptr<int>(alive_)](const boost::system::error_code& error) {
    if (error || alive.expired()) return;
    core_.tick(clock_.now());
    pump();
  });
}

// Events are told from the reactor's own turn, never from inside a call of the one who listens.
void GrblLaser::deliver_later() {
  for (LaserEvent& event : core_.take_events()) {
    boost::asio::post(io_, [this, alive = std::weak_ptr<int>(alive_), told = std::move(event)] {
      if (!alive.expired() && on_event_) on_event_(told);
    });
  }
}

}  // namespace veneer::grbl
