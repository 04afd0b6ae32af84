// Questions beside the thread that writes: what waits, who goes first, and what becomes of it when nobody listens.
#include "daemon/records/query_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <vector>

#include "tests/support/temp_directory.h"
#include "tests/support/whole_checkpoint.h"

namespace veneer::daemon {
namespace {

// A question that holds its thread until it is let go.
class Blocked {
 public:
  ApiReply made(Repositories&) {
    begun_.set_value();
    released_.get_future().wait();
    return ApiReply::json({{"late", true}});
  }
  QueryPool::Work work() {
    return [this](Repositories& r) { return made(r); };
  }
  void await() { begun_.get_future().wait(); }
  void release() { released_.set_value(); }

 private:
  std::promise<void> begun_, released_;
};

class QueryPoolTest : public ::testing::Test {
 protected:
  QueryPoolTest() : database(*DatabaseThread::open(directory / "veneerd.db", reactor)) {}

  std::unique_ptr<QueryPool> open(int threads, std::size_t max_waiting = 32) {
    return *QueryPool::open(directory / "veneerd.db", {"test", threads, 0, max_waiting});
  }
  static ApiRequest from(Role role, const std::stop_token& gone = {}) {
    ApiRequest request;
    request.caller.role = role;
    request.gone = gone;
    return request;
  }
  Reply keep() {
    return [this](ApiReply reply) {
      const std::lock_guard lock(mutex);
      replies.push_back(std::move(reply));
    };
  }
  static ApiReply wait_for(QueryPool& pool, const ApiRequest& request, QueryPool::Work work) {
    const auto reply = std::make_shared<std::promise<ApiReply>>();
    auto came = reply->get_future();
    pool.ask(
        request, [reply](ApiReply made) { reply->set_value(std::move(made)); }, std::move(work));
    return came.get();
  }
  static ApiReply count_jobs(Repositories& r) {
    auto list = r.jobs.list();
    return list ? ApiReply::json({{"jobs", list->size()}}) : ApiReply::error(list.error());
  }

