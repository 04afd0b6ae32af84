// Words by which people look for what the cell knows. Pure, but for what a reader is told to refuse.
#pragma once

#include <fmt/format.h>

#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "daemon/api/request_reader.h"

namespace veneer::daemon {

// What stands between blanks in `text` of the query; more than ten are refused, since each is looked for in every row.
inline std::vector<std::string> read_words(RequestReader& query) {
  constexpr std::size_t kMostWords = 10;
  std::istringstream in(query.text("text").value_or(""));
  std::vector<std::string> words{std::istream_iterator<std::string>(in), {}};
  if (words.size() > kMostWords)
    query.refuse({ErrorCode::kInvalidArgument, fmt::format("text has more than {} words: leave some out", kMostWords)});
  return words;
}

// Of a letter of Latin-1 or Latin Extended-A (Unicode, U+00C0 to U+017F): those that names of woods and shelves are
// written with beside A to Z, in most of Europe. Others stay as they are.
inline unsigned small_letter_of(unsigned letter) {
  if (letter >= 0xC0 && letter <= 0xDE)
    return letter == 0xD7 ? letter : letter + 0x20;  // but for the multiplication sign
  if (letter == 0x178) return 0xFF;
  const bool even_first =
      (letter >= 0x100 && letter <= 0x137 && letter != 0x130) || (letter >= 0x14A && letter <= 0x177);
  const bool odd_first = (letter >= 0x139 && letter <= 0x148) || (letter >= 0x179 && letter <= 0x17E);
  if (even_first) return letter | 1U;
  return odd_first ? letter + letter % 2 : letter;
}

// Of UTF-8, A to Z and the letters of small_letter_of(); what is no UTF-8 stays as it is.
inline std::string in_small_letters(std::string text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const unsigned first = static_cast<unsigned char>(text[i]);
    if (first >= 'A' && first <= 'Z') text[i] = static_cast<char>(first + 0x20);
    if (first < 0xC3 || first > 0xC5 || i + 1 == text.size()) continue;
    const unsigned second = static_cast<unsigned char>(text[i + 1]);
    if (second >> 6 != 2) continue;
    const unsigned small = small_letter_of((first & 0x1FU) << 6 | (second & 0x3FU));
    text[i] = static_cast<char>(0xC0 | small >> 6);
    text[++i] = static_cast<char>(0x80 | (small & 0x3FU));
  }
  return text;
}

}  // namespace veneer::daemon
