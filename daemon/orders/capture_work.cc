#include "daemon/orders/capture_work.h"

#include <thread>

#include "daemon/orders/capture_json.h"
#include "daemon/orders/capture_order.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

Result<json> scan_glass(const ScanGlass& order, const std::filesystem::path& folder, const TaskProgress& progress,
                        const std::stop_token& stop) {
  auto library = sane::SaneLibrary::open(order.sane_config);
  if (!library) return library.error();
  sane::ReadOptions options;
  options.pause = [](std::chrono::milliseconds time) { std::this_thread::sleep_for(time); };
  auto scanned = sane::scan_picture(**library, order.settings, folder / kMadeCapture, options, progress, stop);
  if (!scanned) return scanned.error();
  return json(*scanned);
}

Result<json> find_scanners(const FindScanners& order, const TaskProgress& progress, const std::stop_token& stop) {
  auto library = sane::SaneLibrary::open(order.sane_config);
  if (!library) return library.error();
  auto found = sane::describe_scanners(**library, progress, stop);
  if (!found) return found.error();
  return json(ScannersFound{std::move(*found)});
}

}  // namespace

std::optional<Result<json>> do_capture_work(const std::string& kind, const json& request,
                                            const std::filesystem::path& folder, const TaskProgress& progress,
                                            const std::stop_token& stop) {
  if (kind == ScanGlass::kKind) return scan_glass(request.get<ScanGlass>(), folder, progress, stop);
  if (kind == FindScanners::kKind) return find_scanners(request.get<FindScanners>(), progress, stop);
  return std::nullopt;
}

}  // namespace veneer::daemon
