#include "planner/drawings/svg_style.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

namespace veneer::planner {
namespace {

constexpr std::string_view kBlanks = " \t\r\n\f";
constexpr std::string_view kEndsOfAtWord = " \t\r\n\f;{\"'(";

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }
// `word` is in small letters.
bool same_word(std::string_view text, std::string_view word) { return std::ranges::equal(text, word, {}, lower); }

Error unread(const std::string& what) {
  return {ErrorCode::kInvalidArgument,
          fmt::format("the drawing's style sheet has {}, which is not read: save the drawing with strokes and fills as "
                      "attributes of its elements (presentation attributes), not in a style sheet",
                      what)};
}

// Calls `take` with each part between separators, without the blanks around it, but for empty ones.
template <class F>
void for_each_part(std::string_view text, std::string_view separators, F take) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find_first_of(separators), text.size());
    if (const std::string_view part = trimmed(text.substr(0, end)); !part.empty()) take(part);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

struct Declared {
  std::string_view value;  // without what follows a '!'
  bool important = false;
};

// The last declaration of the property counts, of those that are important if one is.
std::optional<Declared> declared(std::string_view declarations, std::string_view name) {
  std::optional<Declared> out;
  for_each_part(declarations, ";", [&](std::string_view entry) {
    const std::size_t colon = entry.find(':');
    if (colon == std::string_view::npos || !same_word(trimmed(entry.substr(0, colon)), name)) return;
    const std::string_view value = entry.substr(colon + 1);
    const std::size_t mark = value.find('!');
    const bool important = mark != std::string_view::npos && same_word(trimmed(value.substr(mark + 1)), "important");
    if (!out || important || !out->important) out = {trimmed(value.substr(0, mark)), important};
  });
  return out;
}

bool is_name(std::string_view text) {
  return !text.empty() && std::ranges::all_of(text, [](unsigned char c) {
    return c >= 0x80 || c == '-' || c == '_' || (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') ||
           (c >= 'A' && c <= 'Z');
  });
}

// "*", "tag", ".class", "tag.class" or "#id".
bool is_simple(std::string_view selector) {
  if (selector == "*") return true;
  if (selector.starts_with('#')) return is_name(selector.substr(1));
  const std::size_t dot = selector.find('.');
  if (dot == std::string_view::npos) return is_name(selector);
  return is_name(selector.substr(dot + 1)) && (dot == 0 || is_name(selector.substr(0, dot)));
}

// CSS within XML may stand in the marks of a comment of HTML, which mean nothing.
std::string without_marks_of_html(std::string css) {
  for (const std::string_view mark : {"<!--", "-->"})
    for (std::size_t at = 0; (at = css.find(mark, at)) != std::string::npos;)
      css.replace(at, mark.size(), mark.size(), ' ');
  return css;
}

// Behind the ';' or the block that ends an at-rule, which may have blocks within; quoted text is none of these.
std::size_t end_of_at_rule(std::string_view css) {
  char quote = 0;
  int depth = 0;
  for (std::size_t at = 0; at < css.size(); ++at) {
    const char c = css[at];
    if (quote != 0 && c == '\\')
      ++at;  // whatever is next is quoted
    else if (quote != 0)
      quote = c == quote ? 0 : quote;
    else if (c == '"' || c == '\'')
      quote = c;
    else if (c == '{')
      ++depth;
    else if ((c == '}' && --depth <= 0) || (c == ';' && depth == 0))
      return at + 1;
  }
  return css.size();
}

// Those that say nothing of how a line is seen on a screen, at rest.
bool changes_no_line(std::string_view at_rule) {
  constexpr std::array<std::string_view, 7> kPassedOver = {
      "@font-face", "@charset", "@namespace", "@keyframes", "@-webkit-keyframes", "@page", "@counter-style"};
  const std::size_t end = std::min(at_rule.find_first_of(kEndsOfAtWord), at_rule.size());
  const std::string name = lower_case(at_rule.substr(0, end));
  if (name == "@media") return same_word(trimmed(at_rule.substr(end, at_rule.find_first_of(";{") - end)), "print");
  return std::ranges::find(kPassedOver, name) != kPassedOver.end();
}

}  // namespace

std::string without_comments(std::string_view css) {
  std::string out;
  while (!css.empty()) {
    const std::size_t begin = std::min(css.find("/*"), css.size());
    out += css.substr(0, begin);
    const std::size_t end = css.find("*/", std::min(begin + 2, css.size()));
    css.remove_prefix(end == std::string_view::npos ? css.size() : end + 2);
  }
  return out;
}

