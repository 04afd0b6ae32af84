#include "planner/matching/index_cache.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <fstream>
#include <regex>
#include <set>

#include "base/hash.h"
#include "planner/cancelled.h"

namespace veneer::planner {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kFormat = "veneer shortlist index 2";
constexpr const char* kSuffix = ".index";
constexpr std::chrono::hours kLongestWrite{1};
constexpr std::size_t kAtOnce = 4 << 20;  // bytes read or written between looks for a stop

// The first line of a file: everything that must be as expected before its bytes are believed.
Result<std::string> header(const std::string& key, const IndexCache::Parts& parts, const std::stop_token& stop) {
  std::string line = fmt::format("{} {} {}", kFormat, std::endian::native == std::endian::little ? "le" : "be", key);
  for (const auto& part : parts) {
    const Result<std::string> hash = sha256_hex(part, stop);
    if (!hash.ok()) return hash.error();
    line += fmt::format(" {} {}", part.size(), *hash);
  }
  return line + "\n";
}

// As it can stand in a file's name.
std::string plain(std::string name) {
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0 && c != '-' && c != '_'; }, '_');
  return name;
}

// Moves the bytes of `part`, a few at a time. False: `move` failed. kCancelled: a stop was requested.
template <class Move>
Result<bool> in_pieces(std::span<std::byte> part, const std::stop_token& stop, Move move) {
  while (!part.empty()) {
    if (stop.stop_requested()) return cancelled();
    const auto next = part.first(std::min(part.size(), kAtOnce));
    if (!move(reinterpret_cast<char*>(next.data()), static_cast<std::streamsize>(next.size()))) return false;
    part = part.subspan(next.size());
  }
  return true;
}

Error unwritable(const fs::path& path) {
  return {ErrorCode::kStorage,
          fmt::format("the index {} cannot be written, so it will be measured again", path.string())};
}

}  // namespace

Result<IndexCache> IndexCache::open(fs::path directory) {
  std::error_code failed;
  fs::create_directories(directory, failed);
  if (failed || !fs::is_directory(directory, failed) || access(directory.c_str(), W_OK) != 0)
    return Error{
        ErrorCode::kStorage,
        fmt::format("indexes cannot be kept in {}: it is no directory that can be written to", directory.string())};
  return IndexCache(std::move(directory));
}

std::string IndexCache::entry_name(const std::string& panel, std::size_t window_class, int rotation) {
  return fmt::format("{}-{}-{}", panel, window_class, rotation);
}

fs::path IndexCache::file_of(const std::string& name) const { return directory_ / (plain(name) + kSuffix); }

Result<bool> IndexCache::load(const std::string& name, const std::string& key, const Parts& parts,
                              const std::stop_token& stop) const {
  std::ifstream file(file_of(name), std::ios::binary);
  std::string found;
  if (!std::getline(file, found) || found.rfind(fmt::format("{} ", kFormat), 0) != 0 ||
      found.find(key) == std::string::npos)
    return false;
  for (const auto& part : parts) {
    Result<bool> whole =
        in_pieces(part, stop, [&](char* to, std::streamsize size) { return bool(file.read(to, size)); });
    if (!whole.ok() || !*whole) return whole;
  }
  const Result<std::string> expected = header(key, parts, stop);
  if (!expected.ok()) return expected.error();
  return found + "\n" == *expected && file.peek() == std::ifstream::traits_type::eof();
}

Status IndexCache::store(const std::string& name, const std::string& key, const Parts& parts,
                         const std::stop_token& stop) const {
  const Result<std::string> first = header(key, parts, stop);
  if (!first.ok()) return first.error();
  const fs::path path = file_of(name);
  fs::path fresh = path;
  fresh += fmt::format(".{}", getpid());
  std::ofstream file(fresh, std::ios::binary | std::ios::trunc);
  file << *first;
  Result<bool> whole = true;
  for (const auto& part : parts) {
    whole = in_pieces(part, stop, [&](const char* from, std::streamsize size) { return bool(file.write(from, size)); });
    if (!whole.ok() || !*whole) break;
  }
  file.close();
  std::error_code failed;
  if (whole.ok() && file) fs::rename(fresh, path, failed);
  if (whole.ok() && file && !failed) return Ok();
  fs::remove(fresh, failed);
  return whole.ok() ? unwritable(path) : whole.error();
}

void IndexCache::drop(const std::string& panel) const {
  remove_entries([gone = plain(panel)](const std::string& other) { return other == gone; });
}

void IndexCache::keep_only(const std::vector<std::string>& panels) const {
  std::set<std::string> kept;
  for (const std::string& panel : panels) kept.insert(plain(panel));
  remove_entries([&](const std::string& other) { return !kept.contains(other); });
}

void IndexCache::remove_entries(const std::function<bool(const std::string& panel)>& unwanted) const {
  std::error_code failed;
  std::vector<fs::path> gone;
  for (fs::directory_iterator it(directory_, failed), end; !failed && it != end; it.increment(failed)) {
    // Only what entry_name() made, and nothing else that may lie here.
    const std::string file = it->path().filename().string();
    std::smatch parts;
    static const std::regex kEntry("(.*)-[0-9]+-[0-9]+\\.index(\\.[0-9]+)?");
    if (!std::regex_match(file, parts, kEntry)) continue;
    std::error_code unknown;
    // Whoever began to write it was killed, or it would have its name by now.
    const bool left =
        parts[2].matched && fs::file_time_type::clock::now() - fs::last_write_time(it->path(), unknown) > kLongestWrite;
    if (left || (!parts[2].matched && unwanted(parts[1]))) gone.push_back(it->path());
  }
  for (const fs::path& file : gone) fs::remove(file, failed);
}

}  // namespace veneer::planner
