#include "daemon/unit/disk_watch.h"

#include <boost/asio/post.hpp>
#include <system_error>
#include <utility>

namespace veneer::daemon {

DiskWatch::DiskWatch(boost::asio::io_context& reactor, Worker& worker, std::filesystem::path data_dir,
                     const Clock& clock)
    : reactor_(reactor), worker_(worker), data_dir_(std::move(data_dir)), room_(clock) {}

void DiskWatch::look() {
  if (std::exchange(looks_, true)) return;
  worker_.post([this, alive = std::weak_ptr(alive_), &reactor = reactor_, data = data_dir_] {
    std::error_code failed;
    const auto room = std::filesystem::space(data, failed);
    const auto free = failed ? std::nullopt : std::optional(room.available);
    boost::asio::post(reactor, [this, alive, free] {
      if (alive.expired()) return;
      looks_ = false;
      room_.told(free);
    });
  });
}

}  // namespace veneer::daemon
