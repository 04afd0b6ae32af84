#include "daemon/api/turns.h"

#include <algorithm>
#include <utility>

namespace veneer::daemon {

// Whoever comes anew goes behind those who wait, so that nobody gets ahead by coming and going.
void Turns::wait(const std::string& identity, Turn turn) {
  const auto [line, is_new] = lines_.try_emplace(identity);
  if (is_new) line->second.last = ++taken_;
  line->second.turns.push_back(std::move(turn));
}

Turns::Turn Turns::next() {
  const auto line = std::ranges::min_element(lines_, {}, [](const auto& one) { return one.second.last; });
  Turn turn = std::move(line->second.turns.front());
  line->second.turns.pop_front();
  line->second.last = ++taken_;
  if (line->second.turns.empty()) lines_.erase(line);
  return turn;
}

}  // namespace veneer::daemon
