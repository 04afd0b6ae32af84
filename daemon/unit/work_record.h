// That something is under way is on the disk before anything moves for it, so that a start after a kill finds the cell
// Aborted, whatever was being done (db::JobStore::note_under_way).
//
// Threading: bound to the reactor.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/ids.h"
#include "base/result.h"
#include "daemon/store/database_thread.h"

namespace veneer::daemon {

class WorkRecord {
 public:
  enum class Work { kHoming, kJog, kJob, kActivity };
  using Reply = std::function<void(Status)>;
  explicit WorkRecord(DatabaseThread& database) : database_(&database) {}

  bool any() const { return !under_way_.empty(); }
  // `doing` is under way, as in "while the laser was homed"; what was so before is so again when this has ended.
  // `written` comes on the reactor: where it was refused nothing may move for it, and end() is to be called.
  void begin(Work work, const std::string& doing, Reply written);
  // What was begun of this kind has ended, or was refused. It is written as soon as the disk takes it; until then a
  // start finds what has ended, and is Aborted for nothing.
  void end(Work work);
  void end_all();
  // An operator, `who`, stops a job while it waits: it ends with the work for it, in one write, or not at all. One that
  // never ran stays planned. Nothing else begins before that is written.
  void end_job(JobId job, const std::string& who);
  // All that is under way ends with something that others write.
  class End {
   public:
    // On the database's thread: is the cell at rest once that is written? Not when newer work is on record.
    bool rests() const { return *newest_ < number_; }
    void written() const {
      if (rests()) *newest_ = number_;
    }

   private:
    friend class WorkRecord;
    End(std::int64_t number, std::shared_ptr<std::int64_t> newest) : number_(number), newest_(std::move(newest)) {}
    std::int64_t number_;
    std::shared_ptr<std::int64_t> newest_;
  };
  End end_all_with();
  // An abort is owed to the database, which ends it all. Nothing else begins before it is written, or it would end
  // that.
  void forget();

 private:
  struct UnderWay {
    Work work;
    std::string doing;
  };
  std::string newest_doing() const { return under_way_.empty() ? std::string() : under_way_.back().doing; }
  void write_newest();

  DatabaseThread* database_;
  std::vector<UnderWay> under_way_;  // the newest last
  // What is tried again may be overtaken by what was written since, and must not be written then: the number of the
  // newest that is written. On the database's thread.
  std::shared_ptr<std::int64_t> written_ = std::make_shared<std::int64_t>(0);
  std::int64_t last_ = 0;
  std::int64_t awaited_ = 0;  // of the last forget() or end_job(): nothing begins before it is written
};

}  // namespace veneer::daemon
