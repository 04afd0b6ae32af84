#include "daemon/api/event_hub.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "daemon/api/event_client.h"
#include "daemon/api/random_token.h"

namespace veneer::daemon {
namespace {

std::string event_text(const nlohmann::json& event) {
  return event.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

// No secret: it only has to be another one each time.
std::string name_of_life() {
  const auto token = random_token();
  return token ? token->substr(0, 12) : utc_timestamp();
}

// An event is an object with a type, so there is a property for the comma to part it from.
std::shared_ptr<const std::string> with_number(std::string event, std::int64_t seq) {
  event.insert(1, "\"seq\":" + std::to_string(seq) + ",");
  return std::make_shared<const std::string>(std::move(event));
}

}  // namespace

EventHub::EventHub(EventHubOptions options, Logger log)
    : options_(options), log_(std::move(log)), life_(name_of_life()) {}

EventHub::~EventHub() { close(); }

void EventHub::broadcast(const nlohmann::json& event) { broadcast_text(event_text(event)); }

void EventHub::broadcast_text(std::string event) {
  Message message = numbered(std::move(event));
  send_all(message);
  keep(std::move(message));
}

void EventHub::broadcast_text(std::string event, std::string to_viewers) {
  Message message = numbered(std::move(event), std::move(to_viewers));
  send_all(message);
  keep(std::move(message));
}

void EventHub::broadcast_passing(const nlohmann::json& event) { broadcast_passing_text(event_text(event)); }

void EventHub::broadcast_passing_text(std::string event) { send_all(numbered(std::move(event))); }

void EventHub::broadcast_passing_text(std::string event, std::string to_viewers) {
  send_all(numbered(std::move(event), std::move(to_viewers)));
}

void EventHub::broadcast_passing(const nlohmann::json& event, const nlohmann::json& to_viewers) {
  broadcast_passing_text(event_text(event), event_text(to_viewers));
}

EventHub::Message EventHub::numbered(std::string event) {
  const auto text = with_number(std::move(event), ++last_seq_);
  return {last_seq_, text, text};
}

EventHub::Message EventHub::numbered(std::string event, std::string to_viewers) {
  if (event == to_viewers) return numbered(std::move(event));
  const std::int64_t seq = ++last_seq_;
  return {seq, with_number(std::move(event), seq), with_number(std::move(to_viewers), seq)};
}

void EventHub::send_all(const Message& message) {
  const auto everyone = clients_;  // a slow one leaves while we speak
  for (const auto& client : everyone) client->send(message.to(client->caller()));
}

void EventHub::keep(Message message) {
  kept_bytes_ += message.bytes();
  kept_.push_back(std::move(message));
  while (kept_.size() > options_.max_kept_events || kept_bytes_ > options_.max_kept_bytes) {
    forgotten_ = kept_.front().seq;
    kept_bytes_ -= kept_.front().bytes();
    kept_.pop_front();
  }
}

bool EventHub::is_kept_since(const SeenEvents& seen) const {
  return seen.life == life_ && seen.seq >= forgotten_ && seen.seq <= last_seq_;
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

EventHub::Room EventHub::make_room_for(const Caller& caller) {
  const Room room = room_for(caller);
  if (room != Room::kFull || closed_ || caller.role < Role::kOperator) return room;
  return !is_followed_by(caller.who) && send_one_away() ? Room::kFree : room;
}

bool EventHub::is_followed_by(const std::string& who) const {
  return std::ranges::any_of(clients_, [&](const auto& client) { return client->caller().who == who; });
}

bool EventHub::send_one_away() {
  std::map<std::string, std::vector<std::shared_ptr<EventClient>>> by_identity;
  for (const auto& client : clients_) by_identity[client->caller().who].push_back(client);
  const auto most =
      std::ranges::max_element(by_identity, {}, [](const auto& identity) { return identity.second.size(); });
  if (most == by_identity.end() || most->second.size() < 2) return false;
  most->second.front()->drop(boost::beast::websocket::close_code::try_again_later,
                             "somebody who does not listen yet needs one of your places");
  return true;
}

void EventHub::join(const std::shared_ptr<EventClient>& client, const std::optional<SeenEvents>& seen) {
  clients_.insert(client);
  const bool resumed = seen && is_kept_since(*seen);
  const std::int64_t from = resumed ? seen->seq : last_seq_;
  client->send(std::make_shared<const std::string>(event_text({{"type", "hello"},
                                                               {"schema_version", 1},
                                                               {"life", life_},
                                                               {"seq", from},
                                                               {"newest", last_seq_},
                                                               {"resumed", resumed}})));
  for (const Message& event : kept_)
    if (event.seq > from) client->send(event.to(client->caller()));
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
