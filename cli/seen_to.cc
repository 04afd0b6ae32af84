#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <iostream>
#include <string>
#include <vector>

#include "cli/command_context.h"
#include "cli/json_read.h"

namespace veneer::cli {
namespace {

// As a shell takes it.
std::string as_option(const std::string& name) {
  return name.find(' ') == std::string::npos ? "--confirm " + name : fmt::format("--confirm \"{}\"", name);
}

}  // namespace

bool at_terminal() { return ::isatty(STDIN_FILENO) != 0; }

bool yes(const std::string& question) {
  std::cerr << question << " [y/N] " << std::flush;
  std::string answer;
  std::getline(std::cin, answer);
  return answer == "y" || answer == "Y" || answer == "yes";
}

Result<std::vector<std::string>> seen_to(const CommandContext& context, std::vector<std::string> confirmed,
                                         const std::string& what) {
  const auto status = context.client().get("/status");
  if (!status) return status.error();
  std::vector<std::string> missing;
  if (const nlohmann::json& asked = member(*status, "confirm"); asked.is_array())
    for (const nlohmann::json& name : asked)
      if (name.is_string() && std::find(confirmed.begin(), confirmed.end(), name.get<std::string>()) == confirmed.end())
        missing.push_back(name.get<std::string>());
  if (missing.empty()) return confirmed;
  if (!at_terminal()) {
    std::vector<std::string> options;
    options.reserve(missing.size());
    for (const std::string& name : missing) options.push_back(as_option(name));
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("the beam would come on, and nobody is at a terminal to be asked: see to it, and say {}",
                             fmt::join(options, " "))};
  }
  if (!yes(fmt::format("{} Seen to: {}?", what, fmt::join(missing, ", "))))
    return Error{ErrorCode::kCancelled, "nothing was burnt"};
  confirmed.insert(confirmed.end(), missing.begin(), missing.end());
  return confirmed;
}

std::vector<std::string> seen_to_or_fail(const CommandContext& context, std::vector<std::string> confirmed,
                                         const std::string& what) {
  auto names = seen_to(context, std::move(confirmed), what);
  if (!names) fail(names.error(), names.error().code == ErrorCode::kInvalidArgument ? kUnusableArguments : kWorkFailed);
  return std::move(*names);
}

}  // namespace veneer::cli
