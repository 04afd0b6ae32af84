// How deeply a text of JSON is nested. Pure.
#pragma once

#include <string_view>

namespace veneer::daemon {

// What is nested deeper than any answer of a worker is would be copied and written by recursion, for which a stack is
// too small. To be asked before such a text is parsed.
bool nested_too_deeply(std::string_view text);

}  // namespace veneer::daemon
