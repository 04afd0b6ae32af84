// Dense template matching over all panels, places and rotations (equation 4), exact and fast.
//
// best() returns what an exhaustive search over all candidates would: a place is discarded only when a lower bound of
// its cost exceeds the cost of a place already found. Bounds from coarse to fine: block features over cells of places
// (cell_index.h), whole windows in 16 bits, stopped early (rotated_panel.h), then the exact cost (patch_pixels.h).
// Equal costs are decided by panel, rotation, row, column, so the answer does not depend on the order of the search.
//
// best() may run on several threads at once, take() on one thread while no best() runs.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <stop_token>
#include <vector>

#include "planner/cell_index.h"
#include "planner/free_wood.h"
#include "planner/kernels.h"
#include "planner/patch_pixels.h"

namespace veneer::planner {

// One panel, ready for matching.
struct MatchPanel {
  Raster<PanelFrame> features;  // weighted responses at the working resolution, CV_32FC(n)
  FreeWood wood;
};

// A place for a patch. Ordered by what best() prefers.
struct Candidate {
  double cost = std::numeric_limits<double>::infinity();
  int panel = 0, rotation = 0, y = 0, x = 0;  // lattice pixel of the window's upper left pixel
  friend auto operator<=>(const Candidate&, const Candidate&) = default;
};

// A patch as the matcher wants it.
struct MatchPatch {
  PatchPixels pixels;
  Ring<ArtworkFrame> outline;
  const cv::Mat* features = nullptr;  // of the whole artwork, CV_32FC(n)
  PixelGrid grid;
  std::size_t window_class = 0;
};

// Counts of what a search did, for benchmarks.
struct MatchCounts {
  std::uint64_t chunks = 0, cells = 0, sums = 0, windows = 0, exact = 0;
};

class Matcher {
 public:
  // `entries_per_unit` scales responses to 16-bit entries; kernels.h says what fits. `turns` are the rotations.
  Matcher(std::vector<MatchPanel> panels, std::vector<Radians> turns, std::vector<WindowClass> classes,
          double entries_per_unit);

  // Building is cut into tasks that may run on several threads, each once; best() needs all of them.
  std::size_t index_tasks() const { return lattices_.size(); }
  void build_index(std::size_t task);

  // None when no place is free. Returns early, with anything, once `stop` is requested.
  std::optional<Candidate> best(const MatchPatch& patch, const std::stop_token& stop,
                                MatchCounts* counts = nullptr) const;

  // Whether the place may (still) be taken.
  bool admits(const MatchPatch& patch, const Candidate& candidate) const;
  void take(const MatchPatch& patch, const Candidate& candidate);

  Isometry2<PanelFrame, ArtworkFrame> panel_from_artwork(const MatchPatch& patch, const Candidate& candidate) const;
  double exact_cost(const MatchPatch& patch, const Candidate& candidate,
                    double limit = std::numeric_limits<double>::max()) const;
  const std::vector<MatchPanel>& panels() const { return panels_; }
  const Lattice& lattice(int panel, int rotation) const;
  std::size_t index_bytes() const;

 private:
  friend class Search;
  struct IndexedLattice {
    int panel = 0, rotation = 0;
    Lattice lattice;
    std::unique_ptr<RotatedPanel> pixels;
    std::vector<CellIndex> cells;  // one a window class
  };

  std::vector<MatchPanel> panels_;
  std::vector<Radians> turns_;
  std::vector<WindowClass> classes_;
  std::vector<std::vector<BlockedPixels>> blocked_;  // per panel, per window class
  double entries_per_unit_;
  int sum_rows_;
  std::vector<IndexedLattice> lattices_;  // panel by panel, rotation by rotation
};

}  // namespace veneer::planner
