// Dated calibrations of devices. Rows are never changed: a new calibration is a new certificate.
//
// Bound to the thread of the Database it is given, which must outlive it.
#pragma once

#include <string>
#include <vector>

#include "base/ids.h"
#include "base/result.h"
#include "base/units.h"
#include "db/database.h"

namespace veneer::db {

enum class CertificateKind { kScanner, kCamera, kAxes, kKerf };
const char* to_string(CertificateKind kind);

struct CertificateRecord {
  CertificateId id;  // 0 on insertion
  CertificateKind kind = CertificateKind::kScanner;
  std::string issued_at, expires_at;
  Millimetres rms;      // what is left over after the fit
  std::string payload;  // JSON text, written and read by the daemon
};

class Certificates {
 public:
  explicit Certificates(Database& database) : database_(&database) {}

  Result<CertificateId> issue(const CertificateRecord& certificate);
  // The one of its kind that was issued last, whatever the clock said then, if it is in force at `now`; kNotFound says
  // which calibration to run. An older one never takes its place.
  Result<CertificateRecord> latest_valid(CertificateKind kind, const std::string& now);
  Result<std::vector<CertificateRecord>> list();  // the one issued last first

 private:
  Database* database_;
};

}  // namespace veneer::db
