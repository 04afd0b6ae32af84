// Dated calibrations of devices. Rows are never changed: a new calibration is a new certificate.
//
// Bound to the thread of the Database it is given, which must outlive it.
#pragma once

#include <optional>
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
  // which calibration to run. An older one never takes its place. One that depends on the laser (axes, kerf) counts
  // only while the laser is there that was there when it was issued.
  Result<CertificateRecord> latest_valid(CertificateKind kind, const std::string& now);
  // The one of its kind that was issued last, in force or not; nothing when there is none.
  Result<std::optional<CertificateRecord>> last(CertificateKind kind);
  // Is the laser there that was there when it was issued? True also of kinds that do not depend on the laser, and while
  // no laser has told what it is.
  Result<bool> on_this_laser(const CertificateRecord& certificate);
  Result<std::vector<CertificateRecord>> list();  // the one issued last first
  // At most `limit` of them, from before `before` on; {0}: from the one issued last.
  Result<std::vector<CertificateRecord>> list(CertificateId before, int limit);

  // The laser at the port has told what it is (LaserLimits::identity), "" when it cannot. What was issued before
  // anybody told is taken to be made on the first one that does.
  Status laser_is(const std::string& identity, const std::string& now);

 private:
  Database* database_;
};

}  // namespace veneer::db
