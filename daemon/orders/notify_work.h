// What a worker process does to tell others (notify_order.h). It needs the network (WorkOrder::devices), and no device.
#pragma once

#include <span>

#include "base/result.h"
#include "daemon/orders/kind_of_work.h"
#include "daemon/orders/notify_order.h"

namespace veneer::daemon {

// Both wait for the other side as long as it takes: the work's deadline ends them.
// Of the answer nothing is read but its header, 8 KiB at most; kRefused when it is no 2xx.
Status call_webhook(const CallWebhook& order);
// QoS 1: until the broker has said that it has it.
Status publish_by_mqtt(const PublishByMqtt& order);

std::span<const KindOfWork> notice_work();

}  // namespace veneer::daemon
