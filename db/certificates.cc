#include "db/certificates.h"

#include <fmt/format.h>

#include "db/sql.h"

namespace veneer::db {
namespace {

constexpr const char* kColumns = "SELECT id, kind, issued_at, expires_at, rms_mm, payload FROM certificates ";

CertificateKind kind_of(const std::string& name) {
  for (const auto kind : {CertificateKind::kScanner, CertificateKind::kCamera, CertificateKind::kAxes})
    if (name == to_string(kind)) return kind;
  return CertificateKind::kKerf;  // the schema allows no fifth
}

CertificateRecord read(SQLite::Statement& row) {
  return {{row.getColumn(0).getInt64()}, kind_of(text(row.getColumn(1))),           text(row.getColumn(2)),
          text(row.getColumn(3)),        Millimetres(row.getColumn(4).getDouble()), text(row.getColumn(5))};
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
    SQLite::Statement rows(connection, std::string(kColumns) + "WHERE kind = ? ORDER BY id DESC LIMIT 1");
    rows.bind(1, to_string(kind));
    if (!rows.executeStep())
      return Error{ErrorCode::kNotFound,
                   fmt::format("there is no {} certificate: run that calibration", to_string(kind))};
    CertificateRecord last = read(rows);
    if (last.issued_at > now)
      return Error{ErrorCode::kNotFound,
                   fmt::format("the last {} certificate is of {}, later than this machine's clock: set the clock, or "
                               "run that calibration again",
                               to_string(kind), last.issued_at)};
    if (last.expires_at <= now)
      return Error{ErrorCode::kNotFound, fmt::format("the last {} certificate expired {}: run that calibration again",
                                                     to_string(kind), last.expires_at)};
    return last;
  });
}

Result<std::vector<CertificateRecord>> Certificates::list() {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<CertificateRecord>> {
    SQLite::Statement rows(connection, std::string(kColumns) + "ORDER BY id DESC");
    std::vector<CertificateRecord> out;
    while (rows.executeStep()) out.push_back(read(rows));
    return out;
  });
}

}  // namespace veneer::db
