// The event stream: every WebSocket client gets every event, in order, from the moment it joined. A client that does
// not keep up is dropped with a reason; it never delays anyone else or grows without bound.
//
// Each event has a number, "seq", larger than those before it in this life of the daemon, which has a name of its own.
// Whoever lost the stream comes back with both and is sent what he missed, in order, as long as all of it is kept;
// "hello" says whether it was. What the next event of its kind makes void is not kept: a status, the progress of a
// task.
//
// Bound to the reactor.
#pragma once

#include <boost/asio/io_context.hpp>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <string>

#include "base/log.h"
#include "daemon/api/api_message.h"

namespace veneer::daemon {

struct EventHubOptions {
  std::size_t max_clients = 32;
  std::size_t max_viewers = 16;      // of them, all viewers together: the rest is kept for operators
  std::size_t max_per_identity = 8;  // of them, for one user or one console link; anonymous ones are one
  std::size_t max_queued_messages = 256;
  std::size_t max_queued_bytes = 1024 * 1024;
  std::size_t max_kept_events = 200;  // for who comes back, and so many bytes: less than may be queued
  std::size_t max_kept_bytes = 256 * 1024;
  int ping_seconds = 15;  // silence after which a client is pinged; after twice that it is gone
  int close_seconds = 5;  // how long a client that is being dropped may take to read the reason
};

class EventClient;  // one WebSocket connection; see event_client.h

// Up to which event a client that comes back has seen them.
struct SeenEvents {
  std::string life;
  std::int64_t seq = 0;
};

class EventHub {
 public:
  EventHub(EventHubOptions options, Logger log);
  ~EventHub();
  EventHub(const EventHub&) = delete;
  EventHub& operator=(const EventHub&) = delete;

  // An object with at least {"type": "job|bed|panel|alarms|..."}. It is kept.
  void broadcast(const nlohmann::json& event);
  // The same, as text. `to_viewers` says less in the same event.
  void broadcast_text(std::string event);
  void broadcast_text(std::string event, std::string to_viewers);
  // What the next one makes void; to be made only when somebody listens.
  void broadcast_passing(const nlohmann::json& event);
  // One event that says less to viewers.
  void broadcast_passing(const nlohmann::json& event, const nlohmann::json& to_viewers);
  void broadcast_passing_text(std::string event);
  void broadcast_passing_text(std::string event, std::string to_viewers);
  std::size_t clients() const { return clients_.size(); }
  // Does anybody of this name listen now?
  bool is_followed_by(const std::string& who) const;
  // Closes those whose sign-in has ended.
  void drop_unless(const std::function<bool(const Caller&)>& holds);
  // Closes every client ("going away"); nobody can join any more.
  void close();

  // For the server and the clients themselves.
  enum class Room { kFree, kTooManyOfThisIdentity, kFull };
  // An operator who does not listen yet finds a place as long as another identity has two: one of whoever has most
  // goes.
  Room make_room_for(const Caller& caller);
  void join(const std::shared_ptr<EventClient>& client, const std::optional<SeenEvents>& seen = {});
  void leave(const std::shared_ptr<EventClient>& client) { clients_.erase(client); }
  const EventHubOptions& options() const { return options_; }

 private:
  // One event; mostly it says the same to all, and is one text then.
  struct Message {
    std::int64_t seq = 0;
    std::shared_ptr<const std::string> to_operators, to_viewers;
    std::size_t bytes() const { return to_operators->size() + (to_viewers == to_operators ? 0 : to_viewers->size()); }
    const std::shared_ptr<const std::string>& to(const Caller& caller) const {
      return caller.role >= Role::kOperator ? to_operators : to_viewers;
    }
  };
  Room room_for(const Caller& caller) const;
  bool send_one_away();
  Message numbered(std::string event);
  Message numbered(std::string event, std::string to_viewers);
  void send_all(const Message& message);
  void keep(Message message);
  bool is_kept_since(const SeenEvents& seen) const;

  EventHubOptions options_;
  Logger log_;
  bool closed_ = false;
  const std::string life_;
  std::int64_t last_seq_ = 0;
  std::int64_t forgotten_ = 0;  // the largest number of those that were kept and are not any more
  std::deque<Message> kept_;
  std::size_t kept_bytes_ = 0;
  std::set<std::shared_ptr<EventClient>> clients_;
};

}  // namespace veneer::daemon
