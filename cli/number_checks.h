// Checks of numbers on the command line that refuse them in words. (CLI11's PositiveNumber names the largest double
// there is, with its 309 digits, as the end of what is allowed.)
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace veneer::cli {

CLI::Validator positive_number();
CLI::Validator number_from_zero();

// The text with each very long number in it cut short: "123456789012... (309 digits)".
std::string with_short_numbers(const std::string& text);

}  // namespace veneer::cli
