#include "drivers/sane/scanner_option.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

namespace veneer::sane {
namespace {

// Far coarser than SANE's fixed-point numbers, far finer than any setting.
constexpr double kSame = 1e-4;

bool same_letters(const std::string& a, const std::string& b) {
  return std::ranges::equal(a, b, [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

std::optional<double> number_of(const std::string& text) {
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(number)) return std::nullopt;
  return number;
}

bool takes(const ScannerOption& option, double number) {
  if (option.kind == ScannerOption::Kind::kWhole && number != std::round(number)) return false;
  const auto equal = [number](double other) { return std::abs(number - other) <= kSame; };
  if (!option.numbers.empty()) return std::ranges::any_of(option.numbers, equal);
  if (!option.range) return true;
  const auto& range = *option.range;
  if (number < range.least - kSame || number > range.most + kSame) return false;
  return range.step <= 0 || equal(range.least + std::round((number - range.least) / range.step) * range.step) ||
         equal(range.most);
}

}  // namespace

std::string in_digits(double number) { return fmt::format("{:.10g}", std::round(number * 1e4) / 1e4); }

std::string what_it_takes(const ScannerOption& option) {
  if (option.kind == ScannerOption::Kind::kYesNo) return "true or false";
  if (!option.words.empty()) return fmt::format("\"{}\"", fmt::join(option.words, "\", \""));
  if (!option.numbers.empty()) {
    std::vector<std::string> digits;
    for (const double number : option.numbers) digits.push_back(in_digits(number));
    return fmt::format("{}", fmt::join(digits, ", "));
  }
  if (!option.range) return "";
  std::string text = fmt::format("{} to {}", in_digits(option.range->least), in_digits(option.range->most));
  if (option.range->step > kSame) text += fmt::format(" in steps of {}", in_digits(option.range->step));
  return text;
}

Result<std::string> fitting_value(const ScannerOption& option, const std::string& wanted, const std::string& scanner) {
  using Kind = ScannerOption::Kind;
  const auto refuse = [&](const std::string& why) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("the scanner {} does not take {} = {}: {}", scanner, option.name, wanted, why)};
  };
  if (!option.settable) return refuse("it cannot be set by a program, take it out of [scanner]");
  if (!option.active) return refuse("it counts only with another source or mode, set that or take it out");
  const auto refuse_value = [&] {
    const std::string instead = what_it_takes(option);
    return refuse(instead.empty() ? std::string("write a number") : "use " + instead);
  };
  switch (option.kind) {
    case Kind::kYesNo:
      if (same_letters(wanted, "true") || same_letters(wanted, "yes")) return std::string("true");
      if (same_letters(wanted, "false") || same_letters(wanted, "no")) return std::string("false");
      return refuse_value();
    case Kind::kWhole:
    case Kind::kNumber: {
      const auto number = number_of(wanted);
      if (!number || !takes(option, *number)) return refuse_value();
      return in_digits(*number);
    }
    case Kind::kText: {
      if (option.words.empty()) return wanted;
      for (const std::string& word : option.words)
        if (word == wanted) return word;
      for (const std::string& word : option.words)
        if (same_letters(word, wanted)) return word;
      return refuse_value();
    }
    case Kind::kOther:
      break;
  }
  return refuse("it is no setting with one value, take it out of [scanner]");
}

}  // namespace veneer::sane
