// Fast matching: every cell of places is scored by an estimate, the best few hundred are looked at.
//
// From coarse to fine: an estimated cost for every cell that has a free place (coarse_map.h); the cost at the place in
// the middle of the best thousand, on a sample of pixels that grows as the list shrinks; all free places of the best of
// those; the exact cost (patch_pixels.h) of the best few. What the shortlist misses is measured in the tests and in
// docs/PLANNER.md. When cells are few, all are looked at.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "planner/matching/coarse_map.h"
#include "planner/matching/index_cache.h"
#include "planner/matching/matcher.h"
#include "planner/matching/odd_windows.h"
#include "planner/matching/window_samples.h"

namespace veneer::planner {

class ShortlistMatcher final : public Matcher {
 public:
  // `largest_response` bounds the absolute value of all features; `thoroughness` is PlanOptions'.
  ShortlistMatcher(std::vector<MatchPanel> panels, std::vector<Radians> turns, const std::vector<WindowClass>& classes,
                   double largest_response, double thoroughness = 1);

  // To be called before build_index(): what is measured of panels is read from `cache` where it was kept, and kept
  // there. `names` tells the panels apart, across plans.
  void keep_index(IndexCache cache, std::vector<std::string> names);
  // The first of the entries that could not be kept.
  const std::optional<Error>& not_kept() const { return not_kept_; }

  Status build_index(int threads, const std::stop_token& stop, const IndexProgress& progress = {}) override;
  std::size_t index_bytes() const override;

  Result<std::optional<LatticeCandidate>> best(const MatchPatch& patch, const std::stop_token& stop) const override;
  Result<std::vector<LatticeCandidate>> candidates(const MatchPatch& patch, std::size_t count,
                                                   const std::stop_token& stop) const override;

 private:
  friend class ShortlistSearch;

  // What is indexed by itself: a class of filled windows, or one scale of the others.
  struct Class {
    WindowClass windows;
    CellGrid grid;
  };
  // One lattice for one of them.
  struct Indexed {
    PlaceBits places;
    CoarseMap map;
  };

  void remove(int panel, const std::vector<Ring<PanelFrame>>& taken) override;
  Status find_places(int threads, const std::stop_token& stop) override;
  Status find_blocked(std::size_t panel, std::size_t window_class, const std::stop_token& stop);
  Result<PlaceBits> places_of(std::size_t lattice, std::size_t window_class, const std::stop_token& stop) const;
  Status index_lattice(std::size_t lattice, std::size_t window_class, const std::stop_token& stop);
  Status measure(CoarseMap& map, std::size_t lattice, std::size_t window_class, const std::stop_token& stop);
  // Which of classes_ a patch is matched with.
  std::size_t class_of(const MatchPatch& patch) const {
    const std::size_t own = class_numbers_[patch.window_class];
    return own < classes_.size() ? own : first_odd_ + odd_.scale_of(patch.pixels);
  }
  std::size_t lattices() const { return panels().size() * static_cast<std::size_t>(rotations()); }
  int panel_of(std::size_t lattice) const { return static_cast<int>(lattice) / rotations(); }
  int rotation_of(std::size_t lattice) const { return static_cast<int>(lattice) % rotations(); }
  const Lattice& lattice_at(std::size_t lattice) const {
    return this->lattice(panel_of(lattice), rotation_of(lattice));
  }

  struct Kept {
    IndexCache cache;
    std::vector<std::string> names, hashes;  // per panel; of its entries
  };

  double entries_per_unit_, thoroughness_;
  std::optional<Kept> kept_;
  std::mutex not_kept_mutex_;
  std::optional<Error> not_kept_;
  std::vector<WindowClass> windows_;  // as they were given
  OddWindows odd_;
  std::vector<Class> classes_;
  std::vector<std::size_t> class_numbers_;                      // of windows_ in classes_; beyond them: of odd windows
  std::size_t first_odd_ = 0;                                   // of classes_
  std::vector<cv::Mat> entries_;                                // per panel
  std::vector<std::vector<BlockedPixels>> blocked_;             // per panel, per class; only while places are found
  std::vector<std::vector<std::unique_ptr<Indexed>>> indexed_;  // per class, per lattice
};

}  // namespace veneer::planner
