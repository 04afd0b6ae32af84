// A message to an MQTT broker that somebody else keeps. The one door to libmosquitto.
#include <fmt/format.h>
#include <mosquitto.h>

#include <fstream>
#include <memory>

#include "daemon/orders/notify_work.h"

namespace veneer::daemon {
namespace {

Error mqtt_error(const PublishByMqtt& order, const std::string& why) {
  return {ErrorCode::kUnavailable, fmt::format("the MQTT broker at {} port {}: {}", order.host, order.port, why)};
}

// What the broker has said.
struct Said {
  int answer = -1;  // to CONNECT; 0 = welcome
  bool has_it = false;
};

}  // namespace

Status publish_by_mqtt(const PublishByMqtt& order) {
  mosquitto_lib_init();
  Said said;
  const std::unique_ptr<mosquitto, decltype(&mosquitto_destroy)> client(mosquitto_new(nullptr, true, &said),
                                                                        mosquitto_destroy);
  if (!client) return mqtt_error(order, "there is no memory for a client");
  if (!order.user.empty()) {
    std::string password;
    if (!order.password_file.empty()) {
      std::ifstream in(order.password_file);
      std::getline(in, password);
      if (!in)
        return Error{
            ErrorCode::kInvalidArgument,
            fmt::format("{} has no password in its first line, or veneerd may not read it", order.password_file)};
    }
    const int named = mosquitto_username_pw_set(client.get(), order.user.c_str(),
                                                order.password_file.empty() ? nullptr : password.c_str());
    if (named != MOSQ_ERR_SUCCESS) return mqtt_error(order, mosquitto_strerror(named));
  }
  // Without it a password would go in the clear.
  if (order.tls)
    if (const int safe = mosquitto_tls_set(client.get(), nullptr, "/etc/ssl/certs", nullptr, nullptr, nullptr);
        safe != MOSQ_ERR_SUCCESS)
      return mqtt_error(order, mosquitto_strerror(safe));
  mosquitto_connect_callback_set(client.get(),
                                 [](mosquitto*, void* told, int answer) { static_cast<Said*>(told)->answer = answer; });
  mosquitto_publish_callback_set(client.get(),
                                 [](mosquitto*, void* told, int) { static_cast<Said*>(told)->has_it = true; });
  constexpr int kKeepAliveSeconds = 60, kTurnMs = 200;
  int done = mosquitto_connect(client.get(), order.host.c_str(), order.port, kKeepAliveSeconds);
  while (done == MOSQ_ERR_SUCCESS && said.answer < 0) done = mosquitto_loop(client.get(), kTurnMs, 1);
  if (said.answer > 0) return mqtt_error(order, mosquitto_connack_string(said.answer));
  if (done == MOSQ_ERR_SUCCESS)
    done = mosquitto_publish(client.get(), nullptr, order.topic.c_str(), static_cast<int>(order.body.size()),
                             order.body.data(), 1, false);
  while (done == MOSQ_ERR_SUCCESS && !said.has_it) done = mosquitto_loop(client.get(), kTurnMs, 1);
  if (done != MOSQ_ERR_SUCCESS)
    return mqtt_error(
        order, fmt::format("{} (beyond this machine the unit needs notifications.conf)", mosquitto_strerror(done)));
  mosquitto_disconnect(client.get());
  return Ok();
}

}  // namespace veneer::daemon
