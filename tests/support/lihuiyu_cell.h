// The Lihuiyu driver's core on the simulated machine, on one clock that stands still: transfers take their time on the
// bus, time passes from one event to the next.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "drivers/lihuiyu/lihuiyu_core.h"
#include "drivers/sim/lihuiyu_board/usb_host.h"

namespace veneer::tests {

class LihuiyuCell : private sim::BurnSink {
 public:
  explicit LihuiyuCell(const sim::BoardOptions& board_options = {}, const lihuiyu::LihuiyuOptions& options = {},
                       std::uint64_t seed = 7)
      : board(board_options, seed, this), host(board), core(options) {
    board.put_head({-200, -150});
    board.power_on(now());
    run_board(1);
  }

  void connect() {
    host.reopen();
    core.connect(now());
    exchange();
    run(6, [this] { return has<laser_event::Connected>() || has<laser_event::Failed>(); });
  }
  // NOLINTNEXTLINE(bugprone-virtual-near-miss): the host homes, the sink hears that it has
  void home() {
    core.home(now());
    exchange();
    run(120, [this] { return has<laser_event::Homed>() || has<laser_event::Failed>(); });
  }
  void connect_and_home() {
    connect();
    home();
  }
  void start(LaserJob job) {
    core.start(std::move(job), now());
    exchange();
  }
  bool over() const { return has<laser_event::Done>() || has<laser_event::Aborted>() || has<laser_event::Failed>(); }
  // Until the job is over, and a little longer: late answers must do no harm.
  void run_job(double most_s = 1200) {
    run(most_s, [this] { return over(); });
    run(5);
  }

  void run(double seconds, const std::function<bool()>& until = {}) {
    const TimePoint end = now() + Duration(static_cast<Duration::rep>(seconds * 1e9));
    while (now() < end && !(until && until())) {
      TimePoint next = std::min(end, core.next_deadline());
      if (const auto event = host.next_event_time()) next = std::min(next, *event);
      if (next > now()) clock.advance(next - now());
      host.advance_to(now());
      exchange();
      core.tick(now());
      exchange();
      if (on_step) on_step();
      if (next == end) return;
    }
  }

  TimePoint now() const { return clock.now(); }

  template <class Event>
  bool has() const {
    return first<Event>().has_value();
  }
  template <class Event>
  std::optional<Event> first() const {
    for (const LaserEvent& event : events)
      if (const auto* wanted = std::get_if<Event>(&event)) return *wanted;
    return std::nullopt;
  }
  template <class Event>
  std::vector<Event> all() const {
    std::vector<Event> found;
    for (const LaserEvent& event : events)
      if (const auto* wanted = std::get_if<Event>(&event)) found.push_back(*wanted);
    return found;
  }
  Error failure() const {
    if (const auto failed = first<laser_event::Failed>()) return failed->error;
    if (const auto aborted = first<laser_event::Aborted>()) return aborted->error;
    if (const auto fault = first<laser_event::Fault>()) return fault->error;
    return {ErrorCode::kInternal, "nothing failed"};
  }

  void exchange() {
    for (;;) {
      lihuiyu::LihuiyuOutput output = core.take_output();
      for (LaserEvent& event : core.take_events()) events.push_back(std::move(event));
      if (closed_ && (!output.requests.empty() || !output.urgent.empty())) output = {};
      if (!output.urgent.empty()) {
        host.cancel_all();
        submit({sim::HostWrite{lihuiyu::kWriteEndpoint, output.urgent}, std::chrono::seconds(2), 0});
        first_reply_ = next_id_;
      }
      for (const UsbRequest& request : output.requests) {
        sim::HostTransfer transfer{{}, request.timeout, next_id_++};
        if (const auto* setup = std::get_if<UsbSetup>(&request.what))
          transfer.what = sim::HostSetup{setup->request_type, setup->request, setup->value, setup->index};
        if (const auto* write = std::get_if<UsbWrite>(&request.what)) {
          transfer.what = sim::HostWrite{write->endpoint, write->bytes};
          if (write->bytes.size() > 1) written.push_back(write->bytes);
        }
        if (const auto* read = std::get_if<UsbRead>(&request.what))
          transfer.what = sim::HostRead{read->endpoint, read->most_bytes};
        submit(std::move(transfer));
      }
      if (output.close) closed_ = true;
      const std::vector<sim::HostReply> replies = host.take_replies();
      if (replies.empty()) break;
      for (const sim::HostReply& reply : replies) {
        if (reply.id < first_reply_) continue;
        if (reply.end == sim::HostReply::End::kError) {
          lose_link();
        } else {
          core.replied({reply.end == sim::HostReply::End::kDone, reply.bytes}, now());
        }
      }
    }
    if (!closed_ && host.gone()) lose_link();
    for (LaserEvent& event : core.take_events()) events.push_back(std::move(event));
  }

  // As a person does: the same device again after a lost link.
  void reconnect() {
    closed_ = false;
    events.clear();
    connect();
  }

  ManualClock clock;
  std::vector<sim::BurnSegment> burns;
  sim::LihuiyuBoard board;
  sim::UsbHost host;
  lihuiyu::LihuiyuCore core;
  std::vector<LaserEvent> events;
  std::vector<std::string> written;
  std::function<void()> on_step;

 private:
  void burn(const sim::BurnSegment& segment) override { burns.push_back(segment); }
  void submit(sim::HostTransfer transfer) { host.submit(std::move(transfer), now()); }
  void lose_link() {
    if (std::exchange(closed_, true)) return;
    host.cancel_all();
    core.link_lost({ErrorCode::kDisconnected, "the laser's USB link is gone"}, now());
    for (LaserEvent& event : core.take_events()) events.push_back(std::move(event));
  }
  void run_board(double seconds) {
    clock.advance(Duration(static_cast<Duration::rep>(seconds * 1e9)));
    host.advance_to(now());
  }

  std::uint64_t next_id_ = 1, first_reply_ = 0;
  bool closed_ = false;
};

// What the board burnt, in mils from its home corner.
inline std::vector<sim::BurnSegment> moving(const std::vector<sim::BurnSegment>& burns) {
  std::vector<sim::BurnSegment> out;
  for (const sim::BurnSegment& burn : burns)
    if (burn.length_mm() > 0) out.push_back(burn);
  return out;
}

}  // namespace veneer::tests
