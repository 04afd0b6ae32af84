// A file system for SQLite that can lose its power. Writes reach the real files at once, but only what was synced
// survives: after a cut every later write fails, and settle() rebuilds each file from its synced content plus a seeded
// choice of the sectors written since.
//
// One at a time; it is SQLite's default VFS from construction to destruction.
#pragma once

#include <cstdint>
#include <memory>

namespace veneer::db {

class PowerLossVfs {
 public:
  PowerLossVfs();
  PowerLossVfs(const PowerLossVfs&) = delete;
  PowerLossVfs& operator=(const PowerLossVfs&) = delete;
  ~PowerLossVfs();

  // The power goes before the `step`-th write, truncation or sync from now; 0 = never.
  void cut_at(int step);
  int steps() const;  // writes, truncations and syncs so far
  bool is_cut() const;
  // Power is back: the files hold what a disk may hold. Every connection must be closed before.
  void settle(std::uint32_t seed);

  struct State;

 private:
  std::unique_ptr<State> state_;
};

}  // namespace veneer::db
