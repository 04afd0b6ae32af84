// Files that are there whole or not at all. Any thread that may wait for a disk; never the reactor.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "base/result.h"

namespace veneer {

// What its disk tells of why this cannot be written: it is mounted read-only, or full. nullopt: nothing; it may be a
// permission or a quota then. The file need not be there. To be asked before anything is cleared away again.
std::optional<Error> disk_refuses(const std::filesystem::path& file);
// kStorage: what its disk tells, or else that room or access is lacking.
Error cannot_write(const std::filesystem::path& file);

// All bytes of a file or pipe; empty if it has none. nullopt when it is not there, is a folder, or cannot be read to
// its end: what that means, and what to do, only the caller can say. Waits for a pipe's writer. Throws std::bad_alloc.
std::optional<std::string> read_whole(const std::filesystem::path& file);

// Writes a temporary file beside `file`, syncs it, renames it and syncs the folders that name it: when this returns
// Ok(), the file survives a power cut; until then an earlier one of that name stays. Makes missing folders.
// kStorage when the disk or the permissions do not allow it.
Status write_whole(const std::filesystem::path& file, std::span<const std::byte> bytes);
// Gives a file of the same file system this name, durably, in place of an earlier one: for what another process has
// made. Only a plain file, no link to one. Makes missing folders. kStorage as above, also when there is no such file.
Status move_whole(const std::filesystem::path& made, const std::filesystem::path& file);
// The same for a folder, whose content must be synced; nothing may have that name yet.
Status move_folder_whole(const std::filesystem::path& made, const std::filesystem::path& folder);
// Removes the file, if there is one, and syncs its folder.
Status remove_durably(const std::filesystem::path& file);

// Part of a folder that gets its name at the end: bytes are synced, names only by sync_folders(). Both make missing
// folders and refuse a name that is taken. kNotFound when `from` cannot be read, kStorage when `to` cannot be written.
Status copy_into(const std::filesystem::path& from, const std::filesystem::path& to);
// A second name of the same file where the file system allows it, else a copy: for files that never change.
Status link_into(const std::filesystem::path& from, const std::filesystem::path& to);
// Makes the names below this folder, and its own folders' names, survive a power cut.
Status sync_folders(const std::filesystem::path& folder);

}  // namespace veneer
