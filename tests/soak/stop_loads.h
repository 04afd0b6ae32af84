// What a daemon is kept busy with while STOP is measured: each load begins when it is made and ends with it.
#pragma once

#include <condition_variable>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/laser_only_cell.h"

namespace veneer::tests {

class StopLoad {
 public:
  virtual ~StopLoad() = default;
  // What it has done so far, for people: a load that did nothing measures nothing.
  virtual std::string done() const = 0;
  // An error while it is not what its name says.
  virtual Status applied() const = 0;
};

struct StopLoadKind {
  std::string name;
  // Begins it on a cell whose daemon listens on TCP too. `bin_dir` holds the programs, `work_dir` is the load's own.
  std::function<std::unique_ptr<StopLoad>(const LaserOnlyCell& cell, const std::filesystem::path& bin_dir,
                                          const std::filesystem::path& work_dir)>
      begin;
  bool stalled_log = false;  // the daemon's log goes to a pipe that nobody reads and that is full
};

// quiet, log, events, ledger, planning, events+planning, upload, json, hang-up.
std::vector<StopLoadKind> stop_loads();

// A data folder with a panel of which 100,000 pieces are booked, and one whose wood is free, to plan on.
Status prepare_stop_data(const std::filesystem::path& data_dir);
// The camera of a daemon with this data: it sees an empty bed.
std::string table_of_camera(const std::filesystem::path& data_dir);
// The program of that camera: it writes its picture five times a second.
class EmptyBed {
 public:
  explicit EmptyBed(const std::filesystem::path& data_dir);
  ~EmptyBed();
  EmptyBed(const EmptyBed&) = delete;
  EmptyBed& operator=(const EmptyBed&) = delete;

 private:
  void take_pictures();

  const std::filesystem::path file_;
  std::mutex mutex_;
  std::condition_variable end_;
  bool ending_ = false;  // guarded by mutex_
  std::thread thread_;
};

// The kerf of a laser at this port, without which nothing is planned.
Status certify_kerf(const std::filesystem::path& data_dir, const std::string& laser_port);

// A named pipe without room: whoever writes to it without looking waits for ever.
class FullPipe {
 public:
  explicit FullPipe(const std::filesystem::path& path);
  ~FullPipe();
  FullPipe(const FullPipe&) = delete;
  FullPipe& operator=(const FullPipe&) = delete;
  bool is_full() const;

 private:
  int descriptor_;
};

}  // namespace veneer::tests
