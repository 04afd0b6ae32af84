// Notices as JSON between the daemon and its worker processes, for the few sources that write or read it.
#pragma once

#include <nlohmann/json.hpp>

#include "daemon/orders/notify_order.h"

namespace veneer::daemon {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CallWebhook, tls, host, port, path, content_type, body, title, priority, token_file)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PublishByMqtt, tls, host, port, topic, body, user, password_file)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Delivered, delivered)

}  // namespace veneer::daemon
