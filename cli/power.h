// Power and overrides as they are written on the command line: in per cent, with the sign.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

#include "base/result.h"

namespace veneer::cli {

// "60%" of the rated power is 0.6. 0 needs no sign. kInvalidArgument for any other number without one, since 1 may mean
// 1 % or all of it, and beyond 0% to 100%.
Result<double> power_of(const std::string& text);

// --power 60%: `take` gets the fraction, 0 to 1. A power that cannot be read makes the arguments unusable.
CLI::Option* add_power_option(CLI::App& command, const std::string& name, std::function<void(double)> take,
                              const std::string& help);
// --powers 20%,40%
CLI::Option* add_powers_option(CLI::App& command, const std::string& name, std::vector<double>& powers,
                               const std::string& help);

struct PercentRange {
  int least = 0, most = 0;
};
// What an override may be; the daemon holds it against the same (docs/openapi.json).
inline constexpr PercentRange kFeedOverride{25, 200}, kRapidOverride{25, 100}, kPowerOverride{10, 100};

// --feed 80 or --feed 80%: whole per cent of what is asked for.
CLI::Option* add_percent_option(CLI::App& command, const std::string& name, const PercentRange& range,
                                std::function<void(int)> take, const std::string& help);

}  // namespace veneer::cli
