// veneer-worker: does one piece of work for veneerd in a process of its own, and ends. Not started by hand.
#include "daemon/orders/capture_work.h"
#include "daemon/orders/do_work.h"
#include "daemon/orders/notify_work.h"
#include "daemon/workers/work_server.h"

int main() {
  using namespace veneer::daemon;
  serve_work([](const std::string& kind, const nlohmann::json& request, const std::filesystem::path& folder,
                const TaskProgress& progress, const std::stop_token& stop) {
    if (auto captured = do_capture_work(kind, request, folder, progress, stop)) return std::move(*captured);
    if (auto told = do_notify_work(kind, request)) return std::move(*told);
    return do_work(kind, request, folder, progress, stop);
  });
}
