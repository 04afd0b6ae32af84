#include "drivers/grbl/grbl_laser.h"

#include <utility>

namespace veneer::grbl {

GrblLaser::GrblLaser(std::unique_ptr<Transport> transport, const Clock& clock, boost::asio::io_context& io, Logger log,
                     GrblOptions options)
    : ReactorLaser(clock, io, std::move(log), options), transport_(std::move(transport)) {}

GrblLaser::~GrblLaser() {
  stop_listening();
  send_reset();
  transport_->close();
}

Status GrblLaser::open_link() {
  transport_->close();
  return transport_->open(heard([this](std::string_view bytes) { core_.receive(bytes, clock_.now()); }), lost());
}

void GrblLaser::send_reset() noexcept { transport_->write_urgent("\x18"); }

void GrblLaser::flush_output() {
  const GrblOutput output = core_.take_output();
  if (!output.urgent.empty()) transport_->write_urgent(output.urgent);
  if (!output.bytes.empty()) transport_->write(output.bytes);
  if (output.close) transport_->close();
}

Status GrblLaser::check(const LaserJob& job) {
  Status taken = core_.check(job, clock_.now());
  pump();
  return taken;
}

Status GrblLaser::jog(Millimetres dx, Millimetres dy, MmPerSecond speed) {
  Status taken = core_.jog(dx, dy, speed, clock_.now());
  pump();
  return taken;
}

void GrblLaser::stop_jog() {
  core_.stop_jog(clock_.now());
  pump();
}

Status GrblLaser::set_overrides(const LaserOverrides& overrides) {
  Status taken = core_.set_overrides(overrides, clock_.now());
  pump();
  return taken;
}

Status GrblLaser::corner_is_here() {
  Status taken = core_.corner_is_here(clock_.now());
  pump();
  return taken;
}

}  // namespace veneer::grbl
