// A request that is sent twice is done once: whoever sends something that begins work gives it a key of its own
// (Idempotency-Key), and a repetition with the same key gets the reply of the first.
//
// What was refused is forgotten, because nothing was done; an error about a change that holds (ApiReply::changed) is
// told again. What is still being done answers both when it is done, and is never forgotten before that. Of a reply
// that is too large to keep, a repetition hears that it was done. Keys belong to who sent them. They live in memory;
// what must hold beyond a restart is written in the transaction that does it (db/request_keys.h). Thread-safe, since
// replies come from any thread.
#pragma once

#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "base/clock.h"
#include "daemon/api/api_message.h"

namespace veneer::daemon {

class IdempotencyKeys {
 public:
  static constexpr std::chrono::hours kLife{24};
  static constexpr std::size_t kMost = 256;            // the oldest of whoever has most of them goes first
  static constexpr std::size_t kLargestReply = 16384;  // of a larger one only that there was one

  // `clock` outlives this.
  explicit IdempotencyKeys(const Clock& clock) : state_(std::make_shared<State>(clock)) {}

  // What to do with a request that has a key: nullopt when it has been replied to here (with the first one's reply, or
  // an error), or will be; else go on with the reply given back.
  std::optional<Reply> begin(const ApiRequest& request, Reply reply);

 private:
  struct Record {
    std::string who, key, fingerprint;
    TimePoint at;
    std::optional<ApiReply> reply;
    std::vector<Reply> waiting;  // repetitions that came before it
  };
  struct State {
    explicit State(const Clock& time) : clock(time) {}
    const Clock& clock;
    std::mutex mutex;
    std::deque<std::shared_ptr<Record>> records;  // guarded by mutex, as are they
  };
  class Pending;
  static bool make_room(std::deque<std::shared_ptr<Record>>& records, const std::string& who);
  std::shared_ptr<State> state_;
};

// 1 to 200 visible ASCII characters.
bool usable_key(std::string_view key);

// A larger body is hashed as it comes in (ApiRequest::body_sha256): all of a picture in one go would hold up the loop
// that answers STOP.
inline constexpr std::size_t kHashedWhole = 16 * 1024;

// Tells requests apart that were given one key by mistake: by all that they are.
std::string fingerprint_of(const ApiRequest& request);

}  // namespace veneer::daemon
