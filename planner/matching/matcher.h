// Dense template matching over all panels, places and rotations (equation 4) on the wood that is still free.
//
// Two searches stand behind this interface: CertifiedMatcher (certified_matcher.h) returns what an exhaustive search
// would, by proof; ShortlistMatcher (shortlist_matcher.h) is far faster and nearly always as good (docs/PLANNER.md).
// Both agree on what a place is, on its cost and on which wood is free: that is here. Both are deterministic: the
// answer depends on the patch and on the wood taken so far, not on threads, earlier questions or the machine.
//
// Questions (const) may run on several threads at once; take() on one thread while none runs.
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <stop_token>
#include <vector>

#include "base/result.h"
#include "planner/matching/cell_index.h"
#include "planner/matching/clearance.h"
#include "planner/matching/free_wood.h"
#include "planner/matching/patch_pixels.h"

namespace veneer::planner {

// One panel, ready for matching.
struct MatchPanel {
  Raster<PanelFrame> features;  // weighted responses at the working resolution, CV_32FC(n)
  FreeWood wood;
  cv::Mat grain{};  // which way its grain runs (grain/grain_field.h); empty unless it counts
};

// A candidate on the lattice of one rotation (lattice.h): what greedy looks at. Ordered by what best() prefers.
struct LatticeCandidate {
  double cost = std::numeric_limits<double>::infinity();
  int panel = 0, rotation = 0, y = 0, x = 0;  // lattice pixel of the window's upper left pixel
  friend auto operator<=>(const LatticeCandidate&, const LatticeCandidate&) = default;
};

// A patch as the matcher wants it: any simple outline, counter-clockwise; curves come as polygons.
struct MatchPatch {
  PatchPixels pixels;
  Ring<ArtworkFrame> outline;
  const cv::Mat* features = nullptr;  // of the whole artwork, CV_32FC(n)
  PixelGrid grid;
  std::size_t window_class = 0;
};

class Matcher {
 public:
  virtual ~Matcher() = default;
  Matcher(const Matcher&) = delete;
  Matcher& operator=(const Matcher&) = delete;

  // To be called once, before any question. `progress` gets fractions, on the calling thread. kCancelled: within some
  // tens of milliseconds of a stop request; then there is no index to ask.
  using IndexProgress = std::function<void(double fraction)>;
  virtual Status build_index(int threads, const std::stop_token& stop, const IndexProgress& progress = {}) = 0;
  virtual std::size_t index_bytes() const = 0;

  // The cheapest free candidate; none when no place is free. kCancelled: a stop was requested.
  virtual Result<std::optional<LatticeCandidate>> best(const MatchPatch& patch, const std::stop_token& stop) const = 0;
  // Up to `count` free candidates, cheapest first, no two of them alike(); the first is best(), or of a shortlist
  // hardly dearer. Costs are exact.
  // kCancelled: a stop was requested.
  virtual Result<std::vector<LatticeCandidate>> candidates(const MatchPatch& patch, std::size_t count,
                                                           const std::stop_token& stop) const = 0;

  // Whether the candidate may (still) be taken.
  bool admits(const MatchPatch& patch, const LatticeCandidate& candidate) const;
  void take(const MatchPatch& patch, const LatticeCandidate& candidate);
  // The same for an outline that lies anywhere.
  void take(int panel, const Ring<PanelFrame>& outline);
  // All that was taken is free again, as it was after build_index(); what is measured of the wood stays. kCancelled: a
  // stop was requested, and there is no index to ask any more.
  Status give_back(int threads, const std::stop_token& stop);

  // Whether two candidates of a patch are, to a person, the same piece of wood: on one panel, with centres closer than
  // half the window's shorter side, whatever the rotations.
  bool alike(const MatchPatch& patch, const LatticeCandidate& a, const LatticeCandidate& b) const;

  Isometry2<PanelFrame, ArtworkFrame> panel_from_artwork(const MatchPatch& patch,
                                                         const LatticeCandidate& candidate) const;
  double exact_cost(const MatchPatch& patch, const LatticeCandidate& candidate,
                    double limit = std::numeric_limits<double>::max()) const;
  const std::vector<MatchPanel>& panels() const { return panels_; }
  int rotations() const { return static_cast<int>(turns_.size()); }
  const Lattice& lattice(int panel, int rotation) const {
    return lattices_[static_cast<std::size_t>(panel) * turns_.size() + static_cast<std::size_t>(rotation)];
  }

 protected:
  // `turns` are the rotations.
  Matcher(std::vector<MatchPanel> panels, std::vector<Radians> turns);

  // For build_index(): what cover() asks, when a class has windows that are not filled.
  Status measure_clearance(const std::vector<WindowClass>& classes, int threads, const std::stop_token& stop);
  std::size_t clearance_bytes() const;
  // The patch's discs on each lattice, panel by panel, rotation by rotation; none when measure_clearance() had no need.
  std::vector<Cover> cover(const MatchPatch& patch) const;

  // Called by take(): `taken`, an outline grown by the kerf (grown_rings()), is no longer free.
  virtual void remove(int panel, const std::vector<Ring<PanelFrame>>& taken) = 0;
  // Called by give_back(): finds again which places are free, from the panels' wood.
  virtual Status find_places(int threads, const std::stop_token& stop) = 0;

 private:
  Status measure_clearance(int threads, const std::stop_token& stop);

  std::vector<MatchPanel> panels_;
  std::vector<Radians> turns_;
  std::vector<Lattice> lattices_;      // panel by panel, rotation by rotation
  std::vector<Clearance> clearances_;  // one a panel, or none
  int widest_disc_ = 0;                // pixels; 0: clearance is not needed
};

}  // namespace veneer::planner
