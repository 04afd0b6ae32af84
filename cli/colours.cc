#include "cli/colours.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <string_view>

namespace veneer::cli {
namespace {

constexpr std::string_view kRed = "\x1b[1;31m", kYellow = "\x1b[1;33m", kBold = "\x1b[1m", kPlain = "\x1b[0m";

struct Word {
  std::string_view text, colour;
  bool begins_line;  // a state or a label, and not a word in a sentence
};
constexpr std::array kWords = {
    Word{"Aborted", kRed, true},     Word{"Aborting", kRed, true},     Word{"aborted", kRed, false},
    Word{"failed", kRed, false},     Word{"damaged", kRed, false},     Word{"Held", kYellow, true},
    Word{"Holding", kYellow, true},  Word{"Suspended", kYellow, true}, Word{"Complete", kYellow, true},
    Word{"Suspect", kYellow, true},  Word{"Missing", kYellow, true},   Word{"Warning", kYellow, true},
    Word{"Waits", kYellow, true},    Word{"suspect", kYellow, false},  Word{"incomplete", kYellow, false},
    Word{"expired", kYellow, false}, Word{"Confirm", kBold, true},     Word{"Next", kBold, true},
};

bool is_letter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; }

}  // namespace

bool wants_colours(bool terminal, const char* no_color, const char* term) {
  const bool refused = no_color != nullptr && *no_color != '\0';
  return terminal && !refused && term != nullptr && std::string_view(term) != "dumb";
}

// Nothing changes the environment of this program while it runs.
bool out_has_colours() {
  static const bool has = wants_colours(::isatty(STDOUT_FILENO) != 0, std::getenv("NO_COLOR"),  // NOLINT
                                        std::getenv("TERM"));                                   // NOLINT
  return has;
}

bool err_has_colours() {
  static const bool has = wants_colours(::isatty(STDERR_FILENO) != 0, std::getenv("NO_COLOR"),  // NOLINT
                                        std::getenv("TERM"));                                   // NOLINT
  return has;
}

std::string with_colours(const std::string& text) {
  std::string out;
  bool line_begins = true;
  for (std::size_t at = 0; at < text.size();) {
    if (!is_letter(text[at])) {
      // Labels may be indented.
      line_begins = text[at] == '\n' || (line_begins && text[at] == ' ');
      out += text[at++];
      continue;
    }
    const auto end = static_cast<std::size_t>(
        std::find_if_not(text.begin() + static_cast<std::ptrdiff_t>(at), text.end(), is_letter) - text.begin());
    const std::string_view word = std::string_view(text).substr(at, end - at);
    const auto known = std::find_if(kWords.begin(), kWords.end(), [&](const Word& one) {
      return one.text == word && (line_begins || !one.begins_line);
    });
    if (known == kWords.end())
      out += word;
    else
      out.append(known->colour).append(word).append(kPlain);
    line_begins = false;
    at = end;
  }
  return out;
}

std::string in_red(const std::string& text) { return std::string(kRed).append(text).append(kPlain); }

}  // namespace veneer::cli
