// How an SVG's elements are drawn, by its style sheets: whatever decides which lines are seen, and in which colour.
//
// Read are rules by tag, class and id ("path", ".st0", "path.st0", "#edge", "*", and lists of them), as programs for
// drawings write them. Pure; thread-safe.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>

#include "base/result.h"

namespace veneer::planner {

// Of an element: its name, and its attributes of these names.
struct StyledElement {
  std::string_view tag, id, classes, style;
};

class StyleSheet {
 public:
  static constexpr std::size_t kMostSelectors = 10'000;  // a drawing has some hundred

  // Adds what a <style> says. kInvalidArgument: it does not read, has more selectors than that, or says of an element
  // how it is drawn by a rule of another kind, which the sentence names.
  Status add(std::string_view css);

  // Of `style`, or of the rules for this element; "": neither says anything of the property.
  std::string property(const StyledElement& element, std::string_view name) const;

 private:
  struct Value {
    std::string text;
    std::size_t order = 0;  // of its rule: of those of one kind the last one counts
  };
  const Value* rule(std::string_view name, std::string_view before, std::string_view selector) const;
  Status add_rule(std::string_view selectors, std::string_view declarations);

  std::map<std::string, Value, std::less<>> rules_;  // by "property selector"
  std::size_t selectors_ = 0;
};

}  // namespace veneer::planner
