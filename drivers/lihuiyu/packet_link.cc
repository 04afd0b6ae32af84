#include "drivers/lihuiyu/packet_link.h"

#include <algorithm>
#include <utility>

namespace veneer::lihuiyu {
namespace {

constexpr std::size_t kReadBytes = 32;  // one USB packet

}  // namespace

void PacketLink::restart(TimePoint now, bool forget) {
  transfer_ = Transfer::kNone;
  sending_ = Sending::kNothing;
  requests_.clear();
  drain_ = true;
  ready_ = accepted_ = false;
  failure_.reset();
  state_.reset();
  if (forget) look_.reset();
  candidate_.reset();
  heard_at_ = next_poll_ = now;
}

void PacketLink::send(std::string packet, bool last, bool anyhow, TimePoint now) {
  packet_ = std::move(packet);
  last_ = last;
  anyhow_ = anyhow;
  rejects_ = 0;
  sending_ = Sending::kAwaitReady;
  waiting_since_ = heard_at_ = next_poll_ = now;
  go_on(now);
}

void PacketLink::poll_every(Duration period, TimePoint now) {
  period_ = period;
  next_poll_ = std::min(next_poll_, now + period);
}

void PacketLink::go_on(TimePoint now) {
  if (transfer_ != Transfer::kNone || failure_) return;
  if (drain_) return submit(Transfer::kDrain);
  if (sending_ == Sending::kAwaitReady && (ready_ || anyhow_)) {
    ready_ = false;
    sending_ = Sending::kWriting;
    return submit(Transfer::kPacket);
  }
  if (now >= next_poll_) submit(Transfer::kAsk);
}

void PacketLink::submit(Transfer transfer) {
  transfer_ = transfer;
  UsbRequest request;
  switch (transfer) {
    case Transfer::kNone:
      return;
    case Transfer::kAsk:
      request = {UsbWrite{kWriteEndpoint, std::string(kAskStatus)}, options_.status_timeout};
      break;
    case Transfer::kRead:
      request = {UsbRead{kReadEndpoint, kReadBytes}, options_.status_timeout};
      break;
    case Transfer::kDrain:
      request = {UsbRead{kReadEndpoint, kReadBytes}, options_.drain_timeout};
      break;
    case Transfer::kPacket:
      request = {UsbWrite{kWriteEndpoint, packet_}, options_.write_timeout};
      break;
  }
  requests_.push_back(std::move(request));
}

void PacketLink::replied(const UsbReply& reply, TimePoint now) {
  switch (std::exchange(transfer_, Transfer::kNone)) {
    case Transfer::kNone:
      return;
    case Transfer::kAsk:
      if (reply.done) return submit(Transfer::kRead);
      drain_ = true;
      break;
    case Transfer::kRead:
      next_poll_ = now + (sending_ == Sending::kNothing ? period_ : options_.busy_poll_period);
      if (reply.done) {
        on_status_bytes(reply.bytes, now);
      } else {
        drain_ = true;
      }
      break;
    case Transfer::kDrain:
      drain_ = reply.done;
      break;
    case Transfer::kPacket:
      if (!reply.done)
        return fail(
            {ErrorCode::kDisconnected,
             "the laser board did not take a packet in time, or this computer was too loaded to see that it did, "
             "and nobody knows whether it has it: check the laser's supply and the USB cable, end other heavy "
             "programs, then Clear and Reset"});
      sending_ = Sending::kConfirming;
      statuses_since_write_ = 0;
      waiting_since_ = heard_at_ = next_poll_ = now;
      break;
  }
  tick(now);
}

void PacketLink::on_status_bytes(const std::string& bytes, TimePoint now) {
  const std::optional<BoardStatus> status = parse_status(bytes);
  if (!status) return;
  if (!look_) {
    if (candidate_ != status->rest) {
      candidate_ = status->rest;
      next_poll_ = now;
      return;
    }
    look_ = status->rest;
  }
  if (status->rest != *look_) return;
  heard_at_ = now;
  on_state(status->state, now);
}

void PacketLink::on_state(BoardState state, TimePoint now) {
  state_ = state;
  switch (sending_) {
    case Sending::kNothing:
    case Sending::kWriting:
      return;
    case Sending::kAwaitReady:
      return await_ready(state, now);
    case Sending::kConfirming:
      return confirm(state, now);
  }
}

void PacketLink::await_ready(BoardState state, TimePoint now) {
  if (state == BoardState::kNoPower)
    return fail({ErrorCode::kDeviceFault, "the laser board has no power: switch the laser's own supply on"});
  // Lines that tell of a packet or program before this one do not stand in the way.
  ready_ = state != BoardState::kBusy;
  if (!ready_) next_poll_ = now + options_.busy_poll_period;
}

void PacketLink::confirm(BoardState state, TimePoint now) {
  if (++statuses_since_write_ < 2) {
    next_poll_ = now;
    return;
  }
  switch (state) {
    case BoardState::kBusy:
      return;
    case BoardState::kNoPower:
      return fail({ErrorCode::kDeviceFault,
                   "the laser board lost its power: check the lid, the emergency stop and the laser's supply"});
    case BoardState::kRejected:
      if (++rejects_ > options_.rejects)
        return fail({ErrorCode::kDeviceFault,
                     "the laser board finds every packet garbled: check the USB cable and its shield"});
      sending_ = Sending::kWriting;
      return submit(Transfer::kPacket);
    case BoardState::kFinished:
      if (!last_) return;  // of the program before
      break;
    case BoardState::kReady:
      ready_ = true;
      break;
  }
  sending_ = Sending::kNothing;
  accepted_ = true;
}

void PacketLink::tick(TimePoint now) {
  if (failure_) return;
  if (silent(now))
    return fail(
        {ErrorCode::kDisconnected,
         "the laser board stopped answering, or this computer was too loaded to hear it: check the laser's supply "
         "and the USB cable, end other heavy programs, then Clear and Reset"});
  const bool waits = sending_ == Sending::kAwaitReady || sending_ == Sending::kConfirming;
  if (waits && now - waiting_since_ >= options_.busy_timeout)
    return fail({ErrorCode::kDeviceFault,
                 "the laser board takes no more packets, it has locked up: switch the laser off and on, then "
                 "Clear and Reset"});
  go_on(now);
}

// While the first look is learnt, whoever connects sets the limit.
bool PacketLink::silent(TimePoint now) const {
  return look_ && sending_ != Sending::kWriting && now - heard_at_ >= options_.silence_timeout;
}

TimePoint PacketLink::next_deadline() const {
  if (failure_) return TimePoint::max();
  TimePoint next = transfer_ == Transfer::kNone ? next_poll_ : TimePoint::max();
  if (look_ && sending_ != Sending::kWriting) next = std::min(next, heard_at_ + options_.silence_timeout);
  if (sending_ == Sending::kAwaitReady || sending_ == Sending::kConfirming)
    next = std::min(next, waiting_since_ + options_.busy_timeout);
  return next;
}

void PacketLink::fail(Error error) {
  sending_ = Sending::kNothing;
  failure_ = std::move(error);
}

std::vector<UsbRequest> PacketLink::take_requests() { return std::exchange(requests_, {}); }

bool PacketLink::take_accepted() { return std::exchange(accepted_, false); }

std::optional<Error> PacketLink::take_failure() {
  // It stays at rest until restarted; the sentence is given once.
  return std::exchange(failure_, std::nullopt);
}

std::optional<BoardState> PacketLink::take_state() { return std::exchange(state_, std::nullopt); }

}  // namespace veneer::lihuiyu
