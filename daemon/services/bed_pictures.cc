#include "daemon/services/bed_pictures.h"

#include <fmt/format.h>

#include <utility>

namespace veneer::daemon {
namespace {

double seconds(BedPictures::WallTime::duration d) { return std::chrono::duration<double>(d).count(); }

}  // namespace

BedPictures::BedPictures(CameraDriver& camera, std::function<WallTime()> now) : camera_(camera), now_(std::move(now)) {}

void BedPictures::hands_were_in() {
  const std::lock_guard lock(mutex_);
  hands_in_ = now_();
}

BedPictures::WallTime BedPictures::hands_in() const {
  const std::lock_guard lock(mutex_);
  return hands_in_;
}

Result<BedPictures::Picture> BedPictures::take(For what, WallTime hands_in) {
  auto file = camera_.capture();
  if (!file) return file.error();
  Status fresh = check(what, hands_in);
  const auto taken = camera_.taken_at();
  const bool newer_may_come = !fresh && taken && *taken <= now_();
  return Picture{*std::move(file), std::move(fresh), newer_may_come};
}

Status BedPictures::check(For what, WallTime hands_in) const {
  const auto taken = camera_.taken_at();
  if (!taken || what == For::kPeople) return Ok();
  const auto refuse = [](std::string why) { return Error{ErrorCode::kRefused, std::move(why)}; };
  const WallTime now = now_();
  // By such a clock an old picture passes for a new one.
  if (*taken > now)
    return refuse(
        fmt::format("the picture of {} says that it was taken {:.1f} s from now, so nobody knows how old it "
                    "is: set the clock of the computer that writes it, and this one's, right",
                    device(), seconds(*taken - now)));
  if (*taken < hands_in)
    return refuse(
        fmt::format("the picture of {} was taken before hands were last at the bed or the bed was last proven, so "
                    "it shows what may lie otherwise by now: take a new one",
                    device()));
  if (what == For::kBurning && now - *taken > kOldest)
    return refuse(
        fmt::format("the picture of {} is {:.0f} s old, more than the {} s in which nobody is taken to have "
                    "been at the bed: see whether the program that takes it still runs, and take a new one",
                    device(), seconds(now - *taken), kOldest.count()));
  return Ok();
}

}  // namespace veneer::daemon
