// docs/openapi.json says what the route table does, and the console asks for nothing that is not in it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>
#include <string>

#include "console/console_page.h"
#include "daemon/api/route_table.h"
#include "daemon/api/router.h"

namespace veneer::daemon {
namespace {

nlohmann::json openapi() {
  std::ifstream file(VENEER_OPENAPI);
  return nlohmann::json::parse(file, nullptr, false);
}

std::string lower(std::string_view text) {
  std::string result(text);
  std::ranges::transform(result, result.begin(), [](unsigned char c) { return std::tolower(c); });
  return result;
}

struct Described {
  std::string method, path, role;
  bool operator==(const Described&) const = default;
};
void PrintTo(const Described& d, std::ostream* out) { *out << d.method << ' ' << d.path << ' ' << d.role; }

TEST(OpenApi, DescribesExactlyTheOperationsOfTheRouteTable) {
  const nlohmann::json doc = openapi();
  ASSERT_TRUE(doc.is_object());
  EXPECT_EQ(doc["openapi"], "3.1.0");
  std::map<std::string, Described> described;
  for (const auto& [path, methods] : doc["paths"].items()) {
    for (const auto& [method, operation] : methods.items()) {
      described[operation["operationId"]] = {method, path, operation["x-role"]};
    }
  }
  std::map<std::string, Described> bound;
  for (const ApiOperation& operation : api_operations()) {
    bound[std::string(operation.id)] = {lower(operation.method), std::string(operation.pattern),
                                        to_string(operation.role)};
  }
  EXPECT_EQ(described, bound);
}

// Who repeats a request because its reply was lost sends a key only where the description names one.
TEST(OpenApi, NamesAKeyOfWhateverStartsOrChangesSomething) {
  // Secrets are remembered nowhere, STOP waits for no memory, and the last four keep nothing.
  const std::set<std::string> without{"openSession", "changePassword", "addUser",    "setUserPassword", "newToken",
                                      "stop",        "sketchPlan",     "sketchGrid", "sketchMosaic",    "readDrawing"};
  std::set<std::string> found;
  const nlohmann::json doc = openapi();
  for (const auto& [path, methods] : doc["paths"].items())
    for (const auto& [method, operation] : methods.items()) {
      if (method == "get") continue;
      const nlohmann::json parameters = operation.value("parameters", nlohmann::json::array());
      const bool named = std::ranges::any_of(
          parameters, [](const nlohmann::json& one) { return one.value("name", "") == "Idempotency-Key"; });
      if (!named) found.insert(operation["operationId"]);
    }
  EXPECT_EQ(found, without);
}

void collect_references(const nlohmann::json& node, std::set<std::string>& found) {
  if (node.is_object()) {
    if (node.contains("$ref")) found.insert(node["$ref"]);
    for (const auto& [key, value] : node.items()) collect_references(value, found);
  } else if (node.is_array()) {
    for (const auto& value : node) collect_references(value, found);
  }
}

TEST(OpenApi, EveryReferenceLeadsSomewhere) {
  const nlohmann::json doc = openapi();
  std::set<std::string> references;
  collect_references(doc, references);
  EXPECT_GT(references.size(), 10U);
  for (const std::string& reference : references) {
    ASSERT_TRUE(reference.starts_with("#/")) << reference;
    EXPECT_TRUE(doc.contains(nlohmann::json::json_pointer(reference.substr(1)))) << reference;
  }
}

TEST(OpenApi, DescribesEveryParameterOfItsPaths) {
  const nlohmann::json doc = openapi();
  for (const auto& [path, methods] : doc["paths"].items()) {
    const auto open = path.find('{');
    if (open == std::string::npos) continue;
    const std::string name = path.substr(open + 1, path.find('}') - open - 1);
    for (const auto& [method, operation] : methods.items()) {
      const auto& parameters = operation["parameters"];
      EXPECT_TRUE(std::any_of(
          parameters.begin(), parameters.end(),
          [&](const nlohmann::json& p) { return p["name"] == name && p["in"] == "path" && p["required"] == true; }))
          << method << " " << path;
    }
  }
}

// In the script every path stands in quotes or a template, `${...}` in place of a parameter: whole, or without
// "/api/v1" where link.js and its like put that before it.
TEST(Console, AsksOnlyForPathsOfTheApi) {
  Router router;
  for (const ApiOperation& operation : api_operations()) {
    router.bind(operation.id, [](const ApiRequest&, const Reply&) {});
  }
  std::string script;
  for (const console::PageFile& file : console::page_files()) script += file.content;
  std::set<std::string> paths;
  const auto collect = [&](const std::regex& named, const std::string& before) {
    for (std::sregex_iterator it(script.begin(), script.end(), named), end; it != end; ++it)
      paths.insert(before + std::regex_replace((*it)[1].str(), std::regex("\\$\\{[^}]*\\}"), "1"));
  };
  collect(std::regex("[\"'`](/api/v1/[^\"'`?]*)"), "");
  collect(std::regex("\\b(?:get|askAll|command|picture|pictureUrl)\\([\"'`](/[^\"'`?]*)"), "/api/v1");
  EXPECT_GE(paths.size(), 30U) << "they stand otherwise, and are not looked at";
  EXPECT_TRUE(paths.contains("/api/v1/stop"));
  EXPECT_TRUE(paths.contains("/api/v1/events"));
  for (const std::string& path : paths) {
    const bool answered =
        router.match("GET", path).route || router.match("POST", path).route || router.match("DELETE", path).route;
    EXPECT_TRUE(answered) << path;
  }
}

}  // namespace
}  // namespace veneer::daemon
