// Content hashes: scans and veneer maps are named by what they hold.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <stop_token>
#include <string>

#include "base/result.h"

namespace veneer {

// SHA-256 in lower-case hex.
std::string sha256_hex(std::span<const std::byte> bytes);
// The same; kCancelled: some milliseconds after a stop was requested.
Result<std::string> sha256_hex(std::span<const std::byte> bytes, const std::stop_token& stop);
// kNotFound when there is no such file, kStorage when the disk does not give all of it, kCancelled soon after `stop`.
Result<std::string> sha256_hex_of_file(const std::filesystem::path& path, const std::stop_token& stop = {});

}  // namespace veneer
