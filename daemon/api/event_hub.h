// The event stream: every WebSocket client gets every event, in order, from the moment it joined. A client that does
// not keep up is dropped with a reason; it never delays anyone else or grows without bound.
//
// Bound to the reactor.
#pragma once

#include <boost/asio/io_context.hpp>
#include <cstddef>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
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
  int ping_seconds = 15;  // silence after which a client is pinged; after twice that it is gone
  int close_seconds = 5;  // how long a client that is being dropped may take to read the reason
};

class EventClient;  // one WebSocket connection; see event_client.h

class EventHub {
 public:
  EventHub(EventHubOptions options, Logger log);
  ~EventHub();
  EventHub(const EventHub&) = delete;
  EventHub& operator=(const EventHub&) = delete;

  // An object with at least {"type": "status|task|job|bed|panel|log|..."}.
  void broadcast(const nlohmann::json& event);
  // The same, serialised already; to be made only when somebody listens.
  void broadcast_text(std::string event);
  std::size_t clients() const { return clients_.size(); }
  // Closes those whose sign-in has ended.
  void drop_unless(const std::function<bool(const Caller&)>& holds);
  // Closes every client ("going away"); nobody can join any more.
  void close();

  // For the server and the clients themselves.
  enum class Room { kFree, kTooManyOfThisIdentity, kFull };
  Room room_for(const Caller& caller) const;
  void join(const std::shared_ptr<EventClient>& client);
  void leave(const std::shared_ptr<EventClient>& client) { clients_.erase(client); }
  const EventHubOptions& options() const { return options_; }

 private:
  EventHubOptions options_;
  Logger log_;
  bool closed_ = false;
  std::set<std::shared_ptr<EventClient>> clients_;
};

}  // namespace veneer::daemon
