#include "db/certificates.h"

#include <fmt/format.h>

#include <optional>

#include "db/audit_chain.h"
#include "db/sql.h"

namespace veneer::db {
namespace {

constexpr const char* kCertificateColumns =
    "SELECT id, kind, issued_at, expires_at, rms_mm, payload FROM certificates ";

CertificateKind kind_of(const std::string& name) {
  for (const auto kind : {CertificateKind::kScanner, CertificateKind::kCamera, CertificateKind::kAxes})
    if (name == to_string(kind)) return kind;
  return CertificateKind::kKerf;  // the schema allows no fifth
}

CertificateRecord read(SQLite::Statement& row) {
  return {{row.getColumn(0).getInt64()}, kind_of(text(row.getColumn(1))),           text(row.getColumn(2)),
          text(row.getColumn(3)),        Millimetres(row.getColumn(4).getDouble()), text(row.getColumn(5))};
}

bool depends_on_laser(CertificateKind kind) { return kind == CertificateKind::kAxes || kind == CertificateKind::kKerf; }

// The laser that was there when certificate `id` was issued; nothing when none had told by then.
std::optional<std::string> laser_at(SQLite::Database& connection, CertificateId id) {
  SQLite::Statement row(connection, "SELECT identity FROM lasers WHERE after_certificate < ? ORDER BY id DESC LIMIT 1");
  row.bind(1, id.value);
  if (!row.executeStep()) return std::nullopt;
  return text(row.getColumn(0));
}

// The one of its kind that was issued last.
std::optional<CertificateRecord> read_last(SQLite::Database& connection, CertificateKind kind) {
  SQLite::Statement rows(connection, std::string(kCertificateColumns) + "WHERE kind = ? ORDER BY id DESC LIMIT 1");
  rows.bind(1, to_string(kind));
  if (!rows.executeStep()) return std::nullopt;
  return read(rows);
}

// The one that told last.
std::optional<std::string> laser_now(SQLite::Database& connection) {
  SQLite::Statement row(connection, "SELECT identity FROM lasers ORDER BY id DESC LIMIT 1");
  if (!row.executeStep()) return std::nullopt;
  return text(row.getColumn(0));
}

}  // namespace

const char* to_string(CertificateKind kind) {
  switch (kind) {
    case CertificateKind::kScanner:
      return "scanner";
    case CertificateKind::kCamera:
      return "camera";
    case CertificateKind::kAxes:
      return "axes";
    case CertificateKind::kKerf:
      return "kerf";
  }
  return "kerf";
}

Result<CertificateId> Certificates::issue(const CertificateRecord& certificate) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Result<CertificateId> {
    SQLite::Statement insert(
        connection, "INSERT INTO certificates (kind, issued_at, expires_at, rms_mm, payload) VALUES (?, ?, ?, ?, ?)");
    SQLite::bind(insert, to_string(certificate.kind), certificate.issued_at, certificate.expires_at,
                 certificate.rms.count(), certificate.payload);
    insert.exec();
    return CertificateId{connection.getLastInsertRowid()};
  });
}

Result<CertificateRecord> Certificates::latest_valid(CertificateKind kind, const std::string& now) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<CertificateRecord> {
    auto found = read_last(connection, kind);
    if (!found)
      return Error{ErrorCode::kNotFound,
                   fmt::format("there is no {} certificate: run that calibration", to_string(kind))};
    CertificateRecord& last = *found;
    if (last.issued_at > now)
      return Error{ErrorCode::kNotFound,
                   fmt::format("the last {} certificate is of {}, later than this machine's clock: set the clock, or "
                               "run that calibration again",
                               to_string(kind), last.issued_at)};
    if (last.expires_at <= now)
      return Error{ErrorCode::kNotFound, fmt::format("the last {} certificate expired {}: run that calibration again",
                                                     to_string(kind), last.expires_at)};
    if (depends_on_laser(kind) && laser_at(connection, last.id) != laser_now(connection))
      return Error{ErrorCode::kNotFound,
                   fmt::format("the last {} certificate was made on another laser, or before this "
                               "one's settings were changed: run that calibration again",
                               to_string(kind))};
    return std::move(last);
  });
}

Result<std::optional<CertificateRecord>> Certificates::last(CertificateKind kind) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::optional<CertificateRecord>> {
    return read_last(connection, kind);
  });
}

Result<bool> Certificates::on_this_laser(const CertificateRecord& certificate) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<bool> {
    return !depends_on_laser(certificate.kind) || laser_at(connection, certificate.id) == laser_now(connection);
  });
}

Status Certificates::laser_is(const std::string& identity, const std::string& now) {
  if (identity.empty()) return Ok();
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    const auto known = laser_now(connection);
    if (known == identity) return Ok();
    SQLite::Statement insert(connection,
                             "INSERT INTO lasers (identity, after_certificate, found_at) SELECT ?, CASE WHEN ? THEN "
                             "coalesce(max(id), 0) ELSE 0 END, ? FROM certificates");
    SQLite::bind(insert, identity, known ? 1 : 0, now);
    insert.exec();
    append_to_chain(connection, {0, now, kDaemon, "laser.found", identity});
    return Ok();
  });
}

Result<std::vector<CertificateRecord>> Certificates::list() { return list({}, -1); }

Result<std::vector<CertificateRecord>> Certificates::list(CertificateId before, int limit) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<CertificateRecord>> {
    SQLite::Statement rows(connection,
                           std::string(kCertificateColumns) + "WHERE ?1 = 0 OR id < ?1 ORDER BY id DESC LIMIT ?2");
    SQLite::bind(rows, before.value, limit);
    std::vector<CertificateRecord> out;
    while (rows.executeStep()) out.push_back(read(rows));
    return out;
  });
}

}  // namespace veneer::db
