// Pictures of the bed for people who watch it: glances. A glance is no look (bed_watcher.h): nothing is proven by it,
// nothing is noted of it, and it gives way to all else.
//
// Taken only when somebody asks, so that nothing is when nobody watches; only while the unit may be watched, cutting
// included, and the camera has nothing else to do; and not more often than each 2 s, however many ask: the newest one
// is for all of them. All other work of the camera breaks a glance off. What may not be is the exposure, which a look
// might have to wait for. So that a slow camera, and a computer that has much to do, are asked less often, glances have
// at most an eighth of the time, exposure and reading together, whether a picture comes of it, an error, or it is
// broken off; a picture may so be shown until it is some eight times as old as what it took. A camera that gives
// nothing at all is not waited for beyond 15 s; once it answers, it has rest for 105 s at most.
//
// Bound to the reactor; pictures are taken on the camera's worker and read by worker processes.
#pragma once

#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "base/clock.h"
#include "daemon/config.h"
#include "daemon/threads/reactor_timer.h"
#include "daemon/threads/worker.h"
#include "daemon/workers/work_runner.h"
#include "drivers/camera_driver.h"

namespace veneer::daemon {

struct BedGlance {
  std::string jpeg;
  TimePoint taken;
};

class BedGlances {
 public:
  struct Parts {
    boost::asio::io_context& reactor;
    CameraDriver& camera;
    Worker& camera_worker;
    WorkRunner& workers;
    const Config& config;
    const Clock& clock;                   // real time
    std::unique_ptr<OneShotTimer> timer;  // the same
  };
  using Picture = std::shared_ptr<const BedGlance>;
  using Reply = std::function<void(const Result<Picture>&)>;

  // `may` is asked before a picture is taken or an old one given. All references outlive this, and the camera's worker
  // ends before it does.
  BedGlances(Parts parts, std::function<Status()> may) : parts_(std::move(parts)), may_(std::move(may)) {}

  // The newest picture, at once when it is not yet time for another one. Else kConflict, with the reason in a sentence,
  // when there may be none now, kTimeout when the camera is silent, or why it gave none. Somebody who has `gone` is not
  // told.
  void ask(std::stop_token gone, Reply reply);
  Duration age(const BedGlance& picture) const { return parts_.clock.now() - picture.taken; }

 private:
  struct Asked {
    std::stop_token gone;
    Reply reply;
  };
  Result<Picture> glance(const std::stop_token& stop) const;
  // `took`: with the camera, and until it was read.
  void seen(int number, Result<Picture> picture, Duration took);
  void answer(const Result<Picture>& picture);
  Error silence() const;

  Parts parts_;
  std::function<Status()> may_;
  std::vector<Asked> waiting_;  // for the one under way
  bool under_way_ = false;
  bool silent_ = false;                 // the one under way
  int number_ = 0;                      // of the last one
  std::weak_ptr<const Duration> work_;  // of the last one; expired once the worker has done with it
  TimePoint begun_;                     // the last one
  TimePoint next_{};                    // before that there is no other
  Result<Picture> newest_ = Picture();  // null before the first
};

}  // namespace veneer::daemon
