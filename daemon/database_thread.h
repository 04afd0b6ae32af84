// The one thread that owns the database connection and all writes.
//
// call() waits and belongs to workers; async() belongs to the reactor: `work` runs on the database thread, `then` back
// on the reactor with its result, which is an error where `work` threw and its result can be one.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "daemon/workers/worker.h"
#include "db/audit.h"
#include "db/certificates.h"
#include "db/database.h"
#include "db/job_store.h"
#include "db/ledger.h"
#include "db/materials.h"
#include "db/panels.h"
#include "db/plans.h"
#include "db/request_keys.h"

namespace veneer::daemon {

// The devices of the cell as they name themselves; certificates made on others are void. "" = any.
struct CellDevices {
  std::string scanner, camera, laser;
};

// What a piece of work on the database thread may touch.
struct Repositories {
  explicit Repositories(db::Database& database)
      : panels(database),
        ledger(database),
        jobs(database),
        certificates(database),
        materials(database),
        audit(database),
        request_keys(database),
        plans(database) {}
  db::Panels panels;
  db::Ledger ledger;
  db::JobStore jobs;
  db::Certificates certificates;
  db::Materials materials;
  db::Audit audit;
  db::RequestKeys request_keys;
  db::Plans plans;
  CellDevices devices;
};

class DatabaseThread {
 public:
  // Opens the file on its own thread; fails as db::Database::open does.
  static Result<std::unique_ptr<DatabaseThread>> open(const std::filesystem::path& file,
                                                      boost::asio::io_context& reactor);

  template <class F>
  auto call(F work) {
    return worker_.call([&] { return work(*repositories_); });
  }
  template <class F, class Then>
  void async(F work, Then then) {
    worker_.post([this, work = std::move(work), then = std::move(then)]() mutable {
      const auto asked = [&] { return work(*repositories_); };
      boost::asio::post(reactor_,
                        [result = caught(asked), then = std::move(then)]() mutable { then(std::move(result)); });
    });
  }

  explicit DatabaseThread(boost::asio::io_context& reactor) : reactor_(reactor), worker_("database") {}
  ~DatabaseThread();

 private:
  boost::asio::io_context& reactor_;
  // Both live and die on the worker.
  std::optional<db::Database> database_;
  std::optional<Repositories> repositories_;
  Worker worker_;
};

}  // namespace veneer::daemon
