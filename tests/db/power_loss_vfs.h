// A file system for SQLite that can lose its power, and whose disk can fail. Writes reach the real files at once, but
// only what was synced is sure to survive: after a cut every later write fails, and settle() rebuilds each file from
// its synced content plus what a disk may have kept of the rest.
//
// One at a time; it is SQLite's default VFS from construction to destruction.
#pragma once

#include <cstdint>
#include <memory>

namespace veneer::db {

// What a disk may have kept of the writes that were not synced.
enum class Loss {
  kDropped,    // nothing
  kTorn,       // the first of them, and of the last one that came through only its first bytes
  kReordered,  // some of them, sector by sector, some sectors torn
};

enum class DiskFault { kRead, kWrite, kFull, kSync, kOpen, kLock };

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
  // Power is back: the files hold what a disk may hold. Every connection must be closed before. Again after a cut: the
  // files as they were then, with another loss.
  void settle(Loss loss, std::uint32_t seed);

  // The `nth` operation of that kind from now on fails, and all after it when it `lasts`.
  void fail_at(DiskFault fault, int nth, bool lasts);
  // The disk is well again; whether it failed.
  bool mend();

  struct State;

 private:
  std::unique_ptr<State> state_;
};

}  // namespace veneer::db
