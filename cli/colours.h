// Colour on a terminal, for what is not as it should be and for what waits for somebody; never colour alone, since all
// of it is a word. Pure.
#pragma once

#include <string>

namespace veneer::cli {

// Whether what is written there is coloured: a terminal that can, of somebody who has not said NO_COLOR (no-color.org).
// `no_color` and `term` are those variables, nullptr where they are not set.
bool wants_colours(bool terminal, const char* no_color, const char* term);
// For standard output and standard error, of this process.
bool out_has_colours();
bool err_has_colours();

// The text of a command with its words of trouble in red, of doubt and waiting in yellow, and labels of what to do
// bold.
std::string with_colours(const std::string& text);
std::string in_red(const std::string& text);

}  // namespace veneer::cli
