// Paths and queries of request targets.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace veneer::daemon {

struct Target {
  std::vector<std::string> segments;  // decoded; "/" has none
  std::map<std::string, std::string> query;
  std::optional<std::string> repeated;  // a name that stands twice in the query
};

// nullopt for a target that is not a path ("http://...", "*"), has an empty, "." or ".." segment, a broken escape, a
// control character, an encoded slash, or more than a hundred names in its query.
std::optional<Target> parse_target(std::string_view target);

// "%41b" -> "Ab"; with `plus_is_space` also '+' -> ' '. nullopt for a broken escape or a control character.
std::optional<std::string> percent_decode(std::string_view text, bool plus_is_space);

}  // namespace veneer::daemon
