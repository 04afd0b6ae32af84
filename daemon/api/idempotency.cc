#include "daemon/api/idempotency.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <span>
#include <string_view>
#include <utility>

#include "base/hash.h"

namespace veneer::daemon {

std::string fingerprint_of(const ApiRequest& request) {
  std::string text = request.method + " " + request.path + "?";
  for (const auto& [name, value] : request.query) text += fmt::format("{}={}&", name, value);
  text += "\n" + std::to_string(request.body.size()) + "\n";
  if (request.body.size() <= kHashedWhole)
    text += request.body.text();
  else
    text +=
        request.body_sha256.empty() ? sha256_hex(std::as_bytes(std::span(request.body.text()))) : request.body_sha256;
  return sha256_hex(std::as_bytes(std::span(text)));
}

bool usable_key(std::string_view key) {
  return !key.empty() && key.size() <= 200 && std::ranges::all_of(key, [](char c) { return c > 0x20 && c < 0x7f; });
}

namespace {

// For whoever asks again, instead of a reply that is too large to keep.
ApiReply was_done(const ApiReply& reply) {
  return ApiReply::error(Error{ErrorCode::kConflict,
                               fmt::format("this was done already ({}), and its reply was too large to be kept: look "
                                           "at what it changed",
                                           reply.status)});
}

}  // namespace

// The first request's way back. Dropped without a reply, the key is free again.
class IdempotencyKeys::Pending {
 public:
  Pending(std::shared_ptr<State> state, std::shared_ptr<Record> record, Reply reply)
      : state_(std::move(state)), record_(std::move(record)), reply_(std::move(reply)) {}
  Pending(const Pending&) = delete;
  Pending& operator=(const Pending&) = delete;
  ~Pending() { forget(); }

  void send(const ApiReply& reply) {
    std::vector<Reply> waiting;
    {
      const std::lock_guard lock(state_->mutex);
      if (!reply_) return;
      waiting = std::exchange(record_->waiting, {});
      waiting.push_back(std::exchange(reply_, nullptr));
      if (const bool done = reply.status < 400 || reply.changed.value_or(false); !done)
        std::erase(state_->records, record_);
      else
        record_->reply = reply.body.size() <= kLargestReply ? reply : was_done(reply);
    }
    for (const Reply& one : waiting) one(reply);
  }

 private:
  void forget() {
    std::vector<Reply> dropped;
    const std::lock_guard lock(state_->mutex);
    if (!reply_) return;
    dropped = std::exchange(record_->waiting, {});
    std::erase(state_->records, record_);
  }

  std::shared_ptr<State> state_;
  std::shared_ptr<Record> record_;
  Reply reply_;
};

// For one more key of `who`. Nobody's many keys make the cell forget what another began, and what is still being done
// is never forgotten: false where that leaves no room.
bool IdempotencyKeys::make_room(std::deque<std::shared_ptr<Record>>& records, const std::string& who) {
  std::map<std::string_view, std::size_t> held;
  for (const auto& record : records) ++held[record->who];
  const auto victim = std::ranges::max_element(
      records, {}, [&held](const auto& record) { return std::pair(record->reply.has_value(), held[record->who]); });
  if (!(*victim)->reply || held[(*victim)->who] < held[who]) return false;
  records.erase(victim);
  return true;
}

std::optional<Reply> IdempotencyKeys::begin(const ApiRequest& request, Reply reply) {
  const std::string fingerprint = fingerprint_of(request);
  ApiReply known;
  {
    const std::lock_guard lock(state_->mutex);
    auto& records = state_->records;
    const TimePoint now = state_->clock.now();
    std::erase_if(records, [now](const auto& record) { return record->reply && now - record->at > kLife; });
    const auto found = std::ranges::find_if(records, [&](const auto& record) {
      return record->who == request.caller.who && record->key == request.idempotency_key;
    });
    if (found != records.end() && (*found)->fingerprint != fingerprint) {
      known = ApiReply::error(
          Error{ErrorCode::kConflict, "this Idempotency-Key was used for another request: give each its own"});
    } else if (found != records.end() && !(*found)->reply) {
      (*found)->waiting.push_back(std::move(reply));
      return std::nullopt;
    } else if (found != records.end()) {
      known = *(*found)->reply;
      known.headers.emplace_back("Idempotency-Replayed", "true");
    } else if (records.size() >= kMost && !make_room(records, request.caller.who)) {
      known = ApiReply::too_many("too many requests with an Idempotency-Key are still being done");
    } else {
      auto record = std::make_shared<Record>(
          Record{request.caller.who, request.idempotency_key, fingerprint, now, std::nullopt, {}});
      records.push_back(record);
      const auto pending = std::make_shared<Pending>(state_, std::move(record), std::move(reply));
      return [pending](const ApiReply& made) { pending->send(made); };
    }
  }
  reply(std::move(known));
  return std::nullopt;
}

}  // namespace veneer::daemon
