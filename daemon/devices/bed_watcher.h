// Looks at the bed: which panel lies there, and how.
//
// The camera is waited for on the camera's worker; its pictures are looked at by worker processes
// (daemon/orders/bed_work.h). Replies come on the reactor. Bound to the reactor, except picture(), which is
// thread-safe.
#pragma once

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <vector>

#include "base/clock.h"
#include "daemon/config.h"
#include "daemon/devices/bed_pictures.h"
#include "daemon/orders/bed_work.h"
#include "daemon/store/database_thread.h"
#include "daemon/threads/reactor_timer.h"
#include "daemon/threads/worker.h"
#include "daemon/unit/bed_view.h"
#include "daemon/workers/work_runner.h"

namespace veneer::daemon {

// The panels that were on the bed when the camera saw any there last. That it does not see them any more says little:
// their tags may be covered.
struct LastSeen {
  std::vector<PanelId> panels;
  std::string at;
};

// What the camera sees at this moment, for somebody who has just laid something down. Proves nothing.
struct BedSight {
  std::vector<int> tags;
  std::vector<PanelId> panels;  // whose tags are among them, retired ones too
};

class BedWatcher final : public BedView {
 public:
  // A camera that writes a file now and then may have none yet from after the last cut: the next one is waited for, for
  // so long.
  static constexpr std::chrono::milliseconds kUsualWait{15'000};

  // `on_picture` is called on the reactor when picture() has changed. All references outlive this. `make_timer` is for
  // tests; the reactor's own by default.
  BedWatcher(boost::asio::io_context& reactor, BedPictures& pictures, Worker& camera_worker, WorkRunner& workers,
             DatabaseThread& database, const Config& config, std::function<void()> on_picture,
             std::function<std::unique_ptr<OneShotTimer>()> make_timer = {},
             std::chrono::milliseconds wait = kUsualWait);

  // kTimeout when neither the camera nor a worker has said anything for patience().
  void look(std::function<void(Result<ProvenPose>)> reply) override;
  // Gives up a look that is under way; at the end of the cell.
  void stop() { ending_.request_stop(); }

  // Blocking, on the camera's worker; picture() is then what was seen, its tags outlined.
  Result<BedSight> see();

  void hands_were_in() override { pictures_.hands_were_in(); }
  void was_cut() override { pictures_.hands_were_in(); }
  void stock_in_sight(std::function<void(Result<StockSight>)> reply) override;
  Duration patience() const;

  // The last look as JPEG, with what was found drawn in; empty before the first.
  std::string picture() const;

 private:
  using WallTime = BedPictures::WallTime;
  template <class Seen>
  std::function<void(Result<Seen>)> in_time(std::function<void(Result<Seen>)> reply);
  Result<ProvenPose> look_now(WallTime hands_in);
  Result<StockSight> stock_in_sight_now(WallTime hands_in);
  void note_seen(std::vector<PanelId> panels);
  // A fresh picture, and what `look` asks of it; kRefused when it is too old. People see it either way.
  Result<BedSeen> photograph(BedPictures::For what, WallTime hands_in, LookAtBed look);

  boost::asio::io_context& reactor_;
  BedPictures& pictures_;
  Worker& worker_;
  WorkRunner& workers_;
  DatabaseThread& database_;
  std::unique_ptr<DatabaseReader> reader_;  // of the camera's worker
  const Config& config_;
  LastSeen last_seen_;  // of the camera's worker
  std::function<void()> on_picture_;
  std::function<std::unique_ptr<OneShotTimer>()> make_timer_;
  const std::chrono::milliseconds wait_;
  std::stop_source ending_;
  mutable std::mutex picture_mutex_;
  std::string picture_;  // guarded by picture_mutex_
};

}  // namespace veneer::daemon
