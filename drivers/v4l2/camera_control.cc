#include "drivers/v4l2/camera_control.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <optional>

namespace veneer::v4l2 {
namespace {

std::optional<std::int64_t> number_of(const std::string& text) {
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

bool takes(const CameraControl& control, std::int64_t number) {
  if (control.kind == CameraControl::Kind::kChoice)
    return std::ranges::any_of(control.choices, [&](const auto& choice) { return choice.first == number; });
  if (number < control.least || number > control.most) return false;
  return control.step <= 1 || (number - control.least) % control.step == 0;
}

}  // namespace

std::string control_name(std::string_view title) {
  std::string name;
  bool gap = false;
  for (const char c : title) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) {
      gap = !name.empty();
      continue;
    }
    if (gap) name += '_';
    gap = false;
    name += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return name;
}

std::string what_it_takes(const CameraControl& control) {
  if (control.kind == CameraControl::Kind::kYesNo) return "0 or 1";
  if (control.kind == CameraControl::Kind::kChoice) {
    std::vector<std::string> choices;
    for (const auto& [number, title] : control.choices) choices.push_back(fmt::format("{} ({})", number, title));
    return fmt::format("{}", fmt::join(choices, ", "));
  }
  std::string text = fmt::format("{} to {}", control.least, control.most);
  if (control.step > 1) text += fmt::format(" in steps of {}", control.step);
  return text;
}

Result<std::int64_t> fitting_value(const CameraControl& control, const std::string& wanted, const std::string& camera) {
  const auto refuse = [&](const std::string& why) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("the camera {} does not take {} = {}: {}", camera, control.name, wanted, why)};
  };
  if (!control.settable || control.kind == CameraControl::Kind::kOther)
    return refuse("it cannot be set by a program, so leave it out");
  if (control.kind == CameraControl::Kind::kYesNo && (wanted == "true" || wanted == "false"))
    return std::int64_t{wanted == "true"};
  const auto number = number_of(wanted);
  if (!number || !takes(control, *number)) return refuse("use " + what_it_takes(control));
  return *number;
}

std::int64_t nearest_value(const CameraControl& control, std::int64_t value) {
  const std::int64_t inside = std::clamp(value, control.least, control.most);
  if (control.step <= 1) return inside;
  const std::int64_t last = (control.most - control.least) / control.step;
  const std::int64_t steps = (inside - control.least + control.step / 2) / control.step;
  return control.least + std::min(steps, last) * control.step;
}

}  // namespace veneer::v4l2
