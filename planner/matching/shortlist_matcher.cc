#include "planner/matching/shortlist_matcher.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <span>

#include "base/hash.h"
#include "planner/matching/shortlist_search.h"
#include "planner/parallel.h"

namespace veneer::planner {

ShortlistMatcher::ShortlistMatcher(std::vector<MatchPanel> all_panels, std::vector<Radians> turns,
                                   const std::vector<WindowClass>& classes, double largest_response,
                                   double thoroughness)
    : Matcher(std::move(all_panels), std::move(turns)), thoroughness_(thoroughness), windows_(classes), odd_(classes) {
  entries_per_unit_ = largest_score_entry(panels().front().features.pixels.channels()) / largest_response;
  for (const WindowClass& windows : classes) {
    class_numbers_.push_back(windows.filled ? classes_.size() : std::numeric_limits<std::size_t>::max());
    if (windows.filled) classes_.push_back({windows, cell_grid(windows)});
  }
  first_odd_ = classes_.size();
  for (std::size_t scale = 0; scale < odd_.scales(); ++scale) classes_.push_back({odd_.windows(), odd_.grid(scale)});
}

void ShortlistMatcher::keep_index(IndexCache cache, std::vector<std::string> names) {
  kept_ = Kept{std::move(cache), std::move(names), std::vector<std::string>(panels().size())};
}

Status ShortlistMatcher::build_index(int threads, const std::stop_token& stop, const IndexProgress& progress) {
  const std::size_t panel_count = panels().size(), class_count = classes_.size();
  entries_.resize(panel_count);
  blocked_.assign(panel_count, std::vector<BlockedPixels>(class_count));
  indexed_.resize(class_count);
  for (auto& it : indexed_) it.resize(lattices());

  if (Status done = measure_clearance(windows_, threads, stop); !done.ok()) return done;
  Status done = run_parallel(panel_count * (1 + class_count), threads, stop, [&](std::size_t task) -> Status {
    const std::size_t p = task % panel_count;
    if (task >= panel_count) return find_blocked(p, task / panel_count - 1, stop);
    const Result<cv::Mat> entries = rounded_entries(panels()[p].features.pixels, entries_per_unit_, stop);
    if (!entries.ok()) return entries.error();
    entries_[p] = *entries;
    if (!kept_) return Ok();
    Result<std::string> hash = sha256_hex(
        std::as_bytes(std::span(entries_[p].ptr<std::int16_t>(0), entries_[p].total() * entries_[p].channels())), stop);
    if (!hash.ok()) return hash.error();
    kept_->hashes[p] = std::move(*hash);
    return Ok();
  });
  if (!done.ok()) return done;

  const std::size_t tasks = class_count * lattices();
  done = run_parallel(
      tasks, threads, stop, [&](std::size_t task) { return index_lattice(task % lattices(), task / lattices(), stop); },
      [&](std::size_t begun) {
        if (progress) progress(static_cast<double>(begun) / static_cast<double>(tasks));
      });
  blocked_.clear();
  return done;
}

Status ShortlistMatcher::find_blocked(std::size_t p, std::size_t window_class, const std::stop_token& stop) {
  const MatchPanel& panel = panels()[p];
  const WindowClass& windows = classes_[window_class].windows;
  if (!windows.filled) return Ok();
  const double side = std::min(windows.right - windows.left, windows.bottom - windows.top);
  Result<BlockedPixels> blocked =
      blocked_pixels(panel.wood.raster(), panel.features.resolution.to_mm(Pixels(std::max(side, 1.0))), stop);
  if (!blocked.ok()) return blocked.error();
  blocked_[p][window_class] = std::move(*blocked);
  return Ok();
}

Result<PlaceBits> ShortlistMatcher::places_of(std::size_t at, std::size_t window_class,
                                              const std::stop_token& stop) const {
  const auto p = static_cast<std::size_t>(panel_of(at));
  const MatchPanel& panel = panels()[p];
  return PlaceBits::make(lattice_at(at), classes_[window_class].windows, panel.features, blocked_[p][window_class],
                         panel.wood.border(), stop);
}

Status ShortlistMatcher::find_places(int threads, const std::stop_token& stop) {
  const std::size_t panel_count = panels().size(), class_count = classes_.size();
  blocked_.assign(panel_count, std::vector<BlockedPixels>(class_count));
  Status done = run_parallel(panel_count * class_count, threads, stop, [&](std::size_t task) {
    return find_blocked(task % panel_count, task / panel_count, stop);
  });
  if (!done.ok()) return done;
  done = run_parallel(class_count * lattices(), threads, stop, [&](std::size_t task) -> Status {
    const std::size_t at = task % lattices(), window_class = task / lattices();
    Indexed& it = *indexed_[window_class][at];
    Result<PlaceBits> places = places_of(at, window_class, stop);
    if (!places.ok()) return places.error();
    it.places = std::move(*places);
    return it.map.find_alive(it.places, {0, 0, it.places.width(), it.places.height()}, stop);
  });
  blocked_.clear();
  return done;
}

Status ShortlistMatcher::index_lattice(std::size_t at, std::size_t window_class, const std::stop_token& stop) {
  const Class& it = classes_[window_class];
  const auto p = static_cast<std::size_t>(panel_of(at));
  const Lattice& lattice = lattice_at(at);
  Result<PlaceBits> places = places_of(at, window_class, stop);
  if (!places.ok()) return places.error();
  auto& out = indexed_[window_class][at];
  out = std::make_unique<Indexed>(Indexed{
      std::move(*places), CoarseMap(entries_[p].size(), entries_[p].channels(), lattice, it.grid, it.windows.filled)});
  if (Status done = measure(out->map, at, window_class, stop); !done.ok()) return done;
  Status done = out->map.find_alive(out->places, {0, 0, lattice.width(), lattice.height()}, stop);
  return done.ok() && it.windows.filled ? out->map.find_bounds(stop) : done;
}

Status ShortlistMatcher::measure(CoarseMap& map, std::size_t at, std::size_t window_class,
                                 const std::stop_token& stop) {
  const auto p = static_cast<std::size_t>(panel_of(at));
  const Lattice& lattice = lattice_at(at);
  if (!kept_) return map.measure(entries_[p], lattice, stop);
  const Class& it = classes_[window_class];
  const std::string of = it.windows.filled ? fmt::format("windows {}x{} filled", it.windows.width, it.windows.height)
                                           : fmt::format("cells {}x{} of any window", it.grid.width, it.grid.height);
  const std::string name = IndexCache::entry_name(kept_->names[p], window_class, rotation_of(at));
  const std::string key = fmt::format("{} {}x{} {} turn {}", kept_->hashes[p], entries_[p].cols, entries_[p].rows, of,
                                      lattice.turn().count());
  const Result<bool> loaded = kept_->cache.load(name, key, map.measured(), stop);
  if (!loaded.ok()) return loaded.error();
  if (*loaded) return Ok();
  if (Status done = map.measure(entries_[p], lattice, stop); !done.ok()) return done;
  Status stored = kept_->cache.store(name, key, map.measured(), stop);
  if (stored.ok() || stored.error().code == ErrorCode::kCancelled) return stored;
  // The plan is whole without it.
  const std::lock_guard lock(not_kept_mutex_);
  if (!not_kept_) not_kept_ = stored.error();
  return Ok();
}

void ShortlistMatcher::remove(int panel, const std::vector<Ring<PanelFrame>>& taken) {
  const MatchPanel& it = panels()[static_cast<std::size_t>(panel)];
  for (auto& of_class : indexed_) {
    for (int r = 0; r < rotations(); ++r) {
      Indexed& indexed = *of_class[static_cast<std::size_t>(panel * rotations() + r)];
      indexed.map.find_alive(indexed.places, indexed.places.remove(taken, it.features, it.wood.kerf()));
    }
  }
}

std::size_t ShortlistMatcher::index_bytes() const {
  std::size_t sum = clearance_bytes();
  for (const cv::Mat& entries : entries_) sum += entries.total() * entries.elemSize();
  for (const auto& of_class : indexed_)
    for (const auto& it : of_class) sum += it ? it->places.bytes() + it->map.bytes() : 0;
  return sum;
}

Result<std::optional<LatticeCandidate>> ShortlistMatcher::best(const MatchPatch& patch,
                                                               const std::stop_token& stop) const {
  const auto found = ShortlistSearch(*this, patch, stop).run(1);
  if (!found.ok()) return found.error();
  return found->empty() ? std::optional<LatticeCandidate>() : found->front();
}

Result<std::vector<LatticeCandidate>> ShortlistMatcher::candidates(const MatchPatch& patch, std::size_t count,
                                                                   const std::stop_token& stop) const {
  return ShortlistSearch(*this, patch, stop).run(count);
}

}  // namespace veneer::planner
