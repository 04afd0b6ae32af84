// One patch, turned into the numbers that the search compares.
#pragma once

#include <vector>

#include "planner/matching/cell_index.h"
#include "planner/matching/kernels.h"
#include "planner/matching/matcher.h"

namespace veneer::planner {

struct MatchQuery {
  MatchQuery(const MatchPatch& patch, const WindowClass& windows, double entries_per_unit);

  // Every pixel.
  kernels::WindowRows pixels() const { return pixel_rows.window(row_length); }
  // Sums of `sum_height` rows each as kernels::row_sums() makes them; row g of the sums is group g. By Cauchy-Schwarz n
  // rows are at least as far apart as their sums, squared, divided by n; so sums and leftover() are a bound.
  kernels::WindowRows sums() const { return sum_rows.window(row_length); }
  // The pixels of the rows that sums() leaves over.
  kernels::WindowRows leftover() const { return leftover_rows.window(row_length); }
  // The squared distance in entries that no place with at most this cost can exceed.
  double entries_limit(double cost) const;
  // The same for places that cost at most what some place at this squared distance does.
  double entries_limit_from(std::uint64_t distance) const;
  // The squared distance of sums() that no place within a squared distance of entries can exceed, and back: the least
  // squared distance of entries for one of sums.
  double sums_limit(double entries_limit) const;
  double least_entries(std::uint64_t sums_distance) const;

  // A block feature of the target and where its block lies in the window.
  struct Tap {
    CellIndex::Part part;
    int channel;
    CellIndex::Feature feature;
    int cell_x, cell_y;  // offset of the block in cells
    std::uint16_t low, high;
  };

  struct Rows {
    std::vector<std::int16_t> target;
    std::vector<std::uint32_t> mask;
    std::vector<int> rows;
    kernels::WindowRows window(std::size_t length) const {
      return {target.data(), mask.data(), length, rows.data(), static_cast<int>(rows.size())};
    }
  };

  std::size_t row_length;
  Rows pixel_rows, sum_rows, leftover_rows;
  std::vector<Tap> taps;
  double block_pixels;
  double entries_per_unit;
  int sum_height, sum_groups;
  double rounding = 0;       // length of the difference vector that rounding to entries can make up
  double sums_rounding = 0;  // the same for rounding sums
};

}  // namespace veneer::planner
