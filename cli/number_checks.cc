#include "cli/number_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace veneer::cli {
namespace {

CLI::Validator number_that(bool (*is_well)(double), const char* name, const char* words) {
  return CLI::Validator(
      [is_well, words](std::string& text) -> std::string {
        double value = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (error == std::errc::result_out_of_range) return fmt::format("\"{}\" is too large or too small", text);
        const bool read = error == std::errc() && end == text.data() + text.size() && std::isfinite(value);
        return read && is_well(value) ? std::string() : fmt::format("\"{}\" is not {}", text, words);
      },
      name);
}

}  // namespace

CLI::Validator positive_number() {
  return number_that([](double value) { return value > 0; }, "POSITIVE", "a number greater than 0");
}

CLI::Validator number_from_zero() {
  return number_that([](double value) { return value >= 0; }, "NONNEGATIVE", "a number from 0 up");
}

std::string with_short_numbers(const std::string& text) {
  constexpr std::size_t kLong = 40, kShown = 12;
  constexpr const char* kDigits = "0123456789";
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t begin = std::min(text.find_first_of(kDigits, at), text.size());
    const std::size_t end = std::min(text.find_first_not_of(kDigits, begin), text.size());
    out += text.substr(at, begin - at);
    if (end - begin > kLong)
      out += fmt::format("{}... ({} digits)", text.substr(begin, kShown), end - begin);
    else
      out += text.substr(begin, end - begin);
    at = end;
  }
  return out;
}

}  // namespace veneer::cli
