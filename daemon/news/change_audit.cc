#include "daemon/news/change_audit.h"

#include <fmt/format.h>

#include <boost/asio/post.hpp>
#include <utility>

#include "base/clock.h"
#include "base/journal.h"

namespace veneer::daemon {

ChangeAudit::ChangeAudit(Parts parts, std::function<void(std::int64_t task, const Caller& by)> on_task, Logger log)
    : p_(parts), on_task_(std::move(on_task)), log_(std::move(log)) {}

Status ChangeAudit::may_be_noted(const Caller& caller) const {
  if (p_.audit.has_room(caller.who)) return Ok();
  return Error{ErrorCode::kUnavailable, "too many changes at once for the audit log: wait a second and try again"};
}

void ChangeAudit::note(const Router::Change& change) {
  if (std::this_thread::get_id() != reactor_thread_)
    return boost::asio::post(p_.reactor, [this, alive = std::weak_ptr<int>(alive_), caller = change.caller,
                                          operation = std::string(change.operation), detail = change.detail,
                                          refused = change.refused, task = change.task, failed = change.failed] {
      if (!alive.expired()) note({caller, operation, detail, refused, task, failed});
    });
  if (change.task) {
    on_task_(*change.task, change.caller);
    return p_.tasks.began(*change.task, change.caller.who, std::string(change.operation));
  }
  const LogAbout about({.who = change.caller.who});
  if (change.caller.role >= Role::kOperator)
    log_->info("{}: {}{}{}{}", change.caller.who, change.operation,
               change.refused  ? " was refused"
               : change.failed ? " failed"
                               : "",
               change.detail.empty() ? "" : ", ", change.detail);
  db::AuditEntry entry{0, utc_timestamp(), change.caller.who,
                       fmt::format("api.{}{}", change.operation,
                                   change.refused  ? ".refused"
                                   : change.failed ? ".failed"
                                                   : ""),
                       change.detail};
  if (change.caller.role < Role::kOperator) return p_.audit.write_or_count(std::move(entry));
  p_.audit.write(std::move(entry));
}

Status ChangeAudit::note_now(const std::string& who, const std::string& what, const std::string& detail) const {
  const LogAbout about({.who = who});
  log_->info("{}: {}, {}", who, what, detail);
  return p_.database.call([&](Repositories& r) { return r.audit.append({0, utc_timestamp(), who, what, detail}); });
}

}  // namespace veneer::daemon
