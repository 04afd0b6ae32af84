#include "daemon/devices/bed_pictures.h"

#include <fmt/format.h>

#include <cmath>
#include <condition_variable>
#include <cstdint>
#include <fstream>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>

#include "base/files.h"
#include "base/hash.h"

namespace veneer::daemon {
namespace {

std::int64_t to_us(BedPictures::WallTime time) {
  return std::chrono::duration_cast<std::chrono::microseconds>(time.time_since_epoch()).count();
}

double seconds(BedPictures::WallTime::duration d) { return std::chrono::duration<double>(d).count(); }

}  // namespace

BedPictures::BedPictures(CameraDriver& camera, std::filesystem::path memory, std::function<WallTime()> now)
    : camera_(camera), memory_(std::move(memory)), now_(std::move(now)) {
  recall();
}

void BedPictures::recall() {
  std::ifstream in(memory_, std::ios::binary);
  const auto known = nlohmann::json::parse(in, nullptr, false);
  if (!known.is_object()) return;
  if (const auto sha256 = known.find("sha256"); sha256 != known.end() && sha256->is_string()) last_sha256_ = *sha256;
  if (const auto taken = known.find("taken_us"); taken != known.end() && taken->is_number_integer())
    last_taken_ = WallTime(std::chrono::microseconds(taken->get<std::int64_t>()));
}

// Before the picture counts: it holds through a kill as well.
void BedPictures::remember() const {
  if (memory_.empty()) return;
  nlohmann::json known = {{"sha256", last_sha256_}};
  if (last_taken_) known["taken_us"] = to_us(*last_taken_);
  const std::string text = known.dump();
  static_cast<void>(write_whole(memory_, std::as_bytes(std::span(text))));
}

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
  const bool same_file = taken && last_taken_ && to_us(*taken) == to_us(*last_taken_);
  if (sha256 == last_sha256_ && !same_file) return true;
  last_sha256_ = sha256;
  last_taken_ = taken;
  remember();
  return false;
}

Result<BedPictures::Picture> BedPictures::take_newer(For what, WallTime hands_in, std::chrono::milliseconds patience,
                                                     const std::stop_token& stop) {
  auto picture = newest(what, hands_in, patience, stop);
  // Of a picture for people nobody asks how old it is, so it says nothing of that.
  if (picture && what != For::kPeople) {
    const std::lock_guard lock(mutex_);
    last_fresh_ = picture->fresh;
  }
  return picture;
}

Status BedPictures::last_fresh() const {
  const std::lock_guard lock(mutex_);
  return last_fresh_;
}

Result<BedPictures::Picture> BedPictures::newest(For what, WallTime hands_in, std::chrono::milliseconds patience,
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
