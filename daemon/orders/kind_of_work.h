// A kind of work that worker processes do: its word and who does it. Every one is in one of three lists (do_work.h,
// capture_work.h, notify_work.h), and every_work.h has them all.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <stop_token>
#include <string>

#include "base/result.h"
#include "daemon/workers/work_runner.h"

namespace veneer::daemon {

struct KindOfWork {
  const char* word;
  // Only scanning and cameras look at `stop`; all else ends with its process. May throw what libraries throw.
  Result<nlohmann::json> (*work)(const nlohmann::json& request, const std::filesystem::path& folder,
                                 const TaskProgress& progress, const std::stop_token& stop);
};

// The one of `kinds` that is called `word`; none is null.
const KindOfWork* find_kind(std::span<const KindOfWork> kinds, const std::string& word);

// kInvalidArgument: `kind` is null, or the request is not one of that work. May throw what libraries throw.
Result<nlohmann::json> do_work_of(const KindOfWork* kind, const std::string& word, const nlohmann::json& request,
                                  const std::filesystem::path& folder, const TaskProgress& progress,
                                  const std::stop_token& stop);

}  // namespace veneer::daemon
