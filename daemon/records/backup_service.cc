#include "daemon/records/backup_service.h"

#include <boost/asio/post.hpp>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/clock.h"

namespace veneer::daemon {

BackupService::BackupService(boost::asio::io_context& reactor, BackupPlace place, Logger log,
                             std::function<void()> on_doubt)
    : reactor_(reactor), place_(std::move(place)), log_(std::move(log)), on_doubt_(std::move(on_doubt)) {}

BackupService::~BackupService() = default;

Result<std::int64_t> BackupService::make(TaskRegistry& tasks) {
  if (under_way_) return Error{ErrorCode::kConflict, "a backup is being made already: wait until that is done"};
  under_way_ = true;
  const TaskReporter task = tasks.start("backup", "copying the database");
  worker_.post([this, task, alive = std::weak_ptr<int>(alive_)] {
    auto made = caught([&] {
      return make_backup(place_, utc_timestamp(), task.stop_token(),
                         [&task](double fraction, const std::string& text) { task.progress(fraction, text); });
    });
    boost::asio::post(reactor_, [this, alive, task, made = std::move(made)] {
      if (!alive.expired()) end(task, made);
    });
  });
  return task.id();
}

void BackupService::end(const TaskReporter& task, const Result<MadeBackup>& made) {
  under_way_ = false;
  if (!made) {
    task.fail(made.error());
    if (made.error().code == ErrorCode::kRefused) on_doubt_();
    return;
  }
  const BackupManifest& manifest = made->manifest;
  if (!manifest.missing.empty())
    log_->warn("the backup {} lacks {} pictures that the database names, the first is {}", made->folder.string(),
               manifest.missing.size(), manifest.missing.front());
  nlohmann::json result = to_backup_json(made->folder, manifest);
  result["removed"] = made->removed;
  task.done(result);
}

nlohmann::json to_backup_json(const std::filesystem::path& folder, const BackupManifest& manifest) {
  return {{"name", folder.filename().string()},
          {"folder", folder.string()},
          {"made_at", manifest.made_at},
          {"bytes", manifest.bytes()},
          {"schema", manifest.schema},
          {"panels", manifest.panels},
          {"jobs", manifest.jobs},
          {"pieces", manifest.pieces},
          {"files", manifest.files.size()},
          {"missing", manifest.missing}};
}

}  // namespace veneer::daemon
