// Notices as JSON between the daemon and its worker processes: for those that order or do.
#pragma once

#include <nlohmann/json.hpp>

#include "daemon/orders/notify_order.h"

namespace veneer::daemon {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CallWebhook, tls, host, port, path, content_type, body, title, priority, token_file)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PublishByMqtt, tls, host, port, topic, body, user, password_file)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Delivered, delivered)

}  // namespace veneer::daemon
