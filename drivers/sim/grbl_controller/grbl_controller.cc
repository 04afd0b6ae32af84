#include "drivers/sim/grbl_controller/grbl_controller.h"

#include "drivers/sim/grbl_controller/machine.h"

namespace veneer::sim {

GrblController::GrblController(const GrblSettings& settings, const GrblOptions& options, std::uint64_t seed,
                               BurnSink* sink)
    : impl_(std::make_unique<Impl>(settings, options, seed, sink)) {}
GrblController::~GrblController() = default;

void GrblController::power_on(TimePoint now) { impl_->power_on(now); }
void GrblController::power_off(TimePoint now) { impl_->power_off(now); }
void GrblController::receive(std::string_view bytes, TimePoint now) { impl_->receive(bytes, now); }
void GrblController::advance_to(TimePoint now) { impl_->advance_to(now); }
std::optional<TimePoint> GrblController::next_event_time() const { return impl_->next_event_time(); }
std::string GrblController::take_output() { return impl_->take_output(); }
void GrblController::set_lid(bool open, TimePoint now) { impl_->set_lid(open, now); }
void GrblController::inject(const Fault& fault) { impl_->faults_.push_back(fault); }
bool GrblController::link_up() const { return impl_->link_up_; }
void GrblController::plug() { impl_->link_up_ = true; }
void GrblController::unplug(TimePoint now) {
  impl_->advance_to(now);
  impl_->link_up_ = false;
}
void GrblController::set_consent(bool given) { impl_->consent_ = given; }
const BeamLog& GrblController::beam_log() const { return impl_->log_; }
HeadPosition GrblController::head() const { return impl_->head(); }
void GrblController::put_head(HeadPosition at) { impl_->put_head(at); }
bool GrblController::moving() const { return impl_->moving(); }
bool GrblController::beam_on() const { return impl_->beam_on(); }
double GrblController::beam_power() const { return impl_->beam_power(); }
bool GrblController::homed() const { return impl_->homed_; }
std::string GrblController::state() const { return impl_->state_name(); }
const GrblSettings& GrblController::settings() const { return impl_->settings_; }

}  // namespace veneer::sim
