// Text for files that know nothing but printable ASCII, one line.
#pragma once

#include <algorithm>
#include <string>

namespace veneer::planner {

// Every other byte becomes a question mark, so that no name can break a line of the file.
inline std::string plain_ascii(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return text;
}

}  // namespace veneer::planner
