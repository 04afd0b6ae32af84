#include "tests/support/json_schema.h"

#include <fmt/format.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>

#include "tests/support/temp_directory.h"

namespace veneer::testing {
namespace {

// `schema`: what json_schema.py is to be called with, in quotes.
std::vector<std::string> judged(const nlohmann::json& document, const std::string& schema) {
  const TempDirectory directory;
  std::ofstream(directory / "document.json") << document.dump();
  const std::string command = fmt::format("/usr/bin/python3 '{}/tests/support/json_schema.py' {} < '{}' 2>&1",
                                          VENEER_SOURCE, schema, (directory / "document.json").string());
  int status = 0;
  std::vector<std::string> lines;
  {
    const auto close = [&status](FILE* pipe) { status = ::pclose(pipe); };
    const std::unique_ptr<FILE, decltype(close)> pipe(::popen(command.c_str(), "r"), close);
    std::array<char, 4096> line{};
    while (::fgets(line.data(), line.size(), pipe.get()) != nullptr) lines.emplace_back(line.data());
  }
  if (status != 0 && lines.empty()) lines.push_back(command + " failed");
  return lines;
}

}  // namespace

std::vector<std::string> schema_errors(const nlohmann::json& document, const std::string& schema) {
  return judged(document, fmt::format("'{}/docs/schemas/{}'", VENEER_SOURCE, schema));
}

std::vector<std::string> openapi_errors(const nlohmann::json& document, const std::string& pointer) {
  return judged(document, fmt::format("'{}/docs/openapi.json' '{}'", VENEER_SOURCE, pointer));
}

}  // namespace veneer::testing
