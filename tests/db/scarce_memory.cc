#include "tests/db/scarce_memory.h"

#include <sqlite3.h>

#include <cstdlib>
#include <utility>

namespace veneer::db {
namespace {

// SQLite's hooks have no argument for whose they are.
sqlite3_mem_methods usual_memory;
int until_refusal = 0;  // 0 = there is enough
bool refusal_lasts = false, refused = false;

bool refuses() {
  if (until_refusal == 0) return false;
  if (until_refusal > 1) return --until_refusal, false;
  if (!refusal_lasts) until_refusal = 0;
  return refused = true;
}
void* scarce_malloc(int size) { return refuses() ? nullptr : usual_memory.xMalloc(size); }
void* scarce_realloc(void* old, int size) { return refuses() ? nullptr : usual_memory.xRealloc(old, size); }

void start_with(const sqlite3_mem_methods& memory) {
  if (sqlite3_shutdown() != SQLITE_OK || sqlite3_config(SQLITE_CONFIG_MALLOC, &memory) != SQLITE_OK ||
      sqlite3_initialize() != SQLITE_OK)
    std::abort();
}

}  // namespace

ScarceMemory::ScarceMemory() {
  if (sqlite3_shutdown() != SQLITE_OK || sqlite3_config(SQLITE_CONFIG_GETMALLOC, &usual_memory) != SQLITE_OK)
    std::abort();
  sqlite3_mem_methods scarce = usual_memory;
  scarce.xMalloc = scarce_malloc;
  scarce.xRealloc = scarce_realloc;
  start_with(scarce);
}

ScarceMemory::~ScarceMemory() { start_with(usual_memory); }

void ScarceMemory::fail_at(int nth, bool lasts) {
  until_refusal = nth;
  refusal_lasts = lasts;
  refused = false;
}

bool ScarceMemory::mend() {
  until_refusal = 0;
  return std::exchange(refused, false);
}

}  // namespace veneer::db
