#include <fmt/format.h>

#include <string>

#include "cli/manual.h"

namespace veneer::cli {
namespace {

// "back show" of "{back,show}", which is how a choice of words describes itself.
std::string choices_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t open = type.find('{'), close = type.find('}', open);
  if (open == std::string::npos || close == std::string::npos) return "";
  std::string words = type.substr(open + 1, close - open - 1);
  for (char& c : words)
    if (c == ',') c = ' ';
  return words;
}

std::string flags_of(const CLI::Option& option) {
  std::string flags;
  for (const std::string& name : option.get_lnames()) flags += (flags.empty() ? "--" : " --") + name;
  return flags;
}

// A case for the words that may follow, and one for each option that takes some.
void add_cases(const CLI::App& command, const std::string& path, std::string& words, std::string& values) {
  std::string follow;
  const auto below = command.get_subcommands([](const CLI::App*) { return true; });
  for (const CLI::App* one : below) follow += one->get_name() + " ";
  for (const CLI::Option* option : command.get_options()) {
    const std::string flags = flags_of(*option), choices = choices_of(*option);
    if (option->get_positional()) follow += choices.empty() ? "" : choices + " ";
    follow += flags.empty() ? "" : flags + " ";
    if (flags.empty() || option->get_type_size() == 0) continue;
    for (const std::string& name : option->get_lnames())
      values += fmt::format("    '{} --{}') printf '%s' '{}'; return 0 ;;\n", path, name, choices);
  }
  if (!follow.empty()) follow.pop_back();
  words += fmt::format("    '{}') printf '%s' '{}' ;;\n", path, follow);
  for (const CLI::App* one : below) add_cases(*one, path + " " + one->get_name(), words, values);
}

}  // namespace

std::string bash_completion(const CLI::App& app) {
  std::string words, values;
  add_cases(app, app.get_name(), words, values);
  return fmt::format(
      R"bash(# Completes {0}'s commands, options and their words in bash. Written from what --help says.
_{0}_words() {{
  case "$1" in
{1}    *) return 1 ;;
  esac
}}

# The words that an option takes; fails for one that takes none, and for what is no option.
_{0}_values() {{
  case "$1" in
{2}    *) return 1 ;;
  esac
}}

_{0}() {{
  local word="${{COMP_WORDS[COMP_CWORD]}}" before="${{COMP_WORDS[COMP_CWORD-1]}}" path='{0}' i known
  for ((i = 1; i < COMP_CWORD; ++i)); do
    _{0}_words "$path ${{COMP_WORDS[i]}}" >/dev/null && path="$path ${{COMP_WORDS[i]}}"
  done
  if known=$(_{0}_values "$path $before") || known=$(_{0}_values "{0} $before"); then
    # Whatever is no fixed word may be a file.
    if [[ $known ]]; then COMPREPLY=($(compgen -W "$known" -- "$word")); else COMPREPLY=($(compgen -f -- "$word")); fi
    return
  fi
  COMPREPLY=($(compgen -W "$(_{0}_words "$path")" -- "$word"))
  [[ ${{COMPREPLY[0]}} ]] || COMPREPLY=($(compgen -f -- "$word"))
}}
complete -o filenames -F _{0} {0}
)bash",
      app.get_name(), words, values);
}

}  // namespace veneer::cli
