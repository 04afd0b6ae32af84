#include "db/plan_files.h"

#include <fmt/format.h>

#include <span>
#include <system_error>

#include "base/files.h"
#include "base/hash.h"
#include "db/sql.h"

namespace veneer::db {
namespace {

namespace fs = std::filesystem;

constexpr const char* kKeepPlan = "veneer_keep_plan";

fs::path place_of(const fs::path& database, const std::string& sha256) {
  return database.parent_path() / plan_file_name(sha256);
}

void keep_plan_function(sqlite3_context* context, int, sqlite3_value** arguments) {
  const auto* bytes = static_cast<const char*>(sqlite3_value_blob(arguments[0]));
  const auto size = static_cast<std::size_t>(sqlite3_value_bytes(arguments[0]));
  const auto& database = *static_cast<const fs::path*>(sqlite3_user_data(context));
  const auto kept = keep_plan_file(database, bytes == nullptr ? std::string() : std::string(bytes, size));
  if (kept)
    sqlite3_result_text(context, kept->sha256.data(), static_cast<int>(kept->sha256.size()), SQLITE_TRANSIENT);
  else
    sqlite3_result_error(context, kept.error().message.c_str(), -1);
}

}  // namespace

std::string plan_file_name(const std::string& sha256) { return fmt::format("plans/{}.json", sha256); }

Result<PlanFile> keep_plan_file(const fs::path& database, const std::string& text) {
  const auto bytes = std::as_bytes(std::span(text));
  PlanFile file{sha256_hex(bytes), static_cast<std::int64_t>(text.size())};
  if (const Status written = write_whole(place_of(database, file.sha256), bytes); !written) return written.error();
  return file;
}

Result<std::string> read_plan_file(const fs::path& database, const PlanFile& file) {
  const fs::path place = place_of(database, file.sha256);
  const auto lost = [&](const char* how) {
    return Error{ErrorCode::kStorage,
                 fmt::format("the plan file {} {}: restore it from a backup", place.string(), how)};
  };
  std::error_code none;
  if (fs::symlink_status(place, none).type() != fs::file_type::regular) return lost("is missing");
  if (fs::file_size(place, none) != static_cast<std::uintmax_t>(file.bytes)) return lost("is not what was written");
  auto text = read_whole(place);
  if (!text) return lost("cannot be read");
  if (sha256_hex(std::as_bytes(std::span(*text))) != file.sha256) return lost("is not what was written");
  return *std::move(text);
}

Status remove_plan_file(const fs::path& database, const std::string& sha256) {
  return remove_durably(place_of(database, sha256));
}

KeepPlanFunction::KeepPlanFunction(SQLite::Database& connection)
    : connection_(connection), file_(connection.getFilename()) {
  if (sqlite3_create_function(connection_.getHandle(), kKeepPlan, 1, SQLITE_UTF8 | SQLITE_DIRECTONLY, &file_,
                              &without_exceptions<keep_plan_function>, nullptr, nullptr) != SQLITE_OK)
    throw SQLite::Exception(connection_.getHandle());
}

KeepPlanFunction::~KeepPlanFunction() {
  sqlite3_create_function(connection_.getHandle(), kKeepPlan, 1, SQLITE_UTF8, nullptr, nullptr, nullptr, nullptr);
}

}  // namespace veneer::db
