#include "daemon/services/bed_glances.h"

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
constexpr int kShareOfTheCamera = 8;  // one of so many parts of its time
constexpr std::chrono::seconds kReadingLimit{10};
constexpr Duration kSilent = kReadingLimit + std::chrono::seconds(5);
constexpr int kWidthPx = 960;

}  // namespace

void BedGlances::ask(std::stop_token gone, Reply reply) {
  const TimePoint now = parts_.clock.now();
  std::erase_if(waiting_, [](const Asked& asked) { return asked.gone.stop_requested(); });
  if (under_way_) {
    if (now - begun_ < kSilent) return waiting_.push_back({std::move(gone), std::move(reply)});
    return reply(Error{ErrorCode::kTimeout,
                       fmt::format("{} has been asked for a picture and gives none: see whether it is still there",
                                   parts_.camera.device())});
  }
  if (now < next_) return reply(newest_);
  if (const Status may = may_(); !may) return reply(may.error());
  const bool taken = parts_.camera_worker.try_post_giving_way([this](const std::stop_token& stop) {
    Duration exposed{0};
    auto picture = caught([&] { return glance(stop, exposed); });
    if (!picture && stop.stop_requested())
      picture =
          Error{ErrorCode::kConflict, "the camera is needed for more than watching: ask again when it has looked"};
    boost::asio::post(parts_.reactor,
                      [this, picture = std::move(picture), exposed]() mutable { seen(std::move(picture), exposed); });
  });
  if (!taken) return reply(Error{ErrorCode::kConflict, "the camera is at work: ask again when it has looked"});
  begun_ = now;
  under_way_ = true;
  waiting_.push_back({std::move(gone), std::move(reply)});
}

void BedGlances::seen(Result<Picture> picture, Duration exposed) {
  under_way_ = false;
  next_ = begun_ + std::max(kEvery, kShareOfTheCamera * exposed);
  newest_ = std::move(picture);
  for (const Asked& asked : std::exchange(waiting_, {}))
    if (!asked.gone.stop_requested()) asked.reply(newest_);
}

Result<BedGlances::Picture> BedGlances::glance(const std::stop_token& stop, Duration& exposed) const {
  const TimePoint from = parts_.clock.now();
  const auto file = parts_.camera.glance(stop);
  exposed = parts_.clock.now() - from;
  if (!file) return file.error();
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
