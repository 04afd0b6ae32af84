// Lower bounds for the scores of kernels::kGroup neighbouring cells at once: most groups need not be scored.
//
// A cell's score is h + sum over blocks and channels of t * c, with c the block means of its window, h half their
// squared length and more, and t the taps. In each channel the n blocks split into their mean and what deviates from
// it; with M, D of the taps and m, d of the cell,  sum t * c >= n M m - D d  by Cauchy and Schwarz, and  h = n m^2 / 2
// + d^2 / 2 (of all channels) + a rest. So the score is at least  n/2 (m + M)^2 + (d - D)^2 / 2 + rest, less what
// depends on the taps alone. A group keeps the intervals of m and d and the least rest of its cells that have places.
//
// Bounds are rounded down: a group that is left out holds no score below the limit. Windows must be filled.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "planner/matching/score_kernels.h"

namespace veneer::planner {

// What the bounds need of a patch's taps.
struct TapSums {
  std::vector<float> mean, deviation;  // of -t, per channel; deviation: the length of what deviates
  double constant = 0;                 // what depends on the taps alone
  int blocks = 0;                      // n
  float most(std::int32_t limit) const;
};
TapSums tap_sums(const kernels::BlockTaps& taps, int channels);

class GroupBounds {
 public:
  // So many groups; the bounds of all are the least there is.
  GroupBounds(int channels, std::size_t groups);

  // Of the groups of one row from `first` on: `row` as the kernel will see it, `alive` one bit for each of its cells.
  // What has no bit set has no bounds.
  void measure(std::size_t first, std::size_t count, const kernels::CellRow& row, int block_rows, int block_columns,
               const std::uint16_t* alive);

  // For every group: what TapSums::most() of a limit is compared with. Above it, no cell that had a bit set scores
  // below the limit.
  void find(const TapSums& taps, std::vector<float>& out) const;

  std::size_t bytes() const;

 private:
  struct Channel {
    std::vector<std::int16_t> mean_low, mean_high, deviation_low, deviation_high;
  };
  std::vector<Channel> channels_;
  std::vector<float> rest_;
};

}  // namespace veneer::planner
