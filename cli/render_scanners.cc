// Scanners and what can be set on them, in words.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "cli/json_read.h"
#include "cli/render.h"

namespace veneer::cli {

using nlohmann::json;

namespace {

std::string numbers_words(const json& numbers) {
  std::string text;
  for (const json& number : numbers)
    if (number.is_number()) text += fmt::format("{}{:g}", text.empty() ? "" : ", ", number.get<double>());
  return text;
}

// "50 to 1200 in steps of 50", "Gray, Color"; "" where it takes anything.
std::string takes_words(const json& option) {
  if (text_or(option, "kind", "") == "yes_no") return "true, false";
  const json& range = member(option, "range");
  if (range.is_object()) {
    const double step = number_or(range, "step", 0);
    return fmt::format("{:g} to {:g}", number_or(range, "least", 0), number_or(range, "most", 0)) +
           (step >= 0.001 ? fmt::format(" in steps of {:g}", step) : "");
  }
  if (const json& numbers = member(option, "numbers"); numbers.is_array() && !numbers.empty())
    return numbers_words(numbers);
  std::string text;
  if (const json& words = member(option, "words"); words.is_array())
    for (const json& word : words)
      if (word.is_string()) text += fmt::format("{}\"{}\"", text.empty() ? "" : ", ", word.get<std::string>());
  return text;
}

bool every_scan_needs(std::string_view name) {
  constexpr std::array<std::string_view, 10> kNames{"resolution", "x-resolution", "y-resolution", "mode", "depth",
                                                    "source",     "tl-x",         "tl-y",         "br-x", "br-y"};
  return std::ranges::count(kNames, name) > 0;
}

std::string option_line(const json& option) {
  std::string text = fmt::format("  {:<18} {}", text_or(option, "name", "?"), takes_words(option));
  if (const std::string unit = text_or(option, "unit", ""); !unit.empty()) text += " " + unit;
  if (const std::string value = text_or(option, "value", ""); !value.empty()) text += fmt::format(" [{}]", value);
  if (!flag_or(option, "settable", true)) text += ", read only";
  if (!flag_or(option, "active", true)) text += ", with another source or mode only";
  return text + "\n";
}

}  // namespace

std::string render_scanners(const json& found, bool all) {
  const json& scanners = member(found, "scanners");
  if (!scanners.is_array() || scanners.empty())
    return "No scanner is found. Switch it on, look at its cable; docs/CALIBRATION.md says what the daemon needs for "
           "it.\n";
  std::string text;
  for (const json& scanner : scanners) {
    text += fmt::format("{}{}\n  {}, {}\n", text.empty() ? "" : "\n", text_or(scanner, "name", "?"),
                        text_or(scanner, "make", "?"), text_or(scanner, "type", "?"));
    if (const std::string problem = text_or(scanner, "problem", ""); !problem.empty()) text += "  " + problem + "\n";
    if (const json& options = member(scanner, "options"); options.is_array())
      for (const json& option : options)
        if (all || every_scan_needs(text_or(option, "name", ""))) text += option_line(option);
  }
  return text;
}

}  // namespace veneer::cli
