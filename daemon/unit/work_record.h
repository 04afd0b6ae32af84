// That something is under way is on the disk before anything moves for it, so that a start after a kill finds the cell
// Aborted, whatever was being done (db::JobStore::note_under_way).
//
// Threading: bound to the reactor.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

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
  // An abort is owed to the database, which ends it all. Nothing else begins before it is written, or it would end
  // that.
  void forget();

 private:
  struct UnderWay {
    Work work;
    std::string doing;
  };
  void write_newest();

  DatabaseThread* database_;
  std::vector<UnderWay> under_way_;  // the newest last
  // What is tried again may be overtaken by what was written since, and must not be written then: the number of the
  // newest that is written. On the database's thread.
  std::shared_ptr<std::int64_t> written_ = std::make_shared<std::int64_t>(0);
  std::int64_t last_ = 0, forgotten_ = 0;  // forgotten_: of the last forget()
};

}  // namespace veneer::daemon
