// One question to the shortlist; see shortlist_matcher.h.
#pragma once

#include <vector>

#include "planner/matching/shortlist_matcher.h"

namespace veneer::planner {

class ShortlistSearch {
 public:
  ShortlistSearch(const ShortlistMatcher& matcher, const MatchPatch& patch, const std::stop_token& stop);

  // Up to `count` candidates, cheapest first, no two alike. kCancelled: a stop was requested.
  Result<std::vector<LatticeCandidate>> run(std::size_t count);

 private:
  struct Scored {
    std::int32_t score;
    std::uint32_t lattice;
    std::int32_t row, cell;
    friend auto operator<=>(const Scored&, const Scored&) = default;
  };
  // Neighbouring places, and the distance at the one in their middle: squared, in entries, over some of the pixels.
  struct Block {
    std::uint64_t distance;
    std::uint32_t lattice;
    int y0, y1, x0, x1;  // places [x0, x1) x [y0, y1)
    int middle_x() const { return x0 + (x1 - x0) / 2; }
    int middle_y() const { return y0 + (y1 - y0) / 2; }
    friend auto operator<=>(const Block&, const Block&) = default;
  };
  struct FreePlace {
    std::uint64_t distance;  // squared, in entries
    std::uint32_t lattice;
    int y, x;
    friend auto operator<=>(const FreePlace&, const FreePlace&) = default;
  };

  const ShortlistMatcher::Indexed& indexed(std::uint32_t lattice) const {
    return *matcher_.indexed_[class_number_][lattice];
  }
  LatticeCandidate candidate(std::uint32_t lattice, int y, int x) const {
    return {0, matcher_.panel_of(lattice), matcher_.rotation_of(lattice), y, x};
  }

  const cv::Mat& entries(std::uint32_t lattice) const {
    return matcher_.entries_[static_cast<std::size_t>(matcher_.panel_of(lattice))];
  }

  // The cheapest free places, no two alike, that come of a list of so many cells, thinned or not.
  std::vector<LatticeCandidate> listed(std::size_t cells, std::size_t count, bool thin);
  // The most promising blocks of places, from a list of `listed` cells.
  std::vector<Block> shortlist(std::size_t listed, bool thin);
  std::vector<Scored> score_cells(std::size_t wanted);
  // Adds the cells of one row to `found`, and keeps that short.
  void score_row(std::uint32_t lattice, int row, const kernels::BlockTaps& taps, const TapSums& sums,
                 std::size_t wanted, std::vector<Scored>& found);
  void keep_best(std::size_t wanted, std::vector<Scored>& found);
  // Drops cells of which enough alike are kept.
  std::vector<Scored> thinned(const std::vector<Scored>& cells, std::size_t wanted);
  Block block_of(const Scored& cell) const;
  // Whether none of its places can be taken, for certain.
  bool ruled_out(const Block& block) const;
  // Looks at the middle of each block through `window` and keeps the best.
  void look_at(std::vector<Block>& blocks, const TargetWindow& window, std::size_t wanted);
  // So that windows on the same wood follow each other and find it in the cache.
  void sort_by_wood(std::vector<Block>& blocks) const;
  // Cuts blocks into smaller ones that still have free places.
  std::vector<Block> cut(const std::vector<Block>& blocks) const;
  std::vector<FreePlace> free_places(const std::vector<Block>& blocks);
  std::vector<LatticeCandidate> cheapest(std::vector<FreePlace> places, std::size_t count) const;

  const ShortlistMatcher& matcher_;
  const MatchPatch& patch_;
  const std::stop_token& stop_;
  const std::size_t class_number_;
  const ShortlistMatcher::Class& class_;
  const CellGrid grid_;                // the cells of the patch's window
  const std::vector<Cover> cover_;     // one a lattice, or none
  const bool cut_;                     // cells are larger than blocks may be
  std::vector<TargetWindow> windows_;  // from few pixels to all
  std::vector<std::int32_t> taps_;
  std::int32_t limit_ = std::numeric_limits<std::int32_t>::max();
  bool complete_ = true;  // no cell was dropped
  std::vector<std::int16_t> samples_;
  std::vector<SampledPart> parts_;  // of its rows, where all places of a block are looked at
  std::vector<float> bounds_;       // of one lattice, while scoring
  // Of one row, while scoring.
  std::vector<std::uint32_t> groups_;
  std::vector<std::int32_t> scores_;
  std::vector<std::uint16_t> below_;
  std::vector<const std::int16_t*> blocks_;
};

}  // namespace veneer::planner
