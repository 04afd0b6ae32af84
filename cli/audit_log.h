// What veneerctl tells of the audit log. render_audit is pure.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "base/result.h"
#include "cli/api_client.h"

namespace veneer::cli {

// Of a reply of GET /audit: a line for each row, then the head.
std::string render_audit(const nlohmann::json& audit);

// Is the row of this head ("17:3f2a...") still in the log, with this hash? The sentence that says so; kStorage when it
// is not, kInvalidArgument when this is no head. That the rows follow from each other is the integrity check's to say.
Result<std::string> compare_audit_head(const ApiClient& client, const std::string& head);

}  // namespace veneer::cli
