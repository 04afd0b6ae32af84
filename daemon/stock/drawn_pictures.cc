#include "daemon/stock/drawn_pictures.h"

#include <algorithm>
#include <iterator>

namespace veneer::daemon {

std::optional<std::string> DrawnPictures::find(const std::string& version) const {
  const std::lock_guard lock(mutex_);
  const auto known = std::ranges::find(drawn_, version, &Drawn::version);
  if (known == drawn_.end()) return std::nullopt;
  drawn_.splice(drawn_.begin(), drawn_, known);
  known->asked = std::chrono::steady_clock::now();
  return known->file;
}

void DrawnPictures::keep(const std::string& version, const std::string& file) const {
  if (file.size() > most_bytes_ / 2) return;
  const std::lock_guard lock(mutex_);
  std::erase_if(drawn_, [&](const Drawn& one) { return one.version == version; });
  drawn_.push_front({version, file, std::chrono::steady_clock::now()});
  std::size_t bytes = 0;
  for (auto one = drawn_.begin(); one != drawn_.end();) {
    bytes += one->file.size();
    one = bytes > most_bytes_ ? drawn_.erase(one) : std::next(one);
  }
}

void DrawnPictures::forget_unasked(std::chrono::steady_clock::time_point since) const {
  const std::lock_guard lock(mutex_);
  std::erase_if(drawn_, [&](const Drawn& one) { return one.asked < since; });
}

}  // namespace veneer::daemon
