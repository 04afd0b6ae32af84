// What to say about a command or an option that there is not.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace veneer::cli {

// After parsing has failed: a sentence that names the first word that is no command and the known one nearest to it;
// "" when something else was wrong.
std::string unknown_command(const CLI::App& app);
// The same of an option, where one is the first word that nobody took: the nearest of those that the command takes, or
// that stand before any command.
std::string unknown_option(const CLI::App& app);

}  // namespace veneer::cli
