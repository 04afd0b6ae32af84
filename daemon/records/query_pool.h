// Answers to questions: read-only work for a client that waits, off the reactor and beside the one thread that writes.
//
// Every thread has a read-only connection of its own and sees the last commit; nothing it does delays a write. Whatever
// a GET asks, it is told of one moment, so that its figures agree; other methods see what they had written. While that
// moment lasts the log beside the database only grows: what takes long, as pictures do, is made when it is over. What
// is built and serialised for a client is built here. The work is bounded: what waits for a client that has gone is
// dropped, and a client that finds the queue full gets 503 with Retry-After. Operators have a queue of their own, which
// goes first, and the last free thread of several is theirs, so that a crowd of viewers never shuts them out.
//
// Thread-safe.
#pragma once

#include <array>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "base/result.h"
#include "daemon/api/api_message.h"
#include "daemon/store/database_thread.h"

namespace veneer::daemon {

class QueryPool {
 public:
  struct Options {
    std::string name;  // of its threads, at most 13 characters
    int threads = 1;
    int nice = 0;
    std::size_t max_waiting = 32;  // of viewers, and as many of operators
    CellDevices devices = {};
  };
  // What is made of what was asked, once the moment is over: for what decodes or draws. What it asks itself it is told
  // of as many moments as it asks questions.
  using Making = std::function<ApiReply(Repositories&)>;
  using Answer = std::variant<ApiReply, Making>;
  // Runs on one of the threads. It may look at request.gone (copied by whoever made it) when it takes long.
  using Work = std::function<Answer(Repositories&)>;

  // Fails as db::Database::open_for_reading does.
  static Result<std::unique_ptr<QueryPool>> open(const std::filesystem::path& file, Options options);
  ~QueryPool() { close(); }
  QueryPool(const QueryPool&) = delete;
  QueryPool& operator=(const QueryPool&) = delete;

  // A 200 gets an ETag of its content, unless the work gave one, and becomes a 304 when the client has it already.
  void ask(const ApiRequest& request, Reply reply, Work work);
  // Drops what waits, ends what is under way, and joins; later questions are dropped.
  void close();
  // What waits, for clients that are still there.
  std::size_t waiting() const;

 private:
  struct Question {
    std::stop_token gone;
    bool only_reads = false;
    std::string if_none_match;
    Reply reply;
    Work work;
  };
  enum Lane { kOperators, kViewers, kLanes };

  explicit QueryPool(Options options) : options_(std::move(options)) {}
  void run(int number, db::Database database);
  bool take(std::unique_lock<std::mutex>& lock, Question& next, Lane& lane);
  static ApiReply worked(const Question& question, Repositories& repositories);
  static ApiReply made(const Question& question, Repositories& repositories);
  static void answer(Question question, Repositories& repositories);
  static void forget_gone(std::deque<Question>& lane);

  const Options options_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::array<std::deque<Question>, kLanes> lanes_;  // guarded by mutex_
  int busy_with_viewers_ = 0;                       // guarded by mutex_
  bool stopping_ = false;                           // guarded by mutex_
  std::vector<std::thread> threads_;
};

}  // namespace veneer::daemon
