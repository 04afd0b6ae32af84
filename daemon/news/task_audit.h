// What came of long work, for the audit log: who asked for it, and how it ended. The router notes the request before
// the work begins; a second row follows at its end: "api.scan.done" with what is new (panel P-0007), ".failed" with the
// sentence, or ".cancelled".
//
// Bound to the reactor. What it is given outlives it.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "daemon/api/tasks.h"
#include "daemon/store/audit_log.h"

namespace veneer::daemon {

class TaskAudit {
 public:
  TaskAudit(TaskRegistry& tasks, AuditLog& log) : tasks_(tasks), log_(log) {}

  // An operation ("scan") was answered with this task, which may be over by then.
  void began(std::int64_t task, std::string who, std::string operation);
  // To be told of every change of a task; looks at its end only.
  void changed(const TaskView& task);

 private:
  struct Asked {
    std::string who, operation;
  };
  TaskRegistry& tasks_;
  AuditLog& log_;
  std::map<std::int64_t, Asked> under_way_;
};

}  // namespace veneer::daemon
