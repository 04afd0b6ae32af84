#include "daemon/api/event_hub.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/api/event_client.h"

namespace veneer::daemon {
namespace {

std::string event_text(const nlohmann::json& event) {
  return event.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

EventHub::EventHub(EventHubOptions options, Logger log) : options_(options), log_(std::move(log)) {}

EventHub::~EventHub() { close(); }

void EventHub::broadcast(const nlohmann::json& event) {
  if (!clients_.empty()) broadcast_text(event_text(event));
}

void EventHub::broadcast_text(std::string event) {
  const auto message = std::make_shared<const std::string>(std::move(event));
  const auto everyone = clients_;  // a slow one leaves while we speak
  for (const auto& client : everyone) client->send(message);
}

EventHub::Room EventHub::room_for(const Caller& caller) const {
  std::size_t viewers = 0, same = 0;
  for (const auto& client : clients_) {
    viewers += client->caller().role < Role::kOperator ? 1U : 0U;
    same += client->caller().who == caller.who ? 1U : 0U;
  }
  if (same >= options_.max_per_identity) return Room::kTooManyOfThisIdentity;
  if (closed_ || clients_.size() >= options_.max_clients) return Room::kFull;
  return caller.role >= Role::kOperator || viewers < options_.max_viewers ? Room::kFree : Room::kFull;
}

void EventHub::join(const std::shared_ptr<EventClient>& client) {
  clients_.insert(client);
  client->send(std::make_shared<const std::string>(event_text({{"type", "hello"}, {"schema_version", 1}})));
}

void EventHub::drop_unless(const std::function<bool(const Caller&)>& holds) {
  const auto everyone = clients_;
  for (const auto& client : everyone)
    if (!holds(client->caller()))
      client->drop(boost::beast::websocket::close_code::policy_error, "you are signed out: sign in again");
}

void EventHub::close() {
  closed_ = true;
  const auto everyone = std::exchange(clients_, {});
  for (const auto& client : everyone) {
    client->drop(boost::beast::websocket::close_code::going_away, "the daemon is ending");
  }
}

}  // namespace veneer::daemon
