// Backups of the cell.
#include <nlohmann/json.hpp>

#include "daemon/routes/cell_routes.h"
#include "daemon/routes/database_reply.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

json backups_json(const std::filesystem::path& backup_dir) {
  json list = json::array();
  for (const ListedBackup& one : list_backups(backup_dir)) {
    const auto folder = backup_dir / one.name;
    list.push_back(one.manifest ? to_backup_json(folder, *one.manifest)
                                : json{{"name", one.name}, {"folder", folder.string()}, {"fault", one.fault}});
  }
  return {{"schema_version", 1}, {"folder", backup_dir.string()}, {"backups", std::move(list)}};
}

}  // namespace

void bind_store_routes(Router& router, const StoreServices& s) {
  router.bind("makeBackup", [s](const ApiRequest&, const Reply& reply) {
    const auto task = s.backups.make(s.tasks);
    reply(task ? ApiReply::task(*task) : ApiReply::error(task.error()));
  });
  router.bind("listBackups", [s](const ApiRequest& request, const Reply& reply) {
    reply_from_query(
        s.queries, request,
        [folder = s.backups.place().backup_dir](Repositories&) -> Result<json> { return backups_json(folder); }, reply);
  });
}

}  // namespace veneer::daemon
