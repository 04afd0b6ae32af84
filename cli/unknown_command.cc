#include "cli/unknown_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
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
std::string nearest(const std::string& word, const std::vector<std::string>& names) {
  std::string best;
  std::size_t least = std::max<std::size_t>(1, word.size() / 2) + 1;
  for (const std::string& name : names) {
    const std::size_t errors = name.starts_with(word) ? 0 : typing_errors(word, name);
    if (errors < least) best = name, least = errors;
  }
  return best;
}

// From veneerctl itself to the last command that was understood.
std::vector<const CLI::App*> path_of(const CLI::App& app) {
  std::vector<const CLI::App*> out{&app};
  while (!out.back()->get_subcommands().empty()) out.push_back(out.back()->get_subcommands().front());
  return out;
}

std::string words_of(const std::vector<const CLI::App*>& path) {
  std::vector<std::string> names;
  names.reserve(path.size());
  for (const CLI::App* command : path) names.push_back(command->get_name());
  return fmt::format("{}", fmt::join(names, " "));
}

}  // namespace

std::string unknown_option(const CLI::App& app) {
  const auto path = path_of(app);
  const std::vector<std::string> left = app.remaining(true);
  if (left.empty() || left.front().size() < 2 || left.front()[0] != '-' || left.front() == "--" ||
      std::isdigit(static_cast<unsigned char>(left.front()[1])) != 0)
    return "";
  const std::string option = left.front().substr(0, left.front().find('='));
  std::vector<std::string> names;
  for (const CLI::App* command : path)
    for (const CLI::Option* known : command->get_options())
      for (const std::string& name : known->get_lnames()) names.push_back(name);
  const std::string best = option.starts_with("--") ? nearest(option.substr(2), names) : "";
  if (!best.empty()) return fmt::format("unknown option {}: did you mean --{}?", option, best);
  return fmt::format("unknown option {}: `{} --help` lists those there are", option, words_of(path));
}

std::string unknown_command(const CLI::App& app) {
  const auto commands_to = path_of(app);
  const CLI::App* at = commands_to.back();
  const std::string path = words_of(commands_to);
  std::vector<std::string> commands;
  for (const CLI::App* command : at->get_subcommands([](const CLI::App*) { return true; }))
    commands.push_back(command->get_name());
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
