#include "planner/drawings/svg_style.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

namespace veneer::planner {
namespace {

// What reading a drawing heeds. Fonts, widths of strokes and the like change no line.
constexpr std::array<std::string_view, 6> kHeeded = {"display", "visibility", "clip-path", "mask", "stroke", "fill"};
constexpr std::string_view kBlanks = " \t\r\n\f";

Error unread(const std::string& what) {
  return {ErrorCode::kInvalidArgument,
          fmt::format("the drawing's style sheet has {}, which is not read: save the drawing with strokes and fills as "
                      "attributes of its elements (presentation attributes), not in a style sheet",
                      what)};
}

std::string_view without_blanks(std::string_view text) {
  const std::size_t from = text.find_first_not_of(kBlanks);
  if (from == std::string_view::npos) return {};
  return text.substr(from, text.find_last_not_of(kBlanks) - from + 1);
}

// Calls `take` with each part between separators, without the blanks around it, but for empty ones.
template <class F>
void for_each_part(std::string_view text, std::string_view separators, F take) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find_first_of(separators), text.size());
    if (const std::string_view part = without_blanks(text.substr(0, end)); !part.empty()) take(part);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

// The last declaration of the property counts.
std::optional<std::string_view> declared(std::string_view declarations, std::string_view name) {
  std::optional<std::string_view> out;
  for_each_part(declarations, ";", [&](std::string_view entry) {
    const std::size_t colon = entry.find(':');
    if (colon != std::string_view::npos && without_blanks(entry.substr(0, colon)) == name)
      out = without_blanks(entry.substr(colon + 1));
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
std::string without_comments(std::string_view css) {
  std::string out;
  while (!css.empty()) {
    const std::size_t begin = std::min(css.find("/*"), css.size());
    out += css.substr(0, begin);
    const std::size_t end = css.find("*/", std::min(begin + 2, css.size()));
    css.remove_prefix(end == std::string_view::npos ? css.size() : end + 2);
  }
  for (const std::string_view mark : {"<!--", "-->"})
    for (std::size_t at = 0; (at = out.find(mark, at)) != std::string::npos;)
      out.replace(at, mark.size(), mark.size(), ' ');
  return out;
}

}  // namespace

Status StyleSheet::add(std::string_view css) {
  const std::string text = without_comments(css);
  for (std::string_view left = without_blanks(text); !left.empty(); left = without_blanks(left)) {
    if (left.front() == '@') {
      const std::string_view name = left.substr(0, left.find_first_of(" \t\r\n\f;{\"'("));
      if (name != "@font-face" && name != "@charset" && name != "@namespace")
        return unread(fmt::format("the rule {}", name));
      const std::size_t block = left.find_first_of(";{");
      const std::size_t last = block != std::string_view::npos && left[block] == '{' ? left.find('}', block) : block;
      left.remove_prefix(last == std::string_view::npos ? left.size() : last + 1);
      continue;
    }
    const std::size_t open = left.find('{');
    const std::size_t close = open == std::string_view::npos ? open : left.find_first_of("{}", open + 1);
    if (close == std::string_view::npos || left[close] == '{')
      return unread(fmt::format("\"{}\"", left.substr(0, std::min<std::size_t>(left.size(), 40))));
    if (const Status added = add_rule(left.substr(0, open), left.substr(open + 1, close - open - 1)); !added.ok())
      return added;
    left.remove_prefix(close + 1);
  }
  return Ok();
}

Status StyleSheet::add_rule(std::string_view selectors, std::string_view declarations) {
  std::string_view bad;
  for (const std::string_view name : kHeeded) {
    const auto value = declared(declarations, name);
    if (!value) continue;
    if (value->find('!') != std::string_view::npos) bad = *value;
    for_each_part(selectors, ",", [&](std::string_view selector) {
      if (!is_simple(selector)) bad = selector;
      if (!bad.empty() || ++selectors_ > kMostSelectors) return;
      rules_[fmt::format("{} {}", name, selector)] = {std::string(*value), selectors_};
    });
    if (!bad.empty()) return unread(fmt::format("\"{}\"", bad.substr(0, 40)));
    if (selectors_ > kMostSelectors) return unread(fmt::format("more than {} rules", kMostSelectors));
  }
  return Ok();
}

const StyleSheet::Value* StyleSheet::rule(std::string_view name, std::string_view before,
                                          std::string_view selector) const {
  const auto found = rules_.find(fmt::format("{} {}{}", name, before, selector));
  return found == rules_.end() ? nullptr : &found->second;
}

std::string StyleSheet::property(const StyledElement& element, std::string_view name) const {
  if (const auto own = declared(element.style, name))
    return std::string(without_blanks(own->substr(0, own->find("!important"))));
  if (rules_.empty()) return {};
  // From what is said of fewest elements to what is said of all.
  if (const Value* by_id = element.id.empty() ? nullptr : rule(name, "#", element.id)) return by_id->text;
  for (const std::string& before : {fmt::format("{}.", element.tag), std::string(".")}) {
    const Value* last = nullptr;
    for_each_part(element.classes, kBlanks, [&](std::string_view one) {
      const Value* found = rule(name, before, one);
      if (found != nullptr && (last == nullptr || found->order > last->order)) last = found;
    });
    if (last != nullptr) return last->text;
  }
  for (const std::string_view all : {element.tag, std::string_view("*")})
    if (const Value* found = rule(name, "", all)) return found->text;
  return {};
}

}  // namespace veneer::planner
