// Brings packets to the board, one after the other, and keeps an eye on its lines. A state machine without I/O:
// (replies, time) in, (requests, an outcome) out, one transfer at a time.
//
// The protocol has no sequence numbers. So:
//  - A packet is written once the board takes packets, and again only when the board itself says that it was garbled.
//    A write that times out may have arrived or not: that is the end, never a second try.
//  - After a write the first status may be an old one that was still on its way; the second one counts.
//  - Whenever an answer is late, what is still to come is thrown away before the next question.
//  - A status counts only if it looks like all others of this chip.
// Every wait is bounded.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "drivers/lihuiyu/lihuiyu_options.h"
#include "drivers/lihuiyu/packet.h"
#include "drivers/usb_transport.h"

namespace veneer::lihuiyu {

class PacketLink {
 public:
  explicit PacketLink(const LihuiyuOptions& options) : options_(options) {}

  // A link just opened, or one whose transfers were all given up. The chip's look is learnt anew with `forget`.
  void restart(TimePoint now, bool forget);
  // `last`: of a program, so that the board may be finished as soon as it has it. `anyhow`: without asking first
  // whether the board takes packets, for resets. Only when !sending().
  void send(std::string packet, bool last, bool anyhow, TimePoint now);
  bool sending() const { return sending_ != Sending::kNothing; }
  // Late answers of before must not speak for what comes now.
  void drain() { drain_ = true; }
  void poll_every(Duration period, TimePoint now);

  void replied(const UsbReply& reply, TimePoint now);
  void tick(TimePoint now);
  TimePoint next_deadline() const;

  std::vector<UsbRequest> take_requests();
  // Said once each.
  bool take_accepted();
  std::optional<Error> take_failure();
  std::optional<BoardState> take_state();  // of the last status that counts

  // Two equal looks in a row: there is a board.
  bool knows_board() const { return look_.has_value(); }

 private:
  enum class Transfer { kNone, kAsk, kRead, kDrain, kPacket };
  enum class Sending { kNothing, kAwaitReady, kWriting, kConfirming };

  void go_on(TimePoint now);
  void submit(Transfer transfer);
  void on_status_bytes(const std::string& bytes, TimePoint now);
  void on_state(BoardState state, TimePoint now);
  void confirm(BoardState state, TimePoint now);
  void await_ready(BoardState state, TimePoint now);
  bool silent(TimePoint now) const;
  void fail(Error error);

  LihuiyuOptions options_;
  Transfer transfer_ = Transfer::kNone;
  Sending sending_ = Sending::kNothing;
  std::vector<UsbRequest> requests_;
  std::string packet_;
  bool last_ = false, anyhow_ = false, drain_ = false, ready_ = false;
  int rejects_ = 0, statuses_since_write_ = 0;
  TimePoint next_poll_, heard_at_;
  TimePoint waiting_since_;  // for the board to take, or to confirm, the packet
  Duration period_{};
  std::optional<std::string> look_, candidate_;
  bool accepted_ = false;
  std::optional<Error> failure_;
  std::optional<BoardState> state_;
};

}  // namespace veneer::lihuiyu
