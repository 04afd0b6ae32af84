#include "guardian/darken.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cctype>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "drivers/lihuiyu/packet.h"
#include "drivers/sim/client/sim_usb.h"
#include "drivers/transport/make_transport.h"
#include "drivers/transport/make_usb_transport.h"

namespace veneer::guardian {
namespace {

using std::chrono::milliseconds;

constexpr std::string_view kTwin = "twin:";

// Runs the loop until the outcome is there or the patience at an end.
Status await(boost::asio::io_context& loop, const std::optional<Status>& outcome, milliseconds patience) {
  const auto end = std::chrono::steady_clock::now() + patience;
  // A USB port's transfers are no work of the loop's until they are over.
  const auto stay = boost::asio::make_work_guard(loop);
  while (!outcome && loop.run_one_until(end) > 0) {
  }
  if (outcome) return *outcome;
  return Error{ErrorCode::kTimeout, "the reset was sent, but the machine does not answer: check its supply"};
}

// ---- GRBL: the byte 0x18 kills beam and steppers; the banner says that it did.

constexpr milliseconds kResetAgain{1200};  // for a board that was in its bootloader

Status darken_grbl(const std::string& port, milliseconds patience) {
  boost::asio::io_context loop;
  auto link = make_transport(port, loop);
  if (!link) return link.error();
  std::optional<Status> outcome;
  std::string heard;
  const auto on_bytes = [&](std::string_view bytes) {
    for (const char c : bytes) heard += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (heard.find("grbl") != std::string::npos) outcome = Ok();
  };
  const auto on_closed = [&](Error why) { outcome = std::move(why); };
  if (Status opened = (*link)->open(on_bytes, on_closed); !opened) return opened;
  boost::asio::steady_timer again(loop);
  const std::function<void()> reset = [&] {
    (*link)->write("\x18");
    again.expires_after(kResetAgain);
    again.async_wait([&](const boost::system::error_code& cancelled) {
      if (!cancelled) reset();
    });
  };
  reset();
  Status dark = await(loop, outcome, patience);
  (*link)->close();
  return dark;
}

// ---- Lihuiyu: the reset packet, until the board no longer calls it garbled.

constexpr int kMostPackets = 10;
constexpr int kMostQuestions = 10;
constexpr std::size_t kReadBytes = 32;

class BoardReset {
 public:
  BoardReset(std::unique_ptr<UsbTransport> link, Duration timeout) : link_(std::move(link)), timeout_(timeout) {}

  Status run(boost::asio::io_context& loop, milliseconds patience) {
    if (Status opened = link_->open([this](const UsbReply& reply) { replied(reply); },
                                    [this](Error why) { outcome_ = std::move(why); });
        !opened)
      return opened;
    link_->submit({lihuiyu::epp_setup(), timeout_});
    Status dark = await(loop, outcome_, patience);
    link_->close();
    return dark;
  }

 private:
  enum class Step { kSetup, kPacket, kAsk, kRead };

  void replied(const UsbReply& reply) {
    switch (step_) {
      case Step::kSetup:
        return send();
      case Step::kPacket:
        if (!reply.done) return send();
        statuses_ = questions_ = 0;
        return ask();
      case Step::kAsk:
        step_ = Step::kRead;
        return link_->submit({UsbRead{lihuiyu::kReadEndpoint, kReadBytes}, timeout_});
      case Step::kRead:
        return judge(reply);
    }
  }
  void send() {
    if (++packets_ > kMostPackets) {
      outcome_ = Error{ErrorCode::kTimeout, "the laser board takes no reset: check its supply and the USB cable"};
      return;
    }
    step_ = Step::kPacket;
    link_->submit({UsbWrite{lihuiyu::kWriteEndpoint, lihuiyu::reset_packet()}, timeout_});
  }
  void ask() {
    if (++questions_ > kMostQuestions) return send();
    step_ = Step::kAsk;
    link_->submit({UsbWrite{lihuiyu::kWriteEndpoint, std::string(lihuiyu::kAskStatus)}, timeout_});
  }
  // The first status after a packet may be one of before.
  void judge(const UsbReply& reply) {
    const auto status = reply.done ? lihuiyu::parse_status(reply.bytes) : std::nullopt;
    if (!status || ++statuses_ < 2) return ask();
    if (status->state == lihuiyu::BoardState::kRejected) return send();
    outcome_ = Ok();
  }

  std::unique_ptr<UsbTransport> link_;
  Duration timeout_;
  Step step_ = Step::kSetup;
  int packets_ = 0, questions_ = 0, statuses_ = 0;
  std::optional<Status> outcome_;
};

Status darken_lihuiyu(const std::string& port, milliseconds patience) {
  boost::asio::io_context loop;
  const bool in_twin = port.starts_with(kTwin);
  auto link =
      in_twin ? Result<std::unique_ptr<UsbTransport>>(std::make_unique<sim::SimUsb>(loop, port.substr(kTwin.size())))
              : make_usb_transport(port, loop);
  if (!link) return link.error();
  // The twin counts device time, which may run a thousand times as fast.
  const Duration timeout = in_twin ? Duration(std::chrono::minutes(5)) : Duration(milliseconds(200));
  return BoardReset(std::move(*link), timeout).run(loop, patience);
}

}  // namespace

Status darken(const GuardedMachine& machine, milliseconds patience) {
  if (machine.port.starts_with("file:")) return Ok();
  return machine.family == "grbl" ? darken_grbl(machine.port, patience) : darken_lihuiyu(machine.port, patience);
}

}  // namespace veneer::guardian
