#include "daemon/orders/kind_of_work.h"

#include <fmt/format.h>

#include <algorithm>

namespace veneer::daemon {

const KindOfWork* find_kind(std::span<const KindOfWork> kinds, const std::string& word) {
  const auto found = std::ranges::find_if(kinds, [&](const KindOfWork& kind) { return word == kind.word; });
  return found == kinds.end() ? nullptr : &*found;
}

Result<nlohmann::json> do_work_of(const KindOfWork* kind, const std::string& word, const nlohmann::json& request,
                                  const std::filesystem::path& folder, const TaskProgress& progress,
                                  const std::stop_token& stop) {
  if (kind == nullptr)
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("there is no work {}: install veneerd and veneer-worker of one version", word)};
  try {
    return kind->work(request, folder, progress, stop);
  } catch (const nlohmann::json::exception& e) {
    return Error{ErrorCode::kInvalidArgument, fmt::format("the order {} cannot be read ({}): install veneerd and "
                                                          "veneer-worker of one version",
                                                          word, e.what())};
  }
}

}  // namespace veneer::daemon
