// How an SVG's elements are drawn, by its style sheets: whatever decides which lines are seen, and in which colour.
//
// Read are rules by tag, class and id ("path", ".st0", "path.st0", "#edge", "*", and lists of them), as programs for
// drawings write them. Pure; thread-safe.
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "base/result.h"

namespace veneer::planner {

// What reading a drawing heeds. Fonts, dashes and the like change no line.
inline constexpr std::array<std::string_view, 10> kHeededProperties = {
    "display", "visibility",   "clip-path",      "mask",         "stroke",
    "fill",    "stroke-width", "stroke-opacity", "fill-opacity", "opacity"};
// Characters of the value of one of them: colours and references are shorter.
inline constexpr std::size_t kLongestValue = 200;

// Of an element: its name, and its attributes of these names. A style has no comments (without_comments()).
struct StyledElement {
  std::string_view tag, id, classes, style;
};

class StyleSheet {
 public:
  static constexpr std::size_t kMostSelectors = 100'000;  // a drawing has some hundred

  // Adds what a <style> says. kInvalidArgument: it does not read, has more selectors than that, or says of an element
  // how it is drawn by a rule of another kind or at too great length, which the sentence names.
  Status add(std::string_view css);

  // What `style`, or the rules for this element, say of a heeded property, without "!important"; "": neither says
  // anything. It is valid as long as the element's `style` and the sheet, to which nothing is added.
  std::string_view property(const StyledElement& element, std::string_view name) const;

 private:
  struct Rule {
    std::array<std::shared_ptr<const std::string>, kHeededProperties.size()> values;  // null: it does not say
    std::array<std::size_t, kHeededProperties.size()> order{};  // of those of one kind the last one counts
  };
  const Rule* rule(std::string_view before, std::string_view selector) const;
  Status add_rule(std::string_view selectors, std::string_view declarations);

  std::map<std::string, Rule, std::less<>> rules_;  // by selector
  std::size_t selectors_ = 0;
};

// Of a sheet or of a style="...".
std::string without_comments(std::string_view css);
// Without blanks at its ends.
std::string_view trimmed(std::string_view text);
// Words of CSS are the same in capitals.
std::string lower_case(std::string_view text);

// kInvalidArgument: the value of this property is longer than that.
Status check_length(std::string_view name, std::string_view value);

}  // namespace veneer::planner
