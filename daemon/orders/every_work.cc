#include "daemon/orders/every_work.h"

#include <array>
#include <span>

#include "daemon/orders/capture_work.h"
#include "daemon/orders/do_work.h"
#include "daemon/orders/kind_of_work.h"
#include "daemon/orders/notify_work.h"

namespace veneer::daemon {
namespace {

std::array<std::span<const KindOfWork>, 3> lists() { return {computed_work(), capture_work(), notice_work()}; }

}  // namespace

std::vector<std::string> kinds_of_work() {
  std::vector<std::string> out;
  for (const auto& list : lists())
    for (const KindOfWork& kind : list) out.emplace_back(kind.word);
  return out;
}

Result<nlohmann::json> do_any_work(const std::string& kind, const nlohmann::json& request,
                                   const std::filesystem::path& folder, const TaskProgress& progress,
                                   const std::stop_token& stop) {
  const KindOfWork* known = nullptr;
  for (const auto& list : lists())
    if (const KindOfWork* found = find_kind(list, kind); found != nullptr) known = found;
  return do_work_of(known, kind, request, folder, progress, stop);
}

}  // namespace veneer::daemon
