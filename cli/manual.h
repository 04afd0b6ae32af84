// The manual of veneerctl's commands, written from the commands themselves. Pure.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace veneer::cli {

// A man page in roff (man-pages(7)) of `command`, whole name `name` ("veneerctl-job"), with all commands below it. Of
// the program itself (`is_program`) the commands are only listed: each has a page of its own.
std::string man_page(const CLI::App& command, const std::string& name, bool is_program);

// What bash is to source: completes commands, options and the words that options take.
std::string bash_completion(const CLI::App& app);

}  // namespace veneer::cli
