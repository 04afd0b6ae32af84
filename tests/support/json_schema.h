// Holds JSON that programs write against the schemas that are published in docs/schemas and docs/openapi.json
// (json_schema.py; Debian's python3-jsonschema judges).
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace veneer::testing {

// What speaks against `document` by docs/schemas/`schema`, one sentence each; also each key that the schema does not
// name, although readers must not mind it: what is written is to be published.
std::vector<std::string> schema_errors(const nlohmann::json& document, const std::string& schema);
// The same by the part of docs/openapi.json that the JSON pointer leads to.
std::vector<std::string> openapi_errors(const nlohmann::json& document, const std::string& pointer);

}  // namespace veneer::testing
