// A folder as one file, for another disk or machine: tar, compressed as the file's name says (.tar, .tar.gz, .tar.zst).
// Any thread that may wait; never the reactor.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string_view>

#include "base/result.h"

namespace veneer {

// May a file with this name be such an archive?
bool is_archive_name(std::string_view file);

// Packs every plain file below `folder` under the folder's own name, so that unpacking makes one folder. The file is
// there whole and synced, or not at all; one of that name is replaced. `progress` is told the fraction that is done.
// kInvalidArgument for another name, kNotFound when the folder cannot be read, kStorage when the disk does not take it.
Status pack_folder(const std::filesystem::path& folder, const std::filesystem::path& file,
                   const std::function<void(double)>& progress);

// Unpacks it into `folder`, which it makes. Only plain files are taken, and none that would lie outside of it: a link,
// a device or a path with ".." means that nothing is (kInvalidArgument). kNotFound when there is no such file, kStorage
// when it is damaged or the disk is full, and before anything is unpacked when the disk has not room for all of it and
// `spare_bytes` more. What was unpacked before an error is left to the caller.
Status unpack_archive(const std::filesystem::path& file, const std::filesystem::path& folder,
                      std::uint64_t spare_bytes = 64 << 20);

}  // namespace veneer
