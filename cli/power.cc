#include "cli/power.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <optional>
#include <utility>

namespace veneer::cli {
namespace {

struct Written {
  double value = 0;
  bool percent = false;  // with its sign
};

// "60", "60%" or "60 %".
std::optional<Written> written_number(std::string text) {
  Written out;
  out.percent = text.ends_with('%');
  if (out.percent) text.pop_back();
  while (out.percent && text.ends_with(' ')) text.pop_back();
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out.value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(out.value)) return std::nullopt;
  return out;
}

double power_or_unusable(const std::string& name, const std::string& text) {
  const auto power = power_of(text);
  if (!power) throw CLI::ValidationError(name, power.error().message);
  return *power;
}

}  // namespace

Result<double> power_of(const std::string& text) {
  const auto written = written_number(text);
  if (!written) return unusable(fmt::format("\"{}\" is no power: write it in per cent, as in 60%", text));
  const double value = written->value;
  if (!written->percent) {
    if (value == 0) return 0.0;
    if (value > 0 && value <= 1)
      return unusable(fmt::format("{} may mean {:g} % or {:g} % of the rated power: write {:g}% or {:g}%", text, value,
                                  100 * value, value, 100 * value));
    return unusable(fmt::format("{} does not say of what: write {}%", text, text));
  }
  if (value < 0 || value > 100) return unusable(fmt::format("{} is beyond what the laser has: 0% to 100%", text));
  return value / 100;
}

CLI::Option* add_power_option(CLI::App& command, const std::string& name, std::function<void(double)> take,
                              const std::string& help) {
  const auto read = [name, take = std::move(take)](const std::string& text) { take(power_or_unusable(name, text)); };
  return command.add_option_function<std::string>(name, read, help)->type_name("PERCENT");
}

CLI::Option* add_powers_option(CLI::App& command, const std::string& name, std::vector<double>& powers,
                               const std::string& help) {
  const auto read = [name, &powers](const std::vector<std::string>& texts) {
    powers.clear();
    for (const std::string& text : texts) powers.push_back(power_or_unusable(name, text));
  };
  return command.add_option_function<std::vector<std::string>>(name, read, help)->delimiter(',')->type_name("PERCENT");
}

CLI::Option* add_percent_option(CLI::App& command, const std::string& name, const PercentRange& range,
                                std::function<void(int)> take, const std::string& help) {
  const auto read = [name, range, take = std::move(take)](const std::string& text) {
    const auto written = written_number(text);
    if (!written || written->value != std::floor(written->value) || written->value < range.least ||
        written->value > range.most)
      throw CLI::ValidationError(
          name, fmt::format("it is {}, and must be whole per cent from {} to {}", text, range.least, range.most));
    take(static_cast<int>(written->value));
  };
  return command.add_option_function<std::string>(name, read, help)->type_name("PERCENT");
}

}  // namespace veneer::cli
