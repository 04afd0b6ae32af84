#include "daemon/orders/notify_work.h"

#include <array>

#include "daemon/orders/notify_json.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

template <class Order, Status (*kTell)(const Order&)>
Result<json> tell(const json& request, const std::filesystem::path&, const TaskProgress&, const std::stop_token&) {
  if (const Status told = kTell(request.get<Order>()); !told) return told.error();
  return json(Delivered{});
}

constexpr std::array kNoticeWork{KindOfWork{CallWebhook::kKind, tell<CallWebhook, call_webhook>},
                                 KindOfWork{PublishByMqtt::kKind, tell<PublishByMqtt, publish_by_mqtt>}};

}  // namespace

std::span<const KindOfWork> notice_work() { return kNoticeWork; }

}  // namespace veneer::daemon
