#include "db/sql.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <string_view>

#include "base/files.h"
#include "base/polygon_ops.h"
#include "db/audit_chain.h"
#include "db/checksum.h"
#include "db/shapes.h"
#include "db/wood_parts.h"

namespace veneer::db {
namespace {

std::optional<MicroArea> area_of(sqlite3_value* value) {
  const auto* bytes = static_cast<const char*>(sqlite3_value_blob(value));
  if (bytes == nullptr) return std::nullopt;
  return read_area({bytes, static_cast<std::size_t>(sqlite3_value_bytes(value))});
}

std::optional<MicroRing> ring_of(sqlite3_value* value) {
  const auto* bytes = static_cast<const char*>(sqlite3_value_blob(value));
  if (bytes == nullptr) return std::nullopt;
  return read_ring({bytes, static_cast<std::size_t>(sqlite3_value_bytes(value))});
}

// veneer_box(area, i): min x, max x, min y, max y in micrometres for i = 0..3.
void box_function(sqlite3_context* context, int, sqlite3_value** arguments) {
  const auto area = area_of(arguments[0]);
  const int which = sqlite3_value_int(arguments[1]);
  if (!area || area->empty() || which < 0 || which > 3) {
    sqlite3_result_error(context, "an allocation needs wood", -1);
    return;
  }
  std::int64_t low = INT64_MAX, high = INT64_MIN;
  for (const auto& ring : area->rings)
    for (const auto& p : ring) {
      const std::int64_t v = which < 2 ? p.x_um : p.y_um;
      low = std::min(low, v);
      high = std::max(high, v);
    }
  sqlite3_result_int64(context, which % 2 == 0 ? low : high);
}

void overlap_function(sqlite3_context* context, int, sqlite3_value** arguments) {
  const auto a = area_of(arguments[0]), b = area_of(arguments[1]);
  if (!a || !b) {
    sqlite3_result_error(context, "the shape of an allocation cannot be read", -1);
    return;
  }
  sqlite3_result_int(context, overlaps(Region<PanelFrame>(*a), Region<PanelFrame>(*b)) ? 1 : 0);
}

void answer(sqlite3_context* context, const std::string& text) {
  sqlite3_result_text(context, text.data(), static_cast<int>(text.size()), SQLITE_TRANSIENT);
}

void cannot_be_read(sqlite3_context* context) {
  sqlite3_result_error(context, "the shape of an allocation cannot be read", -1);
}

// veneer_outline(ring): the same points as an area's, in their order.
void outline_function(sqlite3_context* context, int, sqlite3_value** arguments) {
  const auto ring = ring_of(arguments[0]);
  if (!ring) return cannot_be_read(context);
  answer(context, write_outline(*ring));
}

// veneer_lead_in(area, ring): what of the area the lead-in of the piece burns (db/wood_parts.h).
void lead_in_function(sqlite3_context* context, int, sqlite3_value** arguments) {
  const auto area = area_of(arguments[0]);
  const auto outline = ring_of(arguments[1]);
  if (!area || !outline) return cannot_be_read(context);
  answer(context, write_area(lead_in_of(*area, *outline)));
}

// veneer_kerf(area, outline, lead in): what of the area is neither.
void kerf_function(sqlite3_context* context, int, sqlite3_value** arguments) {
  const auto area = area_of(arguments[0]), outline = area_of(arguments[1]), lead_in = area_of(arguments[2]);
  if (!area || !outline || !lead_in || outline->rings.size() > 1) return cannot_be_read(context);
  answer(context, write_area(kerf_of(*area, outline->empty() ? MicroRing() : outline->rings.front(), *lead_in)));
}

}  // namespace

namespace {

// Around what is damaged.
std::string says_damaged(const std::string& file) { return fmt::format("the database {} is damaged (", file); }
constexpr std::string_view kRemedy =
    "): stop veneerd, put a backup in its place (veneerd --config FILE --restore BACKUP), then start it";

}  // namespace

Error is_damaged(const std::string& file, const std::string& what) {
  return {ErrorCode::kStorage, fmt::format("{}{}{}", says_damaged(file), what, kRemedy)};
}

std::string what_is_damaged(const std::string& file, const Error& error) {
  const std::string& said = error.message;
  const std::size_t before = says_damaged(file).size();
  if (!said.starts_with(says_damaged(file)) || !said.ends_with(kRemedy)) return said;
  return said.substr(before, said.size() - before - kRemedy.size());
}

Error may_not_be_written(const std::filesystem::path& file) {
  if (auto refused = disk_refuses(file)) return *std::move(refused);
  return {ErrorCode::kStorage,
          fmt::format("the database {} cannot be written: check its permissions, and whose it is", file.string())};
}

Error cannot_look_at(const std::filesystem::path& file, const std::error_code& failed) {
  return {
      ErrorCode::kStorage,
      fmt::format("cannot look whether there is a file {} ({}): see what is wrong with its disk and folder, then try "
                  "again",
                  file.string(), failed.message())};
}

Error not_ours(const std::filesystem::path& file) {
  return {ErrorCode::kInvalidArgument,
          fmt::format("{} is a SQLite file of another program: check the path of the database", file.string())};
}

bool means_damage(const SQLite::Exception& thrown) {
  const int code = thrown.getErrorCode();
  if (code == SQLITE_CORRUPT || code == SQLITE_NOTADB) return true;
  // What the schema's triggers of soundness raise; to SQLite it is one more broken rule.
  return code == SQLITE_CONSTRAINT && std::string_view(thrown.what()) == "a row is damaged";
}

namespace {

Error no_memory(const std::string& file) {
  return {
      ErrorCode::kUnavailable,
      fmt::format("there is no memory left, so nothing was done at the database {}: end other programs and try again",
                  file)};
}

}  // namespace

Error to_error(const SQLite::Exception& thrown, const std::string& file) {
  if (means_damage(thrown)) return is_damaged(file, thrown.what());
  const int failed = thrown.getErrorCode();
  if (failed == SQLITE_IOERR || failed == SQLITE_READONLY || failed == SQLITE_CANTOPEN)
    if (auto refused = disk_refuses(file)) return *std::move(refused);
  switch (failed) {
    case SQLITE_FULL:
      return {ErrorCode::kStorage,
              fmt::format("the disk is full, and nothing was written to {}: free some space and try again", file)};
    case SQLITE_IOERR:
      if (thrown.getExtendedErrorCode() == SQLITE_IOERR_NOMEM) return no_memory(file);
      // A quota or a limit on the file, not the disk, or a disk that fails.
      if (thrown.getExtendedErrorCode() == SQLITE_IOERR_WRITE)
        return {ErrorCode::kStorage,
                fmt::format("nothing can be written to {}: make room on the disk or in its quota and try again", file)};
      return {
          ErrorCode::kStorage,
          fmt::format("the disk failed at the database {} ({}): see in the system's log what is wrong with the disk "
                      "and try again",
                      file, thrown.what())};
    case SQLITE_NOMEM:
      return no_memory(file);
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return {ErrorCode::kUnavailable,
              fmt::format("the database {} is busy, because another program holds it: end that one", file)};
    case SQLITE_READONLY:
      return may_not_be_written(file);
    case SQLITE_CANTOPEN:
      return {ErrorCode::kUnavailable,
              fmt::format("the database {} cannot be opened: check the path and its permissions, and whether this "
                          "program has too many files open",
                          file)};
    case SQLITE_CONSTRAINT:
      if (std::string_view(thrown.what()).find("this wood is already allocated") != std::string_view::npos)
        return {ErrorCode::kConflict, "this wood is held for another piece or plan by now, or written off: plan again"};
      return {ErrorCode::kConflict, fmt::format("the database refuses it ({})", thrown.what())};
    default:
      break;
  }
  return {ErrorCode::kStorage, fmt::format("the database {} failed ({})", file, thrown.what())};
}

void register_functions(SQLite::Database& connection) {
  connection.createFunction("veneer_box", 2, true, nullptr, &without_exceptions<box_function>);
  connection.createFunction("veneer_writer", 0, true, nullptr,
                            [](sqlite3_context* context, int, sqlite3_value**) { sqlite3_result_int(context, 1); });
  register_checksum(connection);
  register_audit_hash(connection);
  connection.createFunction("veneer_areas_overlap", 2, true, nullptr, &without_exceptions<overlap_function>);
  connection.createFunction("veneer_outline", 1, true, nullptr, &without_exceptions<outline_function>);
  connection.createFunction("veneer_lead_in", 2, true, nullptr, &without_exceptions<lead_in_function>);
  connection.createFunction("veneer_kerf", 3, true, nullptr, &without_exceptions<kerf_function>);
}

std::vector<std::string> texts_of(SQLite::Database& connection, const std::string& query) {
  SQLite::Statement rows(connection, query);
  std::vector<std::string> out;
  while (rows.executeStep()) out.push_back(text(rows.getColumn(0)));
  return out;
}

SQLite::Exception damaged(const std::string& what) { return {what + " cannot be read", SQLITE_CORRUPT}; }

}  // namespace veneer::db
