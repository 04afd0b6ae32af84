// Keeps on disk what the shortlist measures of panels, so that the next plan reads it instead of measuring again.
//
// An entry is used only if it was stored with the key it is asked for, which holds the hash of what was measured, and
// if its contents still have their checksums; anything else is measured anew and replaced. So an entry is never wrong,
// and files may be deleted at any time. One file a name: what a name holds is bounded, whatever was planned before.
// Entries of panels that are used up or gone are removed by who knows of it: drop(), keep_only().
//
// Thread-safe for different names. Several processes may share a directory: files are replaced whole.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "base/result.h"

namespace veneer::planner {

class IndexCache {
 public:
  // Makes the directory if it is missing. kStorage: it cannot be made or written to.
  static Result<IndexCache> open(std::filesystem::path directory);

  using Parts = std::vector<std::span<std::byte>>;
  // Fills `parts`, whose sizes must be those that were stored; then it is true. False: nothing usable is stored;
  // kCancelled: a stop was requested. Parts may be overwritten all the same.
  Result<bool> load(const std::string& name, const std::string& key, const Parts& parts,
                    const std::stop_token& stop = {}) const;
  // kStorage, kCancelled: not stored; what was there before is still whole.
  Status store(const std::string& name, const std::string& key, const Parts& parts,
               const std::stop_token& stop = {}) const;

  // Removes the entries of a panel whose wood or map is gone; `panel` as in keep_index(). What cannot be removed stays:
  // it is never believed for another map.
  void drop(const std::string& panel) const;
  // Removes the entries of all panels but these.
  void keep_only(const std::vector<std::string>& panels) const;

  // What the entry for a panel, a class of windows and a rotation is called.
  static std::string entry_name(const std::string& panel, std::size_t window_class, int rotation);

 private:
  explicit IndexCache(std::filesystem::path directory) : directory_(std::move(directory)) {}
  std::filesystem::path file_of(const std::string& name) const;
  void remove_entries(const std::function<bool(const std::string& panel)>& unwanted) const;

  std::filesystem::path directory_;
};

}  // namespace veneer::planner
