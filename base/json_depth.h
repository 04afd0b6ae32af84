// How deeply a text of JSON is nested. Pure.
#pragma once

#include <string_view>

namespace veneer {

// Brackets within texts do not count. What is nested deeper than anything this program reads would be copied, written
// and taken down by recursion, for which a stack is too small: to be asked before such a text is parsed.
bool nested_too_deeply(std::string_view json, int deepest = 32);

}  // namespace veneer
