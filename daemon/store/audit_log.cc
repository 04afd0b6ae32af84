#include "daemon/store/audit_log.h"

#include <fmt/format.h>

#include <utility>

namespace veneer::daemon {

AuditLog::AuditLog(DatabaseThread& database, Logger log) : database_(database), log_(std::move(log)) {}

AuditLog::~AuditLog() {
  if (counted_ > 0) write_count();
}

void AuditLog::post(db::AuditEntry entry, std::function<void()> then) {
  database_.async([entry = std::move(entry)](Repositories& r) { return r.audit.append(entry); },
                  [log = log_, then = std::move(then)](const Status& written) {
                    if (!written) log->error("the audit log could not be written: {}", written.error().message);
                    if (then) then();
                  });
}

void AuditLog::write(db::AuditEntry entry) { post(std::move(entry), {}); }

void AuditLog::write_or_count(db::AuditEntry entry) {
  // Once some are counted, the others are too until all that waits is written: so their number is told in one row.
  if (counted_ > 0 || waiting_ >= kMostWaiting) {
    ++counted_;
    last_ = std::move(entry);
    return;
  }
  ++waiting_;
  post(std::move(entry), [this, alive = std::weak_ptr<int>(alive_)] {
    if (!alive.expired()) count_down();
  });
}

void AuditLog::count_down() {
  if (--waiting_ > 0 || counted_ == 0) return;
  write_count();
}

void AuditLog::write_count() {
  last_.detail = fmt::format("{} more that came faster than they could be written, the last of them this", counted_);
  counted_ = 0;
  write(std::exchange(last_, {}));
}

}  // namespace veneer::daemon
