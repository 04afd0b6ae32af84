// The one thread that owns the database connection and all writes.
//
// call() waits and belongs to workers; async() belongs to the reactor: `work` runs on the database thread, `then` back
// on the reactor with its result, which is an error where `work` threw and its result can be one.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>

#include "daemon/threads/worker.h"
#include "db/accounts.h"
#include "db/audit.h"
#include "db/certificates.h"
#include "db/database.h"
#include "db/differences.h"
#include "db/job_store.h"
#include "db/later_scans.h"
#include "db/leases.h"
#include "db/ledger.h"
#include "db/masks.h"
#include "db/materials.h"
#include "db/panels.h"
#include "db/plans.h"
#include "db/proposals.h"
#include "db/remnant_book.h"
#include "db/request_keys.h"
#include "db/stock_facts.h"

namespace veneer::daemon {

// The devices of the cell as they name themselves; certificates made on others are void. "" = any.
struct CellDevices {
  std::string scanner, camera, laser;
};

// Was that the last word on a write? A store refuses what was done already or can never be done; what the disk or
// another program refuses is of the moment.
inline bool has_settled(ErrorCode code) {
  return code == ErrorCode::kConflict || code == ErrorCode::kNotFound || code == ErrorCode::kInvalidArgument;
}

// What a piece of work on the database thread may touch.
struct Repositories {
  explicit Repositories(db::Database& database)
      : connection(database),
        panels(database),
        ledger(database),
        jobs(database),
        certificates(database),
        materials(database),
        audit(database),
        request_keys(database),
        plans(database),
        leases(database),
        differences(database),
        facts(database),
        proposals(database),
        masks(database),
        accounts(database),
        remnants(database),
        later_scans(database) {}
  db::Database& connection;  // of them all: db::at_one_moment(r.connection, ...)
  db::Panels panels;
  db::Ledger ledger;
  db::JobStore jobs;
  db::Certificates certificates;
  db::Materials materials;
  db::Audit audit;
  db::RequestKeys request_keys;
  db::Plans plans;
  db::Leases leases;
  db::Differences differences;
  db::StockFacts facts;
  db::Proposals proposals;
  db::Masks masks;
  db::Accounts accounts;
  db::RemnantBook remnants;
  db::LaterScans later_scans;
  CellDevices devices;
};

// A connection of its own that only reads, for a thread that may wait: it sees the last commit and delays no write.
class DatabaseReader {
 public:
  static Result<std::unique_ptr<DatabaseReader>> open(const std::filesystem::path& file, const CellDevices& devices);
  explicit DatabaseReader(db::Database&& database) : database_(std::move(database)), repositories_(database_) {}
  DatabaseReader(const DatabaseReader&) = delete;
  DatabaseReader& operator=(const DatabaseReader&) = delete;
  Repositories& repositories() { return repositories_; }
  // What `question`, which gives a Result, asks of them, it is told of one moment.
  template <class F>
  std::invoke_result_t<F, Repositories&> at_one_moment(F&& question) {
    return db::at_one_moment(database_, [&] { return question(repositories_); });
  }

 private:
  db::Database database_;
  Repositories repositories_;
};

class DatabaseThread {
 public:
  // Opens the file on its own thread; fails as db::Database::open does.
  static Result<std::unique_ptr<DatabaseThread>> open(const std::filesystem::path& file,
                                                      boost::asio::io_context& reactor);
  // The same as db::Database::open_unchecked does: while needs_check() every write is refused.
  static Result<std::unique_ptr<DatabaseThread>> open_unchecked(const std::filesystem::path& file,
                                                                boost::asio::io_context& reactor);
  // As it was opened; check() is to be called then.
  bool needs_check() const { return needs_check_; }
  // Reads the whole file on this thread, before whatever is asked of it later. `then` runs on the reactor: with
  // kStorage when it is damaged, and every write is refused for good, with kCancelled after cancel_check().
  void check(std::function<void(const Status&)> then);
  void cancel_check() { checking_.request_stop(); }
  // The file was found damaged: writes end for good, and it is not marked as clean. From any thread; it holds for
  // whatever is asked of the database later.
  void distrust(const Error& why);
  // A check on another connection that began after so many doubts (db::Database::doubts) has found nothing.
  void dispel(int doubts);
  // Whether rows may be written, as db::Database::may_write says, on the reactor.
  void ask_may_write(std::function<void(const Status&)> then);
  // On the reactor, why the file has to be checked now (db::Database::take_doubt). Before any work is asked for.
  void on_doubt(std::function<void(const std::string& why)> told) { on_doubt_ = std::move(told); }

