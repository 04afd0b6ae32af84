// Whole numbers as letters, small ones in few: five bits to a letter of '?' to '~', the lowest first; all but the last
// letter have a sixth bit. The sign is the lowest bit. 0 is "?", -1 "@", 10 "S", 16 "_@". What is stored in great
// numbers is written so, as text that every tool can carry. Pure functions.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace veneer {

inline constexpr int kBitsOfLetter = 5;
inline constexpr std::uint64_t kMoreLetters = 1U << kBitsOfLetter;
inline constexpr char kFirstLetter = '?', kLastLetter = '~';

inline void append_letters(std::string& out, std::int64_t number) {
  std::uint64_t bits = (static_cast<std::uint64_t>(number) << 1U) ^ (number < 0 ? ~std::uint64_t{0} : 0);
  for (; bits >= kMoreLetters; bits >>= kBitsOfLetter)
    out += static_cast<char>(kFirstLetter + (kMoreLetters | (bits & (kMoreLetters - 1))));
  out += static_cast<char>(kFirstLetter + bits);
}

// Takes a number of seven letters at most off the front. False when there is none, or it is written longer than it need
// be; then some of it may be gone.
inline bool take_letters(std::string_view& text, std::int64_t& out) {
  constexpr int kMostBits = 30;
  std::uint64_t bits = 0;
  for (int shift = 0; shift <= kMostBits; shift += kBitsOfLetter) {
    if (text.empty() || text.front() < kFirstLetter || text.front() > kLastLetter) return false;
    const auto letter = static_cast<std::uint64_t>(text.front() - kFirstLetter);
    text.remove_prefix(1);
    bits |= (letter & (kMoreLetters - 1)) << static_cast<unsigned>(shift);
    if ((letter & kMoreLetters) != 0) continue;
    out = static_cast<std::int64_t>(bits >> 1U) ^ ((bits & 1U) != 0 ? -1 : 0);
    return shift == 0 || letter != 0;
  }
  return false;
}

}  // namespace veneer