std::string_view trimmed(std::string_view text) {
  const std::size_t from = text.find_first_not_of(kBlanks);
  if (from == std::string_view::npos) return {};
  return text.substr(from, text.find_last_not_of(kBlanks) - from + 1);
}

std::string lower_case(std::string_view text) {
  std::string out(text);
  std::ranges::transform(out, out.begin(), lower);
  return out;
}

Status check_length(std::string_view name, std::string_view value) {
  if (value.size() <= kLongestValue) return Ok();
  return Error{ErrorCode::kInvalidArgument,
               fmt::format("the drawing has a {} of more than {} characters: give a shorter one, and save it again",
                           name, kLongestValue)};
}

Status StyleSheet::add(std::string_view css) {
  const std::string text = without_marks_of_html(without_comments(css));
  for (std::string_view left = trimmed(text); !left.empty(); left = trimmed(left)) {
    if (left.front() == '@') {
      if (!changes_no_line(left))
        return unread(
            fmt::format("the rule {}", left.substr(0, std::min<std::size_t>(left.find_first_of(kEndsOfAtWord), 40))));
      left.remove_prefix(end_of_at_rule(left));
      continue;
    }
    const std::size_t open = left.find('{');
    const std::size_t close = open == std::string_view::npos ? open : left.find_first_of("{}", open + 1);
    if (close == std::string_view::npos || left[close] == '{')
      return unread(fmt::format("\"{}\"", left.substr(0, std::min<std::size_t>(left.size(), 40))));
    if (Status added = add_rule(left.substr(0, open), left.substr(open + 1, close - open - 1)); !added.ok())
      return added;
    left.remove_prefix(close + 1);
  }
  return Ok();
}

Status StyleSheet::add_rule(std::string_view selectors, std::string_view declarations) {
  Rule said;
  for (std::size_t i = 0; i < kHeededProperties.size(); ++i) {
    const auto what = declared(declarations, kHeededProperties[i]);
    if (!what) continue;
    if (what->important) return unread(fmt::format("\"{} !important\"", what->value.substr(0, 40)));
    if (Status good = check_length(kHeededProperties[i], what->value); !good.ok()) return good;
    said.values[i] = std::make_shared<const std::string>(what->value);
  }
  if (std::ranges::none_of(said.values, [](const auto& value) { return value != nullptr; })) return Ok();
  std::string_view bad;
  for_each_part(selectors, ",", [&](std::string_view selector) {
    if (bad.empty() && !is_simple(selector)) bad = selector;
    if (!bad.empty() || ++selectors_ > kMostSelectors) return;
    Rule& known = rules_[std::string(selector)];
    for (std::size_t i = 0; i < kHeededProperties.size(); ++i)
      if (said.values[i]) known.values[i] = said.values[i], known.order[i] = selectors_;
  });
  if (!bad.empty()) return unread(fmt::format("\"{}\"", bad.substr(0, 40)));
  if (selectors_ > kMostSelectors) return unread(fmt::format("more than {} selectors", kMostSelectors));
  return Ok();
}

const StyleSheet::Rule* StyleSheet::rule(std::string_view before, std::string_view selector) const {
  const auto found = rules_.find(fmt::format("{}{}", before, selector));
  return found == rules_.end() ? nullptr : &found->second;
}

std::string_view StyleSheet::property(const StyledElement& element, std::string_view name) const {
  if (const auto own = declared(element.style, name)) return own->value;
  if (rules_.empty()) return {};
  const auto at = static_cast<std::size_t>(std::ranges::find(kHeededProperties, name) - kHeededProperties.begin());
  const auto says = [&](const Rule* rule) { return rule != nullptr && rule->values[at] != nullptr; };
  // From what is said of fewest elements to what is said of all.
  if (const Rule* by_id = element.id.empty() ? nullptr : rule("#", element.id); says(by_id)) return *by_id->values[at];
  for (const std::string& before : {fmt::format("{}.", element.tag), std::string(".")}) {
    const Rule* last = nullptr;
    for_each_part(element.classes, kBlanks, [&](std::string_view one) {
      const Rule* found = rule(before, one);
      if (says(found) && (last == nullptr || found->order[at] > last->order[at])) last = found;
    });
    if (last != nullptr) return *last->values[at];
  }
  for (const std::string_view all : {element.tag, std::string_view("*")})
    if (const Rule* found = rule("", all); says(found)) return *found->values[at];
  return {};
}

}  // namespace veneer::planner
