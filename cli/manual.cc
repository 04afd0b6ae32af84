#include "cli/manual.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

namespace veneer::cli {
namespace {

std::vector<const CLI::App*> commands_of(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

// Text that roff takes as it is.
std::string plain(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else if ((c == '.' || c == '\'') && (out.empty() || out.back() == '\n'))
      out += std::string("\\&") + c;
    else
      out += c;
  }
  return out;
}

std::string sentence(const std::string& help) {
  return plain(help) + (help.empty() || help.back() == '.' || help.back() == '?' ? "" : ".");
}

// "--size-mm NUMBER", "PICTURE".
std::string option_words(const CLI::Option& option) {
  std::string words = "\\fB" + plain(option.get_name(false, true)) + "\\fR";
  if (option.get_positional()) words = "\\fI" + plain(option.get_name(true)) + "\\fR";
  if (!option.get_type_name().empty() && !option.get_positional())
    words += " \\fI" + plain(option.get_type_name()) + "\\fR";
  return words;
}

std::string options_of(const CLI::App& command) {
  std::string text;
  for (const CLI::Option* option : command.get_options()) {
    text += ".TP\n" + option_words(*option) + "\n" + sentence(option->get_description()) + "\n";
    if (!option->get_default_str().empty()) text += fmt::format("Without it: {}.\n", plain(option->get_default_str()));
    if (!option->get_envname().empty())
      text += fmt::format("Also the variable \\fB{}\\fR.\n", plain(option->get_envname()));
    if (option->get_required()) text += "Required.\n";
  }
  return text;
}

std::string usage_of(const CLI::App& command, const std::string& path) {
  std::string text = "\\fB" + plain(path) + "\\fR";
  for (const CLI::Option* option : command.get_options())
    if (option->get_required() && !option->get_positional()) text += " " + option_words(*option);
  text += " [\\fIOPTIONS\\fR]";
  for (const CLI::Option* option : command.get_options())
    if (option->get_positional())
      text += option->get_required() ? " " + option_words(*option) : " [" + option_words(*option) + "]";
  return text + (commands_of(command).empty() ? "" : " \\fICOMMAND\\fR");
}

// The command and all below it, each under its own heading.
void describe(const CLI::App& command, const std::string& path, std::string& text) {
  text += fmt::format(".SS {}\n{}\n.PP\n{}\n{}", plain(path), sentence(command.get_description()),
                      usage_of(command, path), options_of(command));
  for (const CLI::App* below : commands_of(command)) describe(*below, path + " " + below->get_name(), text);
}

}  // namespace

std::string man_page(const CLI::App& command, const std::string& name, bool is_program) {
  std::string path = name;  // "veneerctl stop-after-piece"
  if (const std::size_t first = path.find('-'); first != std::string::npos) path[first] = ' ';
  std::string heading = name;
  std::transform(heading.begin(), heading.end(), heading.begin(),
                 [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; });
  const std::string title = command.get_description();
  std::string text = fmt::format(
      ".\\\" Written by veneerctl-manual from what --help says.\n.TH {} 1 \"\" \"veneerd\" \"User commands\"\n.SH "
      "NAME\n{} \\- "
      "{}\n.SH SYNOPSIS\n{}\n",
      plain(heading), plain(name), plain(title), usage_of(command, path));
  if (const std::string options = options_of(command); !options.empty()) text += ".SH OPTIONS\n" + options;
  if (const auto below = commands_of(command); !below.empty()) {
    text += ".SH COMMANDS\n";
    for (const CLI::App* one : below) {
      if (!is_program)
        describe(*one, path + " " + one->get_name(), text);
      else
        text += fmt::format(".TP\n\\fB{}\\fR(1), \\fB{} {}\\fR\n{}\n", plain(name + "-" + one->get_name()), plain(path),
                            plain(one->get_name()), sentence(one->get_description()));
    }
  }
  text +=
      ".SH EXIT STATUS\n0 done, 1 the work failed and a sentence on standard error says why, 2 unusable arguments.\n";
  if (is_program)
    text += ".SH NOTES\n\\fBveneerctl stop\\fR is no emergency stop: a laser needs a switch that cuts its power.\n";
  else
    text += ".SH SEE ALSO\n\\fBveneerctl\\fR(1)\n";
  return text;
}

}  // namespace veneer::cli
