#include "cli/unknown_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <string_view>
#include <vector>

namespace veneer::cli {
namespace {

// How many letters are put in, left out, changed or swapped with their neighbour between two words (optimal string
// alignment).
std::size_t typing_errors(std::string_view a, std::string_view b) {
  std::vector<std::vector<std::size_t>> errors(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) errors[i][0] = i;
  std::iota(errors[0].begin(), errors[0].end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i)
    for (std::size_t k = 1; k <= b.size(); ++k) {
      errors[i][k] =
          std::min({errors[i - 1][k] + 1, errors[i][k - 1] + 1, errors[i - 1][k - 1] + (a[i - 1] == b[k - 1] ? 0 : 1)});
      if (i > 1 && k > 1 && a[i - 1] == b[k - 2] && a[i - 2] == b[k - 1])
        errors[i][k] = std::min(errors[i][k], errors[i - 2][k - 2] + 1);
    }
  return errors[a.size()][b.size()];
}

// "" when none is near: half of a word may be mistyped, or it is the beginning of one.
std::string nearest(const std::string& word, const std::vector<const CLI::App*>& commands) {
  std::string best;
  std::size_t least = std::max<std::size_t>(1, word.size() / 2) + 1;
  for (const CLI::App* command : commands) {
    const std::string& name = command->get_name();
    const std::size_t errors = name.starts_with(word) ? 0 : typing_errors(word, name);
    if (errors < least) best = name, least = errors;
  }
  return best;
}

}  // namespace

std::string unknown_command(const CLI::App& app) {
  const CLI::App* at = &app;
  std::string path = app.get_name();
  while (!at->get_subcommands().empty()) {
    at = at->get_subcommands().front();
    path += " " + at->get_name();
  }
  const auto commands = at->get_subcommands([](const CLI::App*) { return true; });
  if (commands.empty()) return "";
  // What nobody took: words after it are the unknown command's own.
  const std::vector<std::string> left = app.remaining(true);
  const auto word = std::find_if(left.begin(), left.end(), [](const auto& w) { return !w.starts_with("-"); });
  if (word == left.end()) return "";
  const std::string best = nearest(*word, commands);
  return fmt::format("there is no command `{} {}`{}: `{} --help` lists those there are", path, *word,
                     best.empty() ? "" : fmt::format("; perhaps `{} {}` is meant", path, best), path);
}

}  // namespace veneer::cli
