#include "daemon/database_thread.h"

namespace veneer::daemon {

Result<std::unique_ptr<DatabaseThread>> DatabaseThread::open(const std::filesystem::path& file,
                                                             boost::asio::io_context& reactor) {
  auto thread = std::make_unique<DatabaseThread>(reactor);
  const Status opened = thread->worker_.call([&]() -> Status {
    auto database = db::Database::open(file);
    if (!database) return database.error();
    thread->database_.emplace(std::move(*database));
    thread->repositories_.emplace(*thread->database_);
    return Ok();
  });
  if (!opened) return opened.error();
  return thread;
}

DatabaseThread::~DatabaseThread() {
  worker_.call([this] {
    repositories_.reset();
    database_.reset();
  });
}

}  // namespace veneer::daemon
