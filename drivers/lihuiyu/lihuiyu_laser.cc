#include "drivers/lihuiyu/lihuiyu_laser.h"

#include <utility>

#include "drivers/lihuiyu/packet.h"

namespace veneer::lihuiyu {

LihuiyuLaser::LihuiyuLaser(std::unique_ptr<UsbTransport> transport, const Clock& clock, boost::asio::io_context& io,
                           Logger log, LihuiyuOptions options)
    : ReactorLaser(clock, io, std::move(log), options), transport_(std::move(transport)), reset_(reset_packet()) {}

LihuiyuLaser::~LihuiyuLaser() {
  stop_listening();
  send_reset();
  transport_->close();
}

Status LihuiyuLaser::open_link() {
  transport_->close();
  return transport_->open(heard([this](const UsbReply& reply) { core_.replied(reply, clock_.now()); }), lost());
}

void LihuiyuLaser::send_reset() noexcept { transport_->submit_urgent(kWriteEndpoint, reset_); }

void LihuiyuLaser::flush_output() {
  LihuiyuOutput output = core_.take_output();
  if (!output.urgent.empty()) transport_->submit_urgent(kWriteEndpoint, output.urgent);
  for (UsbRequest& request : output.requests) transport_->submit(std::move(request));
  if (output.close) transport_->close();
}

}  // namespace veneer::lihuiyu
