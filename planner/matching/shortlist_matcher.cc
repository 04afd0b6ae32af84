#include "planner/matching/shortlist_matcher.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "base/hash.h"
#include "planner/matching/shortlist_search.h"
#include "planner/parallel.h"

namespace veneer::planner {

ShortlistMatcher::ShortlistMatcher(std::vector<MatchPanel> all_panels, std::vector<Radians> turns,
                                   std::vector<WindowClass> classes, double largest_response)
    : Matcher(std::move(all_panels), std::move(turns)) {
  entries_per_unit_ = largest_score_entry(panels().front().features.pixels.channels()) / largest_response;
  for (const WindowClass& windows : classes) classes_.push_back({windows, cell_grid(windows)});
}

void ShortlistMatcher::keep_index(IndexCache cache, std::vector<std::string> names) {
  kept_ = Kept{std::move(cache), std::move(names), std::vector<std::string>(panels().size())};
}

void ShortlistMatcher::build_index(int threads, const std::stop_token& stop, const IndexProgress& progress) {
  const std::size_t panel_count = panels().size(), class_count = classes_.size();
  entries_.resize(panel_count);
  blocked_.assign(panel_count, std::vector<BlockedPixels>(class_count));
  indexed_.resize(class_count);
  for (auto& it : indexed_) it.resize(lattices());

  std::vector<WindowClass> windows_of_classes;
  for (const Class& it : classes_) windows_of_classes.push_back(it.windows);
  measure_clearance(windows_of_classes, threads, stop);
  run_parallel(panel_count * (1 + class_count), threads, stop, [&](std::size_t task) {
    const std::size_t p = task % panel_count;
    const MatchPanel& panel = panels()[p];
    if (task < panel_count) {
      entries_[p] = rounded_entries(panel.features.pixels, entries_per_unit_, stop);
      if (kept_)
        kept_->hashes[p] = sha256_hex(
            std::as_bytes(std::span(entries_[p].ptr<std::int16_t>(0), entries_[p].total() * entries_[p].channels())),
            stop);
      return;
    }
    find_blocked(p, task / panel_count - 1, stop);
  });
  if (stop.stop_requested()) return;

  const std::size_t tasks = class_count * lattices();
  run_parallel(
      tasks, threads, stop, [&](std::size_t task) { index_lattice(task % lattices(), task / lattices(), stop); },
      [&](std::size_t done) {
        if (progress) progress(static_cast<double>(done) / static_cast<double>(tasks));
      });
  blocked_.clear();
}

void ShortlistMatcher::find_blocked(std::size_t p, std::size_t window_class, const std::stop_token& stop) {
  const MatchPanel& panel = panels()[p];
  const WindowClass& windows = classes_[window_class].windows;
  if (!windows.filled) return;
  const double side = std::min(windows.right - windows.left, windows.bottom - windows.top);
  blocked_[p][window_class] =
      blocked_pixels(panel.wood.raster(), panel.features.resolution.to_mm(Pixels(std::max(side, 1.0))), stop);
}

PlaceBits ShortlistMatcher::places_of(std::size_t at, std::size_t window_class, const std::stop_token& stop) const {
  const auto p = static_cast<std::size_t>(panel_of(at));
  const MatchPanel& panel = panels()[p];
  return {lattice_at(at),      classes_[window_class].windows,
          panel.features,      blocked_[p][window_class],
          panel.wood.border(), stop};
}

void ShortlistMatcher::find_places(int threads, const std::stop_token& stop) {
  const std::size_t panel_count = panels().size(), class_count = classes_.size();
  blocked_.assign(panel_count, std::vector<BlockedPixels>(class_count));
  run_parallel(panel_count * class_count, threads, stop,
               [&](std::size_t task) { find_blocked(task % panel_count, task / panel_count, stop); });
  if (stop.stop_requested()) return;
  run_parallel(class_count * lattices(), threads, stop, [&](std::size_t task) {
    const std::size_t at = task % lattices(), window_class = task / lattices();
    Indexed& it = *indexed_[window_class][at];
    it.places = places_of(at, window_class, stop);
    if (stop.stop_requested()) return;
    it.map.find_alive(it.places, {0, 0, it.places.width(), it.places.height()}, stop);
  });
  blocked_.clear();
}

void ShortlistMatcher::index_lattice(std::size_t at, std::size_t window_class, const std::stop_token& stop) {
  const Class& it = classes_[window_class];
  const auto p = static_cast<std::size_t>(panel_of(at));
  const Lattice& lattice = lattice_at(at);
  auto& out = indexed_[window_class][at];
  out = std::make_unique<Indexed>(
      Indexed{places_of(at, window_class, stop),
              CoarseMap(entries_[p].size(), entries_[p].channels(), lattice, it.grid, it.windows.filled)});
  measure(out->map, at, window_class, stop);
  if (stop.stop_requested()) return;
  out->map.find_alive(out->places, {0, 0, lattice.width(), lattice.height()}, stop);
  if (it.windows.filled) out->map.find_bounds(stop);
}

void ShortlistMatcher::measure(CoarseMap& map, std::size_t at, std::size_t window_class, const std::stop_token& stop) {
  const auto p = static_cast<std::size_t>(panel_of(at));
  const Lattice& lattice = lattice_at(at);
  if (!kept_) return map.measure(entries_[p], lattice, stop);
  const WindowClass& windows = classes_[window_class].windows;
  const std::string name = IndexCache::entry_name(kept_->names[p], window_class, rotation_of(at));
  const std::string key =
      fmt::format("{} {}x{} windows {}x{} {} turn {}", kept_->hashes[p], entries_[p].cols, entries_[p].rows,
                  windows.width, windows.height, windows.filled ? "filled" : "partly", lattice.turn().count());
  if (kept_->cache.load(name, key, map.measured(), stop)) return;
  map.measure(entries_[p], lattice, stop);
  if (stop.stop_requested()) return;
  if (Status status = kept_->cache.store(name, key, map.measured(), stop); !status.ok()) {
    const std::lock_guard lock(not_kept_mutex_);
    if (!not_kept_) not_kept_ = status.error();
  }
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

std::optional<Candidate> ShortlistMatcher::best(const MatchPatch& patch, const std::stop_token& stop) const {
  const auto found = ShortlistSearch(*this, patch, stop).run(1);
  if (found.empty()) return std::nullopt;
  return found.front();
}

std::vector<Candidate> ShortlistMatcher::places(const MatchPatch& patch, std::size_t count,
                                                const std::stop_token& stop) const {
  return ShortlistSearch(*this, patch, stop).run(count);
}

}  // namespace veneer::planner
