#include "tests/support/json_schema.h"

#include <fmt/format.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>

#include "tests/support/temp_directory.h"

namespace veneer::testing {

std::vector<std::string> schema_errors(const nlohmann::json& document, const std::string& schema) {
  const TempDirectory directory;
  std::ofstream(directory / "document.json") << document.dump();
  const std::string command =
      fmt::format("/usr/bin/python3 '{0}/tests/support/json_schema.py' '{0}/docs/schemas/{1}' < '{2}' 2>&1",
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

}  // namespace veneer::testing
