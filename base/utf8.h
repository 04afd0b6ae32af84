// Texts that people wrote, in UTF-8, counted and cut as people see them. Pure functions; thread-safe.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string_view>

namespace veneer {

// Further bytes of a character begin with the bits 10.
constexpr bool begins_character(char byte) { return (static_cast<unsigned char>(byte) & 0xC0U) != 0x80U; }

constexpr std::ptrdiff_t characters(std::string_view text) { return std::ranges::count_if(text, begins_character); }

// As much of its beginning as `most` bytes hold, without half a character at the end.
constexpr std::string_view beginning_of(std::string_view text, std::size_t most) {
  if (text.size() <= most) return text;
  while (most > 0 && !begins_character(text[most])) --most;
  return text.substr(0, most);
}

}  // namespace veneer
