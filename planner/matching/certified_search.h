// One question to the certified matcher: which free place is the cheapest?
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "planner/matching/cell_index.h"
#include "planner/matching/kernels.h"
#include "planner/matching/match_query.h"
#include "planner/matching/matcher.h"
#include "planner/matching/rotated_panel.h"

namespace veneer::planner {

// Counts of what a search did, for benchmarks.
struct MatchCounts {
  std::uint64_t chunks = 0, cells = 0, sums = 0, windows = 0, exact = 0;
};

// One panel at one rotation, ready to be searched.
struct IndexedLattice {
  int panel = 0, rotation = 0;
  std::unique_ptr<RotatedPanel> pixels;
  std::vector<CellIndex> cells;  // one a window class
};

// The limit is the squared distance, in entries, beyond which no place can be the best. It falls twice: as soon as a
// place is known to be that near in entries, give or take their rounding, and when its exact cost is. Exact costs come
// last, for the few places that rounding leaves undecided.
class CertifiedSearch {
 public:
  // No place alike() one of `excluded` is an answer. All references must outlive the search.
  CertifiedSearch(const Matcher& matcher, std::span<const IndexedLattice> lattices, MatchQuery query,
                  const MatchPatch& patch, std::vector<Cover> cover, std::span<const LatticeCandidate> excluded,
                  const std::stop_token& stop, MatchCounts& counts);

  // kCancelled: a stop was requested.
  Result<std::optional<LatticeCandidate>> run();

 private:
  struct Found {
    std::uint16_t bound;
    std::uint16_t shift;  // of the bound's unit
    std::uint32_t lattice;
    std::int32_t row, cell;
  };
  // A place within the limit of the time.
  struct Near {
    std::uint64_t distance;
    LatticeCandidate candidate;
    bool admitted;  // else not asked yet
  };

  const CellIndex& cells_of(std::uint32_t lattice) const { return lattices_[lattice].cells[patch_.window_class]; }
  bool any_place() const { return limit_ < kNoLimit; }
  void set_limit(double limit);
  std::uint16_t limit_in_bounds(int shift) const;

  void look_around();
  template <class RowWanted>
  void collect(RowWanted wanted, std::size_t skip, std::size_t stride);
  void prepare_row(const CellIndex& cells, int row);
  void collect_chunk(const CellIndex& cells, std::uint32_t lattice, int row, int first);
  void sort_found();
  void evaluate_found();
  void evaluate(const Found& found);
  void evaluate_place(const IndexedLattice& it, int x, int y, int shift, std::ptrdiff_t column);
  bool may_be_taken(const LatticeCandidate& candidate) const;
  void decide();

  static constexpr double kNoLimit = 1e300;

  const Matcher& matcher_;
  std::span<const IndexedLattice> lattices_;
  const MatchQuery query_;
  const MatchPatch& patch_;
  const std::vector<Cover> cover_;  // one a lattice, or none
  std::span<const LatticeCandidate> excluded_;
  const std::stop_token& stop_;
  MatchCounts& counts_;

  double limit_ = kNoLimit;
  // The limit in the units of each stage.
  int shift_ = 0;
  std::uint16_t bound_limit_ = 65535;
  std::uint64_t sums_limit_ = 0, window_limit_ = 0;

  std::vector<kernels::TapRow> taps_;
  std::vector<Found> found_, sorted_;
  std::vector<std::int16_t> sums_;         // of the windows of one cell
  std::vector<std::ptrdiff_t> sums_base_;  // of each row of sums_
  std::size_t sums_length_;
  std::vector<Near> near_;
  LatticeCandidate best_;
};

}  // namespace veneer::planner
