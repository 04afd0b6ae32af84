#include "drivers/grbl/grbl_core.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

namespace veneer::grbl {
namespace {

template <class... Handlers>
struct Overloaded : Handlers... {
  using Handlers::operator()...;
};
template <class... Handlers>
Overloaded(Handlers...) -> Overloaded<Handlers...>;

}  // namespace

GrblOptions GrblOptions::for_time_scale(double scale) {
  GrblOptions options;
  if (!(scale > 1)) return options;
  for (Duration* limit :
       {&options.connect_timeout, &options.banner_wait, &options.settle_time, &options.poll_timeout,
        &options.silence_timeout, &options.lost_reply_timeout, &options.hold_timeout, &options.resume_timeout,
        &options.stop_timeout, &options.stall_timeout, &options.late_tolerance})
    *limit = Duration(std::llround(static_cast<double>(limit->count()) * scale));
  return options;
}

GrblCore::GrblCore(const GrblOptions& options) : machine_(options), phase_(closed(machine_, *this)) {}

void GrblCore::connect(TimePoint now) {
  at(now);
  reader_.clear();
  enter(connecting(machine_, *this));
}

Phase& GrblCore::at(TimePoint now) {
  machine_.now = now;
  over_.clear();
  return *phase_;
}

void GrblCore::enter(std::unique_ptr<Phase> next) {
  over_.push_back(std::exchange(phase_, std::move(next)));
  phase_->entered();
}

void GrblCore::tell(LaserEvent event) { events_.push_back(std::move(event)); }

void GrblCore::receive(std::string_view bytes, TimePoint now) {
  at(now);
  reader_.feed(bytes, [this](std::string_view line) {
    if (phase_->listens()) handle(parse_reply(line));
  });
  phase_->pump();
}

void GrblCore::handle(const Reply& reply) {
  const auto answer = [this](std::optional<int> error) {
    const auto line = machine_.answered();
    line.ok() ? phase_->answered(*line, error) : phase_->count_lost(line.error());
  };
  std::visit(Overloaded{
                 [&](const Acknowledged&) { answer(std::nullopt); },
                 [&](const Refused& refused) { answer(refused.number); },
                 [&](const AlarmRaised& alarm) { phase_->alarm(alarm.number); },
                 [&](const Banner& banner) {
                   machine_.forget_lines();
                   machine_.overrides = {};
                   phase_->banner(banner);
                 },
                 [&](const StatusReport& report) { phase_->reported(report, machine_.heard(report)); },
                 [&](const SettingLine& setting) { machine_.settings_reader.setting(setting); },
                 [&](const BuildOptions& build) { machine_.settings_reader.options(build); },
                 [&](const BuildVersion& version) { machine_.settings_reader.version(version); },
                 [&](const Signals& signals) { machine_.settings_reader.signals(signals); },
                 [&](const Firmware& firmware) { machine_.settings_reader.firmware(firmware); },
                 [&](const ParserState& state) {
                   machine_.modes_told = true;
                   phase_->modes_told(state);
                 },
                 [](const Message&) {},
                 // Noise. If it was an answer, the missing answer will be noticed.
                 [](const UnknownReply&) {},
             },
             reply);
}

void GrblCore::tick(TimePoint now) {
  at(now).serve_deadline();
  phase_->serve_settled();
  ask();
  phase_->tick();
  phase_->pump();
}

void GrblCore::ask() {
  if (!phase_->polls()) return;
  if (machine_.fell_silent() && phase_->minds_silence()) {
    // The link may be dead, but if it is not, this stops the machine.
    machine_.reset();
    phase_->link_lost({ErrorCode::kDisconnected,
                       "the laser controller stopped answering, because its link is broken, it hangs or is busy with "
                       "something else, or this computer was too loaded to hear it: check its cable and supply, end "
                       "other heavy programs, then Clear and Reset"});
    machine_.close_link();
    return;
  }
  machine_.ask_if_due(phase_->poll_period());
}

TimePoint GrblCore::next_deadline() const {
  TimePoint next = phase_->next_deadline();
  if (!phase_->listens()) return next;
  if (phase_->polls()) next = std::min(next, machine_.next_poll_deadline());
  return std::min(next, machine_.silence_deadline());
}

std::vector<LaserEvent> GrblCore::take_events() { return std::exchange(events_, {}); }

LaserStatus GrblCore::status() const {
  LaserStatus status = machine_.status();
  status.connected = phase_->connected();
  if (status.connected) return status;
  LaserStatus nothing;
  nothing.lid_openings = status.lid_openings;
  return nothing;
}

}  // namespace veneer::grbl
