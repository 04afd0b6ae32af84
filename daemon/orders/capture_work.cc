#include "daemon/orders/capture_work.h"

#include <array>
#include <thread>

#include "daemon/orders/capture_json.h"
#include "daemon/orders/capture_order.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

Result<json> scan_glass(const json& request, const std::filesystem::path& folder, const TaskProgress& progress,
                        const std::stop_token& stop) {
  const auto order = request.get<ScanGlass>();
  auto library = sane::SaneLibrary::open(order.sane_config);
  if (!library) return library.error();
  sane::ReadOptions options;
  options.pause = [](std::chrono::milliseconds time) { std::this_thread::sleep_for(time); };
  auto scanned = sane::scan_picture(**library, order.settings, folder / kMadeCapture, options, progress, stop);
  if (!scanned) return scanned.error();
  return json(*scanned);
}

Result<json> find_scanners(const json& request, const std::filesystem::path&, const TaskProgress& progress,
                           const std::stop_token& stop) {
  const auto order = request.get<FindScanners>();
  auto library = sane::SaneLibrary::open(order.sane_config);
  if (!library) return library.error();
  auto found = sane::describe_scanners(**library, progress, stop);
  if (!found) return found.error();
  return json(ScannersFound{std::move(*found)});
}

constexpr std::array kScannerWork{KindOfWork{ScanGlass::kKind, scan_glass},
                                  KindOfWork{FindScanners::kKind, find_scanners}};

}  // namespace

std::span<const KindOfWork> scanner_work() { return kScannerWork; }

}  // namespace veneer::daemon
