#include "drivers/grbl/reply.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

namespace veneer::grbl {
namespace {

constexpr std::size_t kLongestLine = 400;

template <class Number>
std::optional<Number> number(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  if constexpr (std::is_floating_point_v<Number>) {
    if (!std::isfinite(value)) return std::nullopt;
  }
  return value;
}

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    const auto at = text.find(separator);
    parts.push_back(text.substr(0, at));
    if (at == std::string_view::npos) return parts;
    text.remove_prefix(at + 1);
  }
}

bool starts_with_word(std::string_view line, std::string_view lower) {
  return line.size() >= lower.size() && std::equal(lower.begin(), lower.end(), line.begin(), [](char a, char b) {
           return a == static_cast<char>(std::tolower(static_cast<unsigned char>(b)));
         });
}

std::optional<StatusReport::Xy> xy(std::string_view text) {
  const auto parts = split(text, ',');
  if (parts.size() < 2) return std::nullopt;
  StatusReport::Xy value{};
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const auto axis = number<double>(parts[i]);
    if (!axis) return std::nullopt;
    if (i < 2) value[i] = *axis;
  }
  return value;
}

// The third axis of a position that reads; nullopt for a machine that has two.
std::optional<double> third(std::string_view text) {
  const auto parts = split(text, ',');
  return parts.size() < 3 ? std::nullopt : number<double>(parts[2]);
}

bool read_overrides(std::string_view text, StatusReport& report) {
  const auto parts = split(text, ',');
  if (parts.size() != 3) return false;
  std::array<int, 3> values{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto value = number<int>(parts[i]);
    if (!value) return false;
    values[i] = *value;
  }
  report.overrides = values;
  return true;
}

bool read_feed_and_power(std::string_view text, StatusReport& report) {
  const auto parts = split(text, ',');
  if (parts.size() < 2 || !number<double>(parts[0])) return false;
  const auto power = number<double>(parts[1]);
  if (!power) return false;
  report.power = *power;
  return true;
}

// False when a field that is known does not read.
bool read_field(std::string_view field, StatusReport& report) {
  const auto colon = field.find(':');
  const std::string_view name = field.substr(0, colon);
  const std::string_view value = colon == std::string_view::npos ? std::string_view{} : field.substr(colon + 1);
  if (name == "MPos") report.machine_z = third(value);
  if (name == "WPos") report.work_z = third(value);
  if (name == "WCO") report.offset_z = third(value);
  if (name == "MPos") return (report.machine_position = xy(value)).has_value();
  if (name == "WPos") return (report.work_position = xy(value)).has_value();
  if (name == "WCO") return (report.work_offset = xy(value)).has_value();
  if (name == "FS") return read_feed_and_power(value, report);
  if (name == "Ov") return read_overrides(value, report);
  return true;
}

bool known_state(std::string_view state) {
  constexpr std::array<std::string_view, 10> kStates = {"Idle", "Run",   "Hold", "Jog",   "Alarm",
                                                        "Door", "Check", "Home", "Sleep", "Tool"};
  return std::find(kStates.begin(), kStates.end(), state.substr(0, state.find(':'))) != kStates.end();
}

Reply parse_report(std::string_view line) {
  const auto fields = split(line.substr(1, line.size() - 2), '|');
  StatusReport report;
  report.state = fields.front();
  if (!known_state(report.state)) return UnknownReply{std::string(line)};
  for (std::size_t i = 1; i < fields.size(); ++i)
    if (!read_field(fields[i], report)) return UnknownReply{std::string(line)};
  return report;
}

Reply parse_parser_state(std::string_view line, std::string_view body) {
  ParserState state;
  state.text = body;
  for (const std::string_view word : split(body, ' ')) {
    if (word.empty()) continue;
    if (word.front() == 'F' || word.front() == 'S') {
      const auto value = number<double>(word.substr(1));
      if (!value) return UnknownReply{std::string(line)};
      (word.front() == 'F' ? state.feed : state.power) = *value;
    } else {
      state.words.emplace_back(word);
    }
  }
  return state;
}

Reply parse_bracket(std::string_view line) {
  const std::string_view inner = line.substr(1, line.size() - 2);
  const auto colon = inner.find(':');
  const std::string_view name = inner.substr(0, colon);
  const std::string_view body = colon == std::string_view::npos ? std::string_view{} : inner.substr(colon + 1);
  if (name == "GC") return parse_parser_state(line, body);
  if (name == "SIGNALS") return Signals{std::string(body)};
  if (name == "FIRMWARE") return Firmware{std::string(body)};
  if (name == "VER") return BuildVersion{std::string(body)};
  if (name == "OPT") {
    const auto parts = split(body, ',');
    BuildOptions options{std::string(parts.front()), std::nullopt, std::nullopt};
    if (parts.size() > 1) options.planner_blocks = number<std::size_t>(parts[1]);
    if (parts.size() > 2) options.receive_bytes = number<std::size_t>(parts[2]);
    return options;
  }
  return Message{std::string(inner)};
}

Reply parse_setting(std::string_view line) {
  const auto equals = line.find('=');
  if (equals != std::string_view::npos) {
    // Older firmware appends a description: "$0=10 (step pulse, usec)".
    const std::string_view value = line.substr(equals + 1, line.find(' ', equals) - equals - 1);
    const auto key = number<int>(line.substr(1, equals - 1));
    const auto reading = number<double>(value);
    if (key && reading) return SettingLine{*key, *reading};
  }
  return UnknownReply{std::string(line)};
}

}  // namespace

bool StatusReport::is(std::string_view name) const {
  return std::string_view(state).substr(0, state.find(':')) == name;
}

bool lid_is_open(const StatusReport& report) {
  return report.state == "Door" || report.state == "Door:1" || report.state == "Door:2";
}

bool ParserState::has(std::string_view word) const {
  return std::find(words.begin(), words.end(), word) != words.end();
}

Reply parse_reply(std::string_view line) {
  if (line == "ok") return Acknowledged{};
  if (line.substr(0, 6) == "error:") {
    const auto code = number<int>(line.substr(6));
    return code ? Reply(Refused{*code}) : Reply(UnknownReply{std::string(line)});
  }
  if (line.substr(0, 6) == "ALARM:") {
    const auto code = number<int>(line.substr(6));
    return code ? Reply(AlarmRaised{*code}) : Reply(UnknownReply{std::string(line)});
  }
  if (line.front() == '<' && line.back() == '>' && line.size() > 2) return parse_report(line);
  if (line.front() == '[' && line.back() == ']' && line.size() > 2) return parse_bracket(line);
  if (line.front() == '$') return parse_setting(line);
  if (starts_with_word(line, "grbl ") || starts_with_word(line, "grblhal ")) return Banner{std::string(line)};
  return UnknownReply{std::string(line)};
}

void LineReader::feed(std::string_view bytes, const std::function<void(std::string_view)>& on_line) {
  for (const char c : bytes) {
    if (c != '\n' && c != '\r') {
      if (line_.size() < kLongestLine) line_ += c;
      continue;
    }
    if (line_.empty()) continue;
    // Moved out first: the handler may clear() this reader.
    const std::string line = std::move(line_);
    line_.clear();
    on_line(line);
  }
}

}  // namespace veneer::grbl
