// Backups that somebody asks for, one at a time, on a thread and a connection of their own: nothing that cuts waits for
// them.
//
// Bound to the reactor.
#pragma once

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>

#include "base/log.h"
#include "base/result.h"
#include "daemon/api/tasks.h"
#include "daemon/store/backup.h"
#include "daemon/threads/worker.h"

namespace veneer::daemon {

class BackupService {
 public:
  // `on_doubt` is called when a copy of the database was not as it was written.
  BackupService(boost::asio::io_context& reactor, BackupPlace place, Logger log, std::function<void()> on_doubt);
  ~BackupService();  // waits for the one under way, whose task must have been cancelled
  BackupService(const BackupService&) = delete;
  BackupService& operator=(const BackupService&) = delete;

  // A task. kConflict while another one is under way.
  Result<std::int64_t> make(TaskRegistry& tasks);
  const BackupPlace& place() const { return place_; }

 private:
  void end(const TaskReporter& task, const Result<MadeBackup>& made);

  boost::asio::io_context& reactor_;
  const BackupPlace place_;
  Logger log_;
  std::function<void()> on_doubt_;
  bool under_way_ = false;
  std::shared_ptr<int> alive_ = std::make_shared<int>(0);  // what comes back to the reactor holds it weakly
  Worker worker_{"backup", 10};
};

// {"name", "folder", "made_at", "bytes", "schema", "panels", "jobs", "pieces", "files", "missing": [file]}
nlohmann::json to_backup_json(const std::filesystem::path& folder, const BackupManifest& manifest);

}  // namespace veneer::daemon
