#include "daemon/devices/bed_glances.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <chrono>
#include <utility>

#include "daemon/orders/bed_json.h"
#include "daemon/orders/bed_work.h"
#include "daemon/orders/have_done.h"
#include "daemon/workers/work_folder.h"

namespace veneer::daemon {
namespace {

constexpr Duration kEvery = std::chrono::seconds(2);
constexpr int kShare = 8;  // one of so many parts of the time
constexpr std::chrono::seconds kReadingLimit{10};
constexpr Duration kSilent = kReadingLimit + std::chrono::seconds(5);
// After what took longer than a silent camera is waited for, so that one that is well again is asked.
constexpr Duration kLongestRest = (kShare - 1) * kSilent;
constexpr int kWidthPx = 960;

}  // namespace

void BedGlances::ask(std::stop_token gone, Reply reply) {
  std::erase_if(waiting_, [](const Asked& asked) { return asked.gone.stop_requested(); });
  if (silent_ && work_.expired()) under_way_ = silent_ = false;  // what came of it is lost, or late: it is begun anew
  if (silent_) return reply(silence());
  if (under_way_) return waiting_.push_back({std::move(gone), std::move(reply)});
  if (const Status may = may_(); !may) return reply(may.error());
  const TimePoint now = parts_.clock.now();
  if (now < next_) return reply(newest_);
  const auto took = std::make_shared<Duration>(0);
  const int number = ++number_;
  const bool taken = parts_.camera_worker.try_post_giving_way([this, number, took](const std::stop_token& stop) {
    const TimePoint from = parts_.clock.now();
    auto picture = caught([&] { return glance(stop); });
    *took = parts_.clock.now() - from;
    if (!picture && stop.stop_requested())
      picture =
          Error{ErrorCode::kConflict, "the camera is needed for more than watching: ask again when it has looked"};
    boost::asio::post(parts_.reactor, [this, number, picture = std::move(picture), took = *took]() mutable {
      seen(number, std::move(picture), took);
    });
  });
  if (!taken) return reply(Error{ErrorCode::kConflict, "the camera is at work: ask again when it has looked"});
  work_ = took;
  begun_ = now;
  under_way_ = true;
  waiting_.push_back({std::move(gone), std::move(reply)});
  parts_.timer->after(kSilent, [this, number] {
    if (number != number_ || !under_way_) return;
    silent_ = true;
    answer(silence());
  });
}

void BedGlances::seen(int number, Result<Picture> picture, Duration took) {
  if (number != number_) return;  // it was given up
  parts_.timer->cancel();
  under_way_ = silent_ = false;
  // Whatever came of it: a reading that met its deadline has had the computer, and one that a look broke off the
  // camera.
  next_ = std::max(begun_ + kEvery, parts_.clock.now() + std::min((kShare - 1) * took, kLongestRest));
  newest_ = std::move(picture);
  answer(newest_);
}

void BedGlances::answer(const Result<Picture>& picture) {
  for (const Asked& asked : std::exchange(waiting_, {}))
    if (!asked.gone.stop_requested()) asked.reply(picture);
}

Error BedGlances::silence() const {
  return {ErrorCode::kTimeout,
          fmt::format("{} has been asked for a picture and gives none: see whether it is still there",
                      parts_.camera.device())};
}

Result<BedGlances::Picture> BedGlances::glance(const std::stop_token& stop) const {
  const auto file = parts_.camera.glance(stop);
  if (!file) return file.error();
  // A look waits by now: no process is begun that it would have to see ended first.
  if (stop.stop_requested()) return Error{ErrorCode::kCancelled, "watching the bed was cancelled"};
  const auto written = parts_.camera.taken_at();
  const Duration old =
      written ? std::max<Duration>(Duration(0), std::chrono::system_clock::now() - *written) : Duration(0);
  const TimePoint taken = parts_.clock.now() - old;
  const auto folder = WorkFolder::make(parts_.config.store.data_dir);
  if (!folder) return folder.error();
  LookAtBed look;
  look.file = file->string();
  look.shown_px = kWidthPx;
  WorkOrder order;
  order.kind = LookAtBed::kKind;
  order.what = "watching the bed";
  order.folder = folder->path();
  order.readable = {*file};
  order.deadline = kReadingLimit;
  const auto read = have_done<BedSeen>(
      parts_.workers, std::move(order), look, [](double, const std::string&) {}, stop);
  if (!read) return read.error();
  auto jpeg = folder->made(kMadeBedPicture, kMostBedPictureBytes);
  if (!jpeg) return Error{ErrorCode::kInternal, "watching the bed made no picture: try again"};
  return std::make_shared<const BedGlance>(BedGlance{*std::move(jpeg), taken});
}

}  // namespace veneer::daemon
