// Asks now and then how much room the data's disk has (disk_room.h). One look at a time: a disk that hangs is not asked
// again and again.
//
// Bound to the reactor.
#pragma once

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

#include "base/clock.h"
#include "daemon/threads/worker.h"
#include "daemon/unit/disk_room.h"

namespace veneer::daemon {

class DiskWatch {
 public:
  // The worker waits for the disk, and finishes what was posted to it. All of them outlive this.
  DiskWatch(boost::asio::io_context& reactor, Worker& worker, std::filesystem::path data_dir, const Clock& clock);

  void look();
  // As DiskRoom tells it.
  std::optional<std::uintmax_t> free_bytes() const { return room_.free_bytes(); }

 private:
  boost::asio::io_context& reactor_;
  Worker& worker_;
  const std::filesystem::path data_dir_;
  DiskRoom room_;
  bool looks_ = false;
  const std::shared_ptr<int> alive_ = std::make_shared<int>();
};

}  // namespace veneer::daemon