  // Whose certificates count. Before any other thread asks.
  void set_devices(const CellDevices& devices);
  // Fails as db::Database::open_for_reading does. From any thread.
  Result<std::unique_ptr<DatabaseReader>> open_reader() const { return DatabaseReader::open(file_, devices_); }

  template <class F>
  auto call(F work) {
    return worker_.call([&] {
      const Doubts doubts(*this);
      pay();
      return work(*repositories_);
    });
  }
  // What `question` tells of the last commit, all of it of one moment, asked on the caller's thread through `mine`, a
  // connection of its own that is opened once: no write waits for it, and what was asked for before is seen. Waits for
  // that: never from the reactor. What fails there is asked of call(), which doubts the file where it is damaged.
  template <class F>
  std::invoke_result_t<F, Repositories&> read(std::unique_ptr<DatabaseReader>& mine, F question) {
    worker_.call([] {});
    if (!mine)
      if (auto opened = open_reader()) mine = std::move(*opened);
    if (mine)
      if (auto answer = caught([&] { return mine->at_one_moment(question); })) return answer;
    return call(question);
  }
  template <class F, class Then>
  void async(F work, Then then) {
    worker_.post([this, work = std::move(work), then = std::move(then)]() mutable {
      const auto asked = [&] {
        const Doubts doubts(*this);
        pay();
        return work(*repositories_);
      };
      boost::asio::post(reactor_,
                        [result = caught(asked), then = std::move(then)]() mutable { then(std::move(result)); });
    });
  }

  // On the database's thread: why the last write that is owed, and is not written yet, was refused.
  const std::string& why_owed() const { return why_owed_; }
  // A write that nobody waits for and that must not be lost: what the disk or another program refuses is tried again
  // before whatever is asked of the database later, until it is written, or said never to be (has_settled). The end of
  // the process ends that too, and its next start recovers. `tried`: on the reactor, after the first attempt;
  // `settled`: there as well, with the last word on it.
  void owe(std::function<Status(Repositories&)> write, std::function<void()> tried = {},
           std::function<void(const Status&)> settled = {});

  explicit DatabaseThread(boost::asio::io_context& reactor) : reactor_(reactor), worker_("database") {}
  ~DatabaseThread();

 private:
  static Result<std::unique_ptr<DatabaseThread>> open(boost::asio::io_context& reactor,
                                                      const std::function<Result<db::Database>()>& open_file);

  // What came up in a piece of work goes to the reactor at its end, before its result.
  struct Doubts {
    explicit Doubts(DatabaseThread& of) : thread(of) {}
    Doubts(const Doubts&) = delete;
    Doubts& operator=(const Doubts&) = delete;
    ~Doubts() { thread.tell_doubt(); }
    DatabaseThread& thread;
  };
  void tell_doubt() noexcept;
  void pay();  // what is owed, in its order

  boost::asio::io_context& reactor_;
  std::filesystem::path file_;
  CellDevices devices_;
  bool needs_check_ = false;
  std::function<void(const std::string&)> on_doubt_;
  std::stop_source checking_;
  // They live and die on the worker.
  std::optional<db::Database> database_;
  std::optional<Repositories> repositories_;
  struct Owed {
    std::function<Status(Repositories&)> write;
    std::function<void(const Status&)> settled;
  };
  std::deque<Owed> owed_;
  std::string why_owed_;  // on the database's thread
  Worker worker_;
};

}  // namespace veneer::daemon
