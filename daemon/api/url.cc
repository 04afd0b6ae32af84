#include "daemon/api/url.h"

namespace veneer::daemon {
namespace {

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

bool is_control(char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }

std::string_view take_until(std::string_view& rest, char separator) {
  const std::size_t end = rest.find(separator);
  const std::string_view head = rest.substr(0, end);
  rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
  return head;
}

// More than any operation takes. Thousands would keep the reactor from others.
constexpr int kMostPairs = 100;

bool parse_query(std::string_view text, Target& target) {
  for (int pairs = 0; !text.empty(); ++pairs) {
    if (pairs == kMostPairs) return false;
    std::string_view pair = take_until(text, '&');
    if (pair.empty()) continue;
    const auto name = percent_decode(take_until(pair, '='), true);
    const auto value = percent_decode(pair, true);
    if (!name || !value) return false;
    if (!target.query.emplace(*name, *value).second) target.repeated = *name;
  }
  return true;
}

}  // namespace

std::optional<std::string> percent_decode(std::string_view text, bool plus_is_space) {
  std::string decoded;
  decoded.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    char c = text[i];
    if (c == '%') {
      if (i + 2 >= text.size()) return std::nullopt;
      const int high = hex_digit(text[i + 1]);
      const int low = hex_digit(text[i + 2]);
      if (high < 0 || low < 0) return std::nullopt;
      c = static_cast<char>(high * 16 + low);
      i += 2;
    } else if (c == '+' && plus_is_space) {
      c = ' ';
    }
    if (is_control(c)) return std::nullopt;
    decoded += c;
  }
  return decoded;
}

std::optional<Target> parse_target(std::string_view target) {
  if (target.empty() || target.front() != '/') return std::nullopt;
  Target parsed;
  const std::size_t question = target.find('?');
  std::string_view path = target.substr(1, question == std::string_view::npos ? question : question - 1);
  if (question != std::string_view::npos && !parse_query(target.substr(question + 1), parsed)) {
    return std::nullopt;
  }
  const bool root = path.empty();
  while (!root) {
    const bool last = path.find('/') == std::string_view::npos;
    const auto segment = percent_decode(take_until(path, '/'), false);
    if (!segment || segment->empty() || *segment == "." || *segment == "..") return std::nullopt;
    if (segment->find('/') != std::string::npos) return std::nullopt;
    parsed.segments.push_back(*segment);
    if (last) break;
  }
  return parsed;
}

}  // namespace veneer::daemon
