// Requests that carry a key of the caller's (`Idempotency-Key`): one that is sent again is answered as the first time
// and not done again, also after a restart.
//
//   begin()    before anything is done. No value: the key is new and is now ours. A value: somebody was here before.
//              What comes of it is written by whatever must never be done twice, in its own transaction
//              (JobStore::create).
//   forget()   the request was refused before it did anything, so that the key may be used again.
//
// Bound to the thread of the Database it is given, which must outlive it.
#pragma once

#include <optional>
#include <string>

#include "base/result.h"
#include "db/database.h"

namespace veneer::db {

// Keys of different callers and operations never meet.
struct KeyedRequest {
  std::string who;           // the caller's identity: "uid 1000"
  std::string operation;     // "newJob"
  std::string key;           // as the caller sent it
  std::string request_hash;  // tells what the request asks for; SHA-256 of method, path, query and body
};

// Of an earlier request under the same key.
struct KeyedOutcome {
  std::optional<std::string> result;  // of a job {"job":N}; nothing while it goes on, or when the daemon ended before
};

class RequestKeys {
 public:
  explicit RequestKeys(Database& database) : database_(&database) {}

  // kConflict when the key was used for a request that asked for something else.
  Result<std::optional<KeyedOutcome>> begin(const KeyedRequest& request, const std::string& at);
  // Keeps a request that has a result: it did something.
  Status forget(const KeyedRequest& request);
  // Drops what was begun before that time; how many.
  Result<int> prune(const std::string& before);

 private:
  Database* database_;
};

}  // namespace veneer::db
