// Which scanners there are, and what can be set on them.
#include "daemon/devices/sane_scanner.h"
#include "daemon/orders/capture_json.h"
#include "daemon/routes/cell_routes.h"
#include "daemon/routes/post_work.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

json scanners_json(const ScannersFound& found) {
  json list = json::array();
  for (const sane::DescribedScanner& scanner : found.scanners)
    list.push_back({{"name", scanner.found.name},
                    {"make", scanner.found.make()},
                    {"type", scanner.found.type},
                    {"problem", scanner.problem},
                    {"options", scanner.options}});
  return {{"scanners", std::move(list)}};
}

}  // namespace

void bind_scanner_routes(Router& router, const ScannerServices& s) {
  router.bind("findScanners", [s](const ApiRequest&, const Reply& reply) {
    start_task(s.tasks, s.scanner, "find scanners", "waiting for the scanner", reply, [s](const TaskReporter& task) {
      const auto found = find_scanners(
          s.workers, s.config, [&](double f, const std::string& text) { task.progress(f, text); }, task.stop_token());
      task.finish(found ? Result<json>(scanners_json(*found)) : Result<json>(found.error()));
    });
  });
}

}  // namespace veneer::daemon