  testing::TempDirectory directory;
  boost::asio::io_context reactor;
  std::unique_ptr<DatabaseThread> database;
  std::mutex mutex;
  std::vector<ApiReply> replies;
};

TEST_F(QueryPoolTest, MakesNothingForWhoHasGoneMeanwhile) {
  auto pool = open(1);
  for (const bool goes : {false, true}) {
    std::stop_source gone;
    std::atomic<bool> made = false;
    wait_for(*pool, from(Role::kViewer, gone.get_token()), [&](Repositories&) -> QueryPool::Answer {
      if (goes) gone.request_stop();
      return [&](Repositories&) {
        made = true;
        return ApiReply();
      };
    });
    EXPECT_EQ(made, !goes);
  }
}

TEST_F(QueryPoolTest, ABlockedReaderDelaysNoWriteAndSeesOnlyWhatIsCommitted) {
  Blocked blocked;  // outlives the pool, which may still be running it
  auto pool = open(1);
  pool->ask(from(Role::kViewer), keep(), blocked.work());
  blocked.await();
  // Returns although the only reader is held.
  const Status written = database->call([](Repositories& r) {
    return r.audit.append({0, "2026-05-01T07:30:00.000Z", "uid 1000", "test", ""});
  });
  EXPECT_TRUE(written.ok());
  blocked.release();
  const ApiReply seen = wait_for(*pool, from(Role::kViewer), [](Repositories& r) {
    auto latest = r.audit.latest(10);
    return ApiReply::json({{"entries", latest ? latest->size() : 0}});
  });
  EXPECT_EQ(nlohmann::json::parse(seen.body)["entries"], 1);
}

// How many entries the audit log has, and how many after one more was written.
QueryPool::Work before_and_after(DatabaseThread& writing) {
  return [&writing](Repositories& r) {
    const auto before = r.audit.latest(10);
    const Status written = writing.call([](Repositories& w) {
      return w.audit.append({0, "2026-05-01T07:30:00.000Z", "uid 1000", "test", ""});
    });
    const auto after = r.audit.latest(10);
    if (!before || !written || !after) return ApiReply::error({ErrorCode::kInternal, "not written"});
    return ApiReply::json({{"before", before->size()}, {"after", after->size()}});
  };
}

TEST_F(QueryPoolTest, AQuestionIsToldOfOneMoment) {
  auto pool = open(1);
  ApiRequest question = from(Role::kViewer);
  question.method = "GET";
  for (int entries : {0, 1}) {
    const auto seen = nlohmann::json::parse(wait_for(*pool, question, before_and_after(*database)).body);
    EXPECT_EQ(seen["before"], entries);
    EXPECT_EQ(seen["after"], entries);
  }
}

TEST_F(QueryPoolTest, WhatIsMadeOfAnAnswerKeepsTheLogFromBeingEmptiedNoLonger) {
  Blocked asking, making;
  auto pool = open(2);
  ApiRequest question = from(Role::kOperator);
  question.method = "GET";
  const auto count_and = [](Blocked& then) { return [&then](Repositories& r) { return count_jobs(r), then.made(r); }; };
  pool->ask(question, keep(), count_and(asking));
  asking.await();
  EXPECT_FALSE(testing::checkpoint_completes(*database)) << "it is told of one moment";
  asking.release();
  pool->ask(question, keep(), [&](Repositories& r) -> QueryPool::Answer {
    return count_jobs(r), QueryPool::Making([&](Repositories& later) { return making.made(later); });
  });
  making.await();
  EXPECT_TRUE(testing::checkpoint_completes(*database));
  making.release();
  pool->close();
  ASSERT_EQ(replies.size(), 2U);
  for (const ApiReply& reply : replies) EXPECT_EQ(reply.status, 200);
}

TEST_F(QueryPoolTest, AChangeSeesWhatItHadWritten) {
  auto pool = open(1);
  ApiRequest change = from(Role::kOperator);
  change.method = "POST";
  const auto seen = nlohmann::json::parse(wait_for(*pool, change, before_and_after(*database)).body);
  EXPECT_EQ(seen["before"], 0);
  EXPECT_EQ(seen["after"], 1);
}

TEST_F(QueryPoolTest, AReaderCannotWrite) {
  auto pool = open(1);
  const ApiReply refused = wait_for(*pool, from(Role::kAdmin), [](Repositories& r) {
    const Status written = r.audit.append({0, "2026-05-01T07:30:00.000Z", "uid 1000", "test", ""});
    return written ? ApiReply::json({{"written", true}}) : ApiReply::error(written.error());
  });
  EXPECT_EQ(refused.status, 500) << refused.body;
}

TEST_F(QueryPoolTest, FortyEightClientsThatHangUpLeaveNoWork) {
  Blocked blocked;  // outlives the pool, which may still be running it
  auto pool = open(1, 64);
  pool->ask(from(Role::kViewer), keep(), blocked.work());
  blocked.await();
  std::atomic<int> done{0};
  std::vector<std::stop_source> clients(48);
  for (const auto& client : clients)
    pool->ask(from(Role::kViewer, client.get_token()), keep(), [&](Repositories& r) {
      ++done;
      return count_jobs(r);
    });
  EXPECT_EQ(pool->waiting(), 48U);
  for (auto& client : clients) client.request_stop();
  EXPECT_EQ(pool->waiting(), 0U);
  blocked.release();
  EXPECT_EQ(wait_for(*pool, from(Role::kViewer), count_jobs).status, 200);
  EXPECT_EQ(done, 0);
}

TEST_F(QueryPoolTest, AFullQueueSaysWhenToAskAgainAndMakesRoomOfThoseWhoWent) {
  Blocked blocked;  // outlives the pool, which may still be running it
  auto pool = open(1, 4);
  pool->ask(from(Role::kViewer), keep(), blocked.work());
  blocked.await();
  std::stop_source client;
  for (int i = 0; i < 4; ++i) pool->ask(from(Role::kViewer, client.get_token()), keep(), count_jobs);
  const ApiReply full = wait_for(*pool, from(Role::kViewer), count_jobs);
  EXPECT_EQ(full.status, 503);
  EXPECT_EQ(full.headers, (std::vector<std::pair<std::string, std::string>>{{"Retry-After", "1"}}));
  client.request_stop();
  pool->ask(from(Role::kViewer), keep(), count_jobs);
  EXPECT_EQ(pool->waiting(), 1U);
  blocked.release();
}

TEST_F(QueryPoolTest, ACrowdOfViewersNeverShutsOutAnOperator) {
  Blocked blocked;  // outlives the pool, which may still be running it
  auto pool = open(2, 8);
  pool->ask(from(Role::kViewer), keep(), blocked.work());
  blocked.await();
  for (int i = 0; i < 100; ++i) pool->ask(from(Role::kViewer), keep(), count_jobs);
  EXPECT_EQ(pool->waiting(), 8U) << "the second thread is not for viewers";
  EXPECT_EQ(wait_for(*pool, from(Role::kOperator), count_jobs).status, 200);
  EXPECT_EQ(pool->waiting(), 8U);
  blocked.release();
}

TEST_F(QueryPoolTest, WhatTheClientHasAlreadyIsNotSentAgain) {
  auto pool = open(1);
  ApiRequest request = from(Role::kViewer);
  const ApiReply first = wait_for(*pool, request, count_jobs);
  ASSERT_FALSE(first.etag.empty());
  request.if_none_match = "\"other\", W/" + first.etag;
  const ApiReply again = wait_for(*pool, request, count_jobs);
  EXPECT_EQ(again.status, 304);
  EXPECT_EQ(again.etag, first.etag);
  EXPECT_TRUE(again.body.empty());
  request.if_none_match = "\"other\"";
  EXPECT_EQ(wait_for(*pool, request, count_jobs).status, 200);
}

TEST_F(QueryPoolTest, AnAnswerThatCannotBeMadeCostsItselfOnly) {
  auto pool = open(1);
  const ApiReply failed =
      wait_for(*pool, from(Role::kViewer), [](Repositories&) -> ApiReply { throw std::bad_alloc(); });
  EXPECT_EQ(failed.status, 503) << failed.body;
  EXPECT_EQ(wait_for(*pool, from(Role::kViewer), count_jobs).status, 200);
}

TEST_F(QueryPoolTest, AReplyThatCannotBeSentCostsItselfOnly) {
  auto pool = open(1);
  pool->ask(
      from(Role::kViewer), [](const ApiReply&) { throw std::bad_alloc(); }, count_jobs);
  EXPECT_EQ(wait_for(*pool, from(Role::kViewer), count_jobs).status, 200);
}

TEST_F(QueryPoolTest, ClosingDropsWhatWaits) {
  Blocked blocked;  // outlives the pool, which may still be running it
  auto pool = open(1);
  pool->ask(from(Role::kViewer), keep(), blocked.work());
  blocked.await();
  std::atomic<int> done{0};
  for (int i = 0; i < 20; ++i)
    pool->ask(from(Role::kViewer), keep(), [&](Repositories& r) {
      ++done;
      return count_jobs(r);
    });
  auto closing = std::async(std::launch::async, [&] { pool->close(); });
  while (pool->waiting() > 0) std::this_thread::yield();
  blocked.release();
  closing.get();
  EXPECT_EQ(done, 0);
}

}  // namespace
}  // namespace veneer::daemon
