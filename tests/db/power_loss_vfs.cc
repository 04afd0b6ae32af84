#include "tests/db/power_loss_vfs.h"

#include <sqlite3.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <new>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace veneer::db {
namespace {

constexpr std::int64_t kSector = 512;

struct Change {
  std::int64_t offset = 0;
  std::vector<char> bytes;  // of a write
  bool truncation = false;  // to `offset`
};
struct Disk {
  std::vector<char> synced;
  std::vector<Change> pending;
};

void change_by(std::vector<char>& content, const Change& change) {
  const auto offset = static_cast<std::size_t>(change.offset);
  if (change.truncation) return content.resize(offset);
  if (content.size() < offset + change.bytes.size()) content.resize(offset + change.bytes.size());
  std::copy(change.bytes.begin(), change.bytes.end(), content.begin() + static_cast<std::ptrdiff_t>(offset));
}

std::vector<char> content_of(const char* file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

}  // namespace

struct PowerLossVfs::State {
  sqlite3_vfs vfs{};
  sqlite3_vfs* real = nullptr;
  std::map<std::string, Disk> disks;
  std::map<std::string, Disk> at_the_cut;
  int steps = 0, cut_at = 0;
  bool cut = false;
  DiskFault fault = DiskFault::kRead;
  int until_fault = 0;  // 0 = the disk is well
  bool fault_lasts = false, failed = false;

  bool fails(DiskFault asked) {
    if (until_fault == 0 || asked != fault) return false;
    if (until_fault > 1) return --until_fault, false;
    if (!fault_lasts) until_fault = 0;
    return failed = true;
  }

