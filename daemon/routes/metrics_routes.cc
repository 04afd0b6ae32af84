// Figures for Prometheus.
#include "daemon/routes/cell_routes.h"

namespace veneer::daemon {

void bind_metrics_routes(Router& router, const MetricsServices& s) {
  router.bind("getMetrics", [s](const ApiRequest&, const Reply& reply) {
    reply(ApiReply::bytes(s.metrics.text(s.now()), "text/plain; version=0.0.4; charset=utf-8"));
  });
}

}  // namespace veneer::daemon
