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

bool DrawnPictures::forget_unasked(std::chrono::steady_clock::time_point since) const {
  std::list<Drawn> gone;  // freed when others may ask again
  const std::lock_guard lock(mutex_);
  // The last one asked for stands first.
  const auto first = std::ranges::find_if(drawn_, [&](const Drawn& one) { return one.asked < since; });
  gone.splice(gone.end(), drawn_, first, drawn_.end());
  return !gone.empty();
}

}  // namespace veneer::daemon
