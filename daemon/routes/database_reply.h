// Replies that the database gives.
#pragma once

#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/api/router.h"
#include "daemon/records/query_pool.h"
#include "daemon/store/database_thread.h"

namespace veneer::daemon {

inline ApiReply reply_of(const Result<nlohmann::json>& result) {
  return result ? ApiReply::json(*result) : ApiReply::error(result.error());
}

// A change: `work` runs on the database's thread and gives JSON or an error.
template <class F>
void reply_from_database(DatabaseThread& database, F work, Reply reply) {
  database.async(std::move(work),
                 [reply = std::move(reply)](const Result<nlohmann::json>& result) { reply(reply_of(result)); });
}

// A question: `work` reads on one of the pool's threads and gives JSON or an error.
template <class F>
void reply_from_query(QueryPool& queries, const ApiRequest& request, F work, const Reply& reply) {
  queries.ask(request, reply, [work = std::move(work)](Repositories& r) mutable { return reply_of(work(r)); });
}

}  // namespace veneer::daemon
