// What a worker process made of a plan: files in the work's folder, and believed only where they could be a plan at
// all.
//
// Errors: kInternal for what came back unreadable or beyond all measure, kStorage where the disk does not give it.
// Blocks; any thread.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "db/plans.h"

namespace veneer::daemon {

// A plain file, not empty, of so many bytes at most.
Result<std::string> read_made_file(const std::filesystem::path& file, std::uintmax_t most = 512 << 20);
Result<std::vector<db::PlannedPatch>> read_made_pieces(const std::filesystem::path& file);

}  // namespace veneer::daemon
