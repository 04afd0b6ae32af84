#include "drivers/lihuiyu/lihuiyu_laser.h"

#include <boost/asio/post.hpp>

#include <algorithm>
#include <utility>

#include "drivers/lihuiyu/packet.h"

namespace veneer::lihuiyu {
namespace {

// A clock that stands still asks for timers of no length; the reactor must get round to other things in between.
constexpr Duration kShortestTimer = std::chrono::microseconds(200);

}  // namespace

LihuiyuLaser::LihuiyuLaser(std::unique_ptr<UsbTransport> transport, const Clock& clock, boost::asio::io_context& io,
                           Logger log, LihuiyuOptions options)
    : transport_(std::move(transport)),
      clock_(clock),
      io_(io),
      log_(std::move(log)),
      core_(options),
      timer_(io),
      alive_(std::make_shared<int>(0)) {}

LihuiyuLaser::~LihuiyuLaser() {
  alive_.reset();
  transport_->submit_urgent({kWriteEndpoint, reset_packet()});
  transport_->close();
}

void LihuiyuLaser::connect(OnEvent on_event) {
  on_event_ = std::move(on_event);
  transport_->close();
  const std::weak_ptr<int> alive = alive_;
  const Status opened = transport_->open(
      [this, alive](const UsbReply& reply) {
        if (alive.expired()) return;
        core_.replied(reply, clock_.now());
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

void LihuiyuLaser::home() {
  core_.home(clock_.now());
  pump();
}

void LihuiyuLaser::start(LaserJob job) {
  core_.start(std::move(job), clock_.now());
  pump();
}

void LihuiyuLaser::hold() {
  core_.hold(clock_.now());
  pump();
}

void LihuiyuLaser::resume() {
  core_.resume(clock_.now());
  pump();
}

void LihuiyuLaser::stop_after_piece() {
  core_.stop_after_piece();
  pump();
}

void LihuiyuLaser::abort() noexcept {
  transport_->submit_urgent({kWriteEndpoint, reset_packet()});
  core_.abort(clock_.now());
  core_.discard_urgent();  // it is out already
  pump();
}

LaserStatus LihuiyuLaser::status() const { return core_.status(); }

void LihuiyuLaser::pump() {
  flush_output();
  arm_timer();
  deliver_later();
}

void LihuiyuLaser::flush_output() {
  LihuiyuOutput output = core_.take_output();
  if (!output.urgent.empty()) transport_->submit_urgent({kWriteEndpoint, std::move(output.urgent)});
  for (UsbRequest& request : output.requests) transport_->submit(std::move(request));
  if (output.close) transport_->close();
}

void LihuiyuLaser::arm_timer() {
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
void LihuiyuLaser::deliver_later() {
  for (LaserEvent& event : core_.take_events()) {
    boost::asio::post(io_, [this, alive = std::weak_ptr<int>(alive_), told = std::move(event)] {
      if (!alive.expired() && on_event_) on_event_(told);
    });
  }
}

}  // namespace veneer::lihuiyu
