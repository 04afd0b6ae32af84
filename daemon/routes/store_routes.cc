// Backups of the cell.
#include <nlohmann/json.hpp>

#include "daemon/api/page.h"
#include "daemon/routes/cell_routes.h"
#include "daemon/routes/database_reply.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

json backups_json(const std::filesystem::path& backup_dir, const NamedPage& page) {
  json list = json::array();
  auto all = list_backups(backup_dir);
  const auto name = [](const ListedBackup& one) { return one.name; };
  const json next = cut_out_page(all, page, name, std::greater<>());  // newest first
  for (const ListedBackup& one : all) {
    const auto folder = backup_dir / one.name;
    list.push_back(one.manifest ? to_backup_json(folder, *one.manifest)
                                : json{{"name", one.name}, {"folder", folder.string()}, {"fault", one.fault}});
  }
  return {{"schema_version", 1}, {"folder", backup_dir.string()}, {"backups", std::move(list)}, {"next", next}};
}

Status answers(const BackupDisk& disk) {
  std::string silence = disk.silence();
  return silence.empty() ? Ok() : Status(Error{ErrorCode::kUnavailable, std::move(silence)});
}

}  // namespace

void bind_store_routes(Router& router, const StoreServices& s) {
  router.bind("makeBackup", [s](const ApiRequest&, const Reply& reply) {
    if (const Status may = answers(s.disk); !may) return reply(ApiReply::error(may.error()));
    const auto task = s.backups.make(s.tasks);
    reply(task ? ApiReply::task(*task) : ApiReply::error(task.error()));
  });
  router.bind("listBackups", [s](const ApiRequest& request, const Reply& reply) {
    auto query = RequestReader::query_of(request);
    const NamedPage page = read_named_page(query);
    if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
    if (const Status may = answers(s.disk); !may) return reply(ApiReply::error(may.error()));
    reply_from_query(
        s.lists, request,
        [folder = s.backups.place().backup_dir, page](Repositories&) -> Result<json> {
          return backups_json(folder, page);
        },
        reply);
  });
}

}  // namespace veneer::daemon
