// Who changed what over the API, for the audit log and the log: as the router tells it, before what the change itself
// writes. What comes of long work follows at its end (task_audit.h).
//
// Threading: as its functions say. What it is given outlives it.
#pragma once

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "base/log.h"
#include "base/result.h"
#include "daemon/api/router.h"
#include "daemon/news/task_audit.h"
#include "daemon/store/audit_log.h"
#include "daemon/store/database_thread.h"

namespace veneer::daemon {

class ChangeAudit {
 public:
  struct Parts {
    boost::asio::io_context& reactor;
    DatabaseThread& database;
    AuditLog& audit;
    TaskAudit& tasks;
  };
  // Made on the reactor's thread. `on_task` is told of every task that a change began.
  ChangeAudit(Parts parts, std::function<void(std::int64_t task, const Caller& by)> on_task, Logger log);

  // Of the reactor or of the pools, which answer some requests themselves: then it is noted in the reactor's turn.
  void note(const Router::Change& change);
  // What is about to be done, in words of its own; it is written when this returns. Never on the reactor.
  Status note_now(const std::string& who, const std::string& what, const std::string& detail) const;
  // kUnavailable while so many changes of this caller wait to be written that a run would have to wait behind them. On
  // the reactor.
  Status may_be_noted(const Caller& caller) const;

 private:
  const Parts p_;
  std::function<void(std::int64_t task, const Caller& by)> on_task_;
  Logger log_;
  const std::thread::id reactor_thread_ = std::this_thread::get_id();
  const std::shared_ptr<int> alive_ = std::make_shared<int>();
};

}  // namespace veneer::daemon