  // Counts a step; false when the power is gone.
  bool step() {
    ++steps;
    if (cut_at != 0 && steps >= cut_at) cut = true;
    return !cut;
  }
};

namespace {

using State = PowerLossVfs::State;

// What SQLite allocates for an open file: our head, then the real file.
struct ShimFile {
  sqlite3_file base;
  State* state;
  Disk* disk;  // null for files that need not survive
};

ShimFile* shim(sqlite3_file* file) { return reinterpret_cast<ShimFile*>(file); }
sqlite3_file* real(sqlite3_file* file) { return reinterpret_cast<sqlite3_file*>(shim(file) + 1); }
const sqlite3_io_methods* methods(sqlite3_file* file) { return real(file)->pMethods; }

int do_close(sqlite3_file* file) { return methods(file)->xClose(real(file)); }
int do_read(sqlite3_file* file, void* to, int size, sqlite3_int64 at) {
  if (shim(file)->state->fails(DiskFault::kRead)) return SQLITE_IOERR_READ;
  return methods(file)->xRead(real(file), to, size, at);
}
int do_write(sqlite3_file* file, const void* from, int size, sqlite3_int64 at) {
  if (shim(file)->state->fails(DiskFault::kWrite)) return SQLITE_IOERR_WRITE;
  if (shim(file)->state->fails(DiskFault::kFull)) return SQLITE_FULL;
  if (!shim(file)->state->step()) return SQLITE_IOERR_WRITE;
  if (Disk* disk = shim(file)->disk) {
    const char* bytes = static_cast<const char*>(from);
    for (int done = 0; done < size;) {
      const int part = std::min(size - done, static_cast<int>(kSector - (at + done) % kSector));
      disk->pending.push_back({at + done, std::vector<char>(bytes + done, bytes + done + part), false});
      done += part;
    }
  }
  return methods(file)->xWrite(real(file), from, size, at);
}
int do_truncate(sqlite3_file* file, sqlite3_int64 size) {
  if (shim(file)->state->fails(DiskFault::kWrite)) return SQLITE_IOERR_TRUNCATE;
  if (!shim(file)->state->step()) return SQLITE_IOERR_TRUNCATE;
  if (Disk* disk = shim(file)->disk) disk->pending.push_back({size, {}, true});
  return methods(file)->xTruncate(real(file), size);
}
int do_sync(sqlite3_file* file, int flags) {
  if (shim(file)->state->fails(DiskFault::kSync)) return SQLITE_IOERR_FSYNC;
  if (!shim(file)->state->step()) return SQLITE_IOERR_FSYNC;
  if (Disk* disk = shim(file)->disk) {
    for (const Change& change : disk->pending) change_by(disk->synced, change);
    disk->pending.clear();
  }
  return methods(file)->xSync(real(file), flags);
}
int do_size(sqlite3_file* file, sqlite3_int64* size) { return methods(file)->xFileSize(real(file), size); }
int do_lock(sqlite3_file* file, int level) {
  if (shim(file)->state->fails(DiskFault::kLock)) return SQLITE_IOERR_LOCK;
  return methods(file)->xLock(real(file), level);
}
int do_unlock(sqlite3_file* file, int level) { return methods(file)->xUnlock(real(file), level); }
int do_check_lock(sqlite3_file* file, int* out) { return methods(file)->xCheckReservedLock(real(file), out); }
int do_control(sqlite3_file* file, int op, void* argument) {
  return methods(file)->xFileControl(real(file), op, argument);
}
int do_sector_size(sqlite3_file* file) { return methods(file)->xSectorSize(real(file)); }
int do_characteristics(sqlite3_file*) { return 0; }  // an ordinary disk promises nothing
int do_shm_map(sqlite3_file* file, int page, int size, int extend, void volatile** out) {
  if (shim(file)->state->fails(DiskFault::kFull)) return SQLITE_IOERR_SHMSIZE;
  return methods(file)->xShmMap(real(file), page, size, extend, out);
}
int do_shm_lock(sqlite3_file* file, int offset, int n, int flags) {
  if ((flags & SQLITE_SHM_LOCK) != 0 && shim(file)->state->fails(DiskFault::kLock)) return SQLITE_IOERR_SHMLOCK;
  return methods(file)->xShmLock(real(file), offset, n, flags);
}
void do_shm_barrier(sqlite3_file* file) { methods(file)->xShmBarrier(real(file)); }
int do_shm_unmap(sqlite3_file* file, int remove) { return methods(file)->xShmUnmap(real(file), remove); }

const sqlite3_io_methods kMethods = {2,
                                     do_close,
                                     do_read,
                                     do_write,
                                     do_truncate,
                                     do_sync,
                                     do_size,
                                     do_lock,
                                     do_unlock,
                                     do_check_lock,
                                     do_control,
                                     do_sector_size,
                                     do_characteristics,
                                     do_shm_map,
                                     do_shm_lock,
                                     do_shm_barrier,
                                     do_shm_unmap,
                                     nullptr,
                                     nullptr};

int do_open(sqlite3_vfs* vfs, const char* name, sqlite3_file* file, int flags, int* out_flags) {
  auto* state = static_cast<State*>(vfs->pAppData);
  auto* opened = new (file) ShimFile{};
  opened->state = state;
  if (state->fails(DiskFault::kOpen)) return SQLITE_CANTOPEN;
  const int result = state->real->xOpen(state->real, name, real(file), flags, out_flags);
  if (result != SQLITE_OK) return result;
  opened->base.pMethods = &kMethods;
  if (name != nullptr && (flags & (SQLITE_OPEN_MAIN_DB | SQLITE_OPEN_WAL | SQLITE_OPEN_MAIN_JOURNAL)) != 0) {
    const auto [disk, first] = state->disks.try_emplace(name);
    if (first) disk->second.synced = content_of(name);  // it was there before we were
    opened->disk = &disk->second;
  }
  return SQLITE_OK;
}
int do_delete(sqlite3_vfs* vfs, const char* name, int sync_folder) {
  auto* state = static_cast<State*>(vfs->pAppData);
  if (!state->step()) return SQLITE_IOERR_DELETE;
  state->disks.erase(name);
  return state->real->xDelete(state->real, name, sync_folder);
}

}  // namespace

PowerLossVfs::PowerLossVfs() : state_(std::make_unique<State>()) {
  state_->real = sqlite3_vfs_find(nullptr);
  state_->vfs = *state_->real;  // time, randomness and paths are the real ones
  state_->vfs.zName = "veneer-power-loss";
  state_->vfs.pAppData = state_.get();
  state_->vfs.szOsFile = static_cast<int>(sizeof(ShimFile)) + state_->real->szOsFile;
  state_->vfs.xOpen = do_open;
  state_->vfs.xDelete = do_delete;
  if (sqlite3_vfs_register(&state_->vfs, 1) != SQLITE_OK) std::abort();
}

PowerLossVfs::~PowerLossVfs() {
  sqlite3_vfs_register(state_->real, 1);
  sqlite3_vfs_unregister(&state_->vfs);
}

void PowerLossVfs::cut_at(int step) { state_->cut_at = step == 0 ? 0 : state_->steps + step; }
int PowerLossVfs::steps() const { return state_->steps; }
bool PowerLossVfs::is_cut() const { return state_->cut; }

void PowerLossVfs::fail_at(DiskFault fault, int nth, bool lasts) {
  state_->fault = fault;
  state_->until_fault = nth;
  state_->fault_lasts = lasts;
  state_->failed = false;
}

bool PowerLossVfs::mend() {
  state_->until_fault = 0;
  return std::exchange(state_->failed, false);
}

void PowerLossVfs::settle(Loss loss, std::uint32_t seed) {
  std::mt19937 random(seed);
  if (state_->cut) state_->at_the_cut = state_->disks;
  for (const auto& [name, disk] : state_->disks)
    if (!state_->at_the_cut.contains(name)) std::remove(name.c_str());
  state_->disks = state_->at_the_cut;
  const auto torn = [&](Change change) {
    change.bytes.resize(random() % (change.bytes.size() + 1));
    return change;
  };
  for (auto& [name, disk] : state_->disks) {
    const std::size_t came_through = loss == Loss::kTorn ? random() % (disk.pending.size() + 1) : 0;
    for (std::size_t i = 0; i < disk.pending.size(); ++i) {
      const Change& change = disk.pending[i];
      if (loss == Loss::kTorn && i < came_through)
        change_by(disk.synced, i + 1 < came_through || change.truncation ? change : torn(change));
      if (loss == Loss::kReordered && random() % 2 == 0)
        change_by(disk.synced, random() % 8 != 0 || change.truncation ? change : torn(change));
    }
    disk.pending.clear();
    std::ofstream(name, std::ios::binary | std::ios::trunc)
        .write(disk.synced.data(), static_cast<std::streamsize>(disk.synced.size()));
    std::remove((name + "-shm").c_str());
  }
  state_->cut = false;
  state_->cut_at = 0;
}

}  // namespace veneer::db
