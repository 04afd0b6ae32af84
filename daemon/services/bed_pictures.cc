#include "daemon/services/bed_pictures.h"

#include <fmt/format.h>

#include <cmath>
#include <condition_variable>
#include <utility>

#include "base/hash.h"

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
  Picture out{*std::move(file), check(what, hands_in)};
  const auto taken = camera_.taken_at();
  out.newer_may_come = !out.fresh && taken && *taken <= now_();
  if (what == For::kPeople) return out;
  if (auto content = sha256_hex_of_file(out.file)) out.sha256 = *std::move(content);
  if (!is_repeated(out.sha256)) return out;
  out.fresh = Error{ErrorCode::kUnavailable,
                    fmt::format("{} gives the same picture again, to the last bit, so it hangs: switch it off and on, "
                                "and see that the program that takes its pictures runs",
                                device())};
  out.newer_may_come = true;
  return out;
}

// A file that stays as it was put there is one picture, of one time.
bool BedPictures::is_repeated(const std::string& sha256) {
  if (sha256.empty()) return false;
  const auto taken = camera_.taken_at();
  const bool same_file = taken && taken == last_taken_;
  if (sha256 == last_sha256_ && !same_file) return true;
  last_sha256_ = sha256;
  last_taken_ = taken;
  return false;
}

Result<BedPictures::Picture> BedPictures::take_newer(For what, WallTime hands_in, std::chrono::milliseconds patience,
                                                     const std::stop_token& stop) {
  constexpr std::chrono::milliseconds kPause{500};
  std::mutex mutex;
  std::condition_variable_any pause;
  const auto until = std::chrono::steady_clock::now() + patience;
  for (;;) {
    auto picture = take(what, hands_in);
    if (!picture || picture->fresh || !picture->newer_may_come) return picture;
    if (std::chrono::steady_clock::now() >= until) return picture;
    std::unique_lock lock(mutex);
    pause.wait_for(lock, stop, kPause, [] { return false; });
    if (stop.stop_requested()) return Error{ErrorCode::kCancelled, "cancelled"};
  }
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
        fmt::format("the picture of {} was taken before hands were last at the bed, the bed was last proven or the "
                    "last piece was cut, so "
                    "it shows what may lie otherwise by now: take a new one",
                    device()));
  if (what == For::kBurning && now - *taken > kOldest)
    return refuse(
        fmt::format("the picture of {} was taken {:.1f} s ago, and {} s is the longest that nobody is taken to have "
                    "been at the bed: see whether the program that takes it still runs, and take a new one",
                    device(), std::ceil(10 * seconds(now - *taken)) / 10, kOldest.count()));
  return Ok();
}

}  // namespace veneer::daemon
