#include "base/clock.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cmath>

namespace veneer {

ScaledClock::ScaledClock(double scale) : scale_(scale > 0 && std::isfinite(scale) ? scale : 1) {}

TimePoint ScaledClock::now() const {
  const auto real = std::chrono::steady_clock::now().time_since_epoch();
  return TimePoint(Duration(std::llround(static_cast<double>(Duration(real).count()) * scale_)));
}

Duration ScaledClock::real_delay(Duration device) const {
  return Duration(std::llround(static_cast<double>(device.count()) / scale_));
}

std::string utc_text(std::chrono::system_clock::time_point at) {
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(at.time_since_epoch()).count() % 1000;
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03d}Z", fmt::gmtime(std::chrono::system_clock::to_time_t(at)), ms);
}

std::string utc_timestamp(std::chrono::seconds ahead) { return utc_text(std::chrono::system_clock::now() + ahead); }

}  // namespace veneer
