// What the guardian darkens, and the words in which the daemon tells it.
//
// One line each, ended by '\n':
//   watch FAMILY PORT   daemon -> guardian: from now on; what an earlier daemon left behind is darkened first
//   again FAMILY PORT   daemon -> guardian: the same daemon as before, after the guardian was away; nothing is touched
//   left SENTENCE       guardian -> daemon: that could not be reached yet; it is tried again, and "ready" follows
//   ready               guardian -> daemon: the machine is watched
//   ready SENTENCE      the same, but what was left behind, at another port, could not be reached
//   ping                daemon -> guardian: is anybody there?
//   pong                guardian -> daemon: yes
//   done                daemon -> guardian: the machine is dark and its port closed; nothing more is to be done
// A connection that ends without "done" is the daemon's death.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace veneer::guardian {

struct GuardedMachine {
  std::string family;  // grbl | lihuiyu
  std::string port;    // "serial:...", "tcp:...", "usb:...", "twin:...", "file:..."
  friend bool operator==(const GuardedMachine&, const GuardedMachine&) = default;
};

inline std::string to_text(const GuardedMachine& machine) { return machine.family + " " + machine.port; }

// Nothing when this is no machine.
inline std::optional<GuardedMachine> machine_from_text(std::string_view text) {
  const auto space = text.find(' ');
  if (space == std::string_view::npos || space + 1 == text.size()) return std::nullopt;
  GuardedMachine machine{std::string(text.substr(0, space)), std::string(text.substr(space + 1))};
  if (machine.family != "grbl" && machine.family != "lihuiyu") return std::nullopt;
  return machine;
}

}  // namespace veneer::guardian
