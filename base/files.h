// Files that are there whole or not at all. Any thread that may wait for a disk; never the reactor.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

#include "base/result.h"

namespace veneer {

// Writes a temporary file beside `file`, syncs it, renames it and syncs the folders that name it: when this returns
// Ok(), the file survives a power cut; until then an earlier one of that name stays. Makes missing folders.
// kStorage when the disk or the permissions do not allow it.
Status write_whole(const std::filesystem::path& file, std::span<const std::byte> bytes);
// Gives a file of the same file system this name, durably, in place of an earlier one: for what another process has
// made. Only a plain file, no link to one. Makes missing folders. kStorage as above, also when there is no such file.
Status move_whole(const std::filesystem::path& made, const std::filesystem::path& file);
// Removes the file, if there is one, and syncs its folder.
Status remove_durably(const std::filesystem::path& file);

}  // namespace veneer
