#include "daemon/records/query_pool.h"

#include <pthread.h>

#include <span>

#include "base/hash.h"
#include "daemon/threads/thread_priority.h"

namespace veneer::daemon {
namespace {

std::string etag_of(const std::string& body) {
  return "\"" + sha256_hex(std::as_bytes(std::span(body))).substr(0, 32) + "\"";
}

}  // namespace

Result<std::unique_ptr<QueryPool>> QueryPool::open(const std::filesystem::path& file, Options options) {
  std::vector<db::Database> connections;
  for (int i = 0; i < options.threads; ++i) {
    auto database = db::Database::open_for_reading(file);
    if (!database) return database.error();
    connections.push_back(std::move(*database));
  }
  auto pool = std::unique_ptr<QueryPool>(new QueryPool(std::move(options)));
  for (int i = 0; i < pool->options_.threads; ++i)
    pool->threads_.emplace_back(
        [&pool = *pool, i, connection = std::move(connections[static_cast<std::size_t>(i)])]() mutable {
          pool.run(i, std::move(connection));
        });
  return pool;
}

void QueryPool::close() {
  std::array<std::deque<Question>, kLanes> dropped;  // their replies run without the lock
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    lanes_.swap(dropped);
  }
  wake_.notify_all();
  for (auto& thread : threads_)
    if (thread.joinable()) thread.join();
}

void QueryPool::forget_gone(std::deque<Question>& lane) {
  std::erase_if(lane, [](const Question& question) { return question.gone.stop_requested(); });
}

void QueryPool::ask(const ApiRequest& request, Reply reply, Work work) {
  {
    const std::lock_guard lock(mutex_);
    if (stopping_) return;
    auto& lane = lanes_[request.caller.role >= Role::kOperator ? kOperators : kViewers];
    if (lane.size() >= options_.max_waiting) forget_gone(lane);
    if (lane.size() < options_.max_waiting) {
      lane.push_back({request.gone, request.method == "GET", request.if_none_match, std::move(reply), std::move(work)});
      reply = nullptr;
    }
  }
  if (reply) return reply(ApiReply::busy("too many questions wait for an answer"));
  wake_.notify_one();
}

std::size_t QueryPool::waiting() const {
  const std::lock_guard lock(mutex_);
  std::size_t count = 0;
  for (const auto& lane : lanes_)
    for (const auto& question : lane) count += question.gone.stop_requested() ? 0U : 1U;
  return count;
}

// False when it is time to end.
bool QueryPool::take(std::unique_lock<std::mutex>& lock, Question& next, Lane& lane) {
  const auto viewers_may = [this] {
    return !lanes_[kViewers].empty() && (options_.threads == 1 || busy_with_viewers_ < options_.threads - 1);
  };
  wake_.wait(lock, [&] { return stopping_ || !lanes_[kOperators].empty() || viewers_may(); });
  if (stopping_) return false;
  lane = lanes_[kOperators].empty() ? kViewers : kOperators;
  next = std::move(lanes_[lane].front());
  lanes_[lane].pop_front();
  if (lane == kViewers) ++busy_with_viewers_;
  return true;
}

void QueryPool::run(int number, db::Database database) {
  pthread_setname_np(pthread_self(), (options_.name + " " + std::to_string(number)).substr(0, 15).c_str());
  set_thread_nice(options_.nice);  // without the right to it they are merely less polite
  Repositories repositories(database);
  repositories.devices = options_.devices;
  std::unique_lock lock(mutex_);
  Question next;
  Lane lane = kOperators;
  while (take(lock, next, lane)) {
    lock.unlock();
    answer(std::exchange(next, {}), repositories);
    lock.lock();
    if (lane == kViewers) --busy_with_viewers_;
    wake_.notify_one();
  }
}

ApiReply QueryPool::worked(const Question& question, Repositories& repositories) {
  const auto asked = [&]() -> Result<Answer> { return question.work(repositories); };
  Result<Answer> answer = question.only_reads ? db::at_one_moment(repositories.connection, asked) : asked();
  if (!answer) return ApiReply::error(answer.error());
  if (const auto* making = std::get_if<Making>(&*answer))
    return question.gone.stop_requested() ? ApiReply() : (*making)(repositories);  // it takes long, for nobody
  return std::get<ApiReply>(*std::move(answer));
}

ApiReply QueryPool::made(const Question& question, Repositories& repositories) {
  try {
    ApiReply reply = worked(question, repositories);
    if (reply.status != 200) return reply;
    if (reply.etag.empty()) reply.etag = etag_of(reply.body);
    if (!etag_matches(question.if_none_match, reply.etag)) return reply;
    ApiReply same = ApiReply::not_modified(reply.etag);
    same.headers = std::move(reply.headers);
    return same;
  } catch (...) {
    return ApiReply::error(error_of_exception());
  }
}

void QueryPool::answer(Question question, Repositories& repositories) {
  if (question.gone.stop_requested()) return;
  const Reply reply_to = std::move(question.reply);
  try {
    reply_to(made(question, repositories));
  } catch (...) {
    // There is no memory left to say so: the client's connection ends by its own deadline.
  }
}

}  // namespace veneer::daemon
