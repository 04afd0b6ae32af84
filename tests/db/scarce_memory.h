// SQLite's memory, of which the n-th piece that it asks for can be refused.
//
// One at a time, while SQLite is used by nobody: constructor and destructor shut it down and start it anew, so that any
// VFS is registered after that.
#pragma once

namespace veneer::db {

class ScarceMemory {
 public:
  ScarceMemory();
  ScarceMemory(const ScarceMemory&) = delete;
  ScarceMemory& operator=(const ScarceMemory&) = delete;
  ~ScarceMemory();

  // The `nth` allocation from now on fails, and all after it when it `lasts`.
  void fail_at(int nth, bool lasts);
  // There is memory again; whether it was short.
  bool mend();
};

}  // namespace veneer::db
