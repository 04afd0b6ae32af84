#include "daemon/store/audit_log.h"

#include <fmt/format.h>

#include <utility>

namespace veneer::daemon {

AuditLog::AuditLog(DatabaseThread& database, Logger log) : database_(database), log_(std::move(log)) {}

AuditLog::~AuditLog() {
  if (counted_ > 0) write_count();
  write_kept();
}

void AuditLog::post(const db::AuditEntry& entry, std::function<void()> then) {
  ++waiting_of_[entry.who];
  database_.async(
      [entry](Repositories& r) { return r.audit.append(entry); },
      [this, alive = std::weak_ptr<int>(alive_), log = log_, entry, then = std::move(then)](const Status& written) {
        if (!written)
          log->error("what {} did ({}) could not be written into the audit log: {}", entry.who, entry.what,
                     written.error().message);
        if (!alive.expired()) {
          if (const auto of = waiting_of_.find(entry.who); --of->second == 0) waiting_of_.erase(of);
          written ? write_kept() : keep(entry);
        }
        if (then) then();
      });
}

void AuditLog::keep(const db::AuditEntry& entry) {
  if (kept_.size() < kMostKept) kept_.push_back(entry);
}

void AuditLog::write_kept() {
  for (const db::AuditEntry& entry : std::exchange(kept_, {})) post(entry, {});
}

bool AuditLog::has_room(const std::string& who) const {
  const auto of = waiting_of_.find(who);
  return of == waiting_of_.end() || of->second < kMostOfOne;
}

void AuditLog::write(db::AuditEntry entry) {
  if (!has_room(entry.who)) return write_or_count(std::move(entry));
  post(entry, {});
}

void AuditLog::write_or_count(db::AuditEntry entry) {
  // Once some are counted, the others are too until all that waits is written: so their number is told in one row.
  if (counted_ > 0 || waiting_ >= kMostWaiting) {
    ++counted_;
    last_ = std::move(entry);
    return;
  }
  ++waiting_;
  post(entry, [this, alive = std::weak_ptr<int>(alive_)] {
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
