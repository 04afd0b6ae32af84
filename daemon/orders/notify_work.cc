#include "daemon/orders/notify_work.h"

#include "daemon/orders/notify_json.h"

namespace veneer::daemon {

std::optional<Result<nlohmann::json>> do_notify_work(const std::string& kind, const nlohmann::json& request) {
  Status told = Ok();
  if (kind == CallWebhook::kKind)
    told = call_webhook(request.get<CallWebhook>());
  else if (kind == PublishByMqtt::kKind)
    told = publish_by_mqtt(request.get<PublishByMqtt>());
  else
    return std::nullopt;
  if (!told) return Result<nlohmann::json>(told.error());
  return Result<nlohmann::json>(nlohmann::json(Delivered{}));
}

}  // namespace veneer::daemon
