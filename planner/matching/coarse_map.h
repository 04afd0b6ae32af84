// One lattice of a panel in cells of about a twelfth of a window, a tenth where windows are not filled: what the
// shortlist scores.
//
// A cell stands for the places around its corner. Its window is cut into blocks of 2 x 2 cells. With t and c the
// features of target and wood, |t - c|^2 = |t|^2 + |c|^2 - 2 t . c. The map keeps |c|^2 of every cell's window as it
// is, and block means of c, with which t . c is estimated: what deviates from the means of t and of c within a block is
// taken as uncorrelated. So an estimate costs one product of whole numbers a block and channel.
//
// Where patches do not fill their windows, |c|^2 counts by each block's share of the patch: it becomes one more
// channel.
//
// Only cells whose centre lies on the panel are stored, unless windows have empty corners. Scores of one window class
// compare across lattices and panels.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "planner/matching/group_bounds.h"
#include "planner/matching/place_bits.h"
#include "planner/matching/score_kernels.h"

namespace veneer::planner {

// How the windows of a class are cut into cells; not whole pixels, so that the cells fill the window.
struct CellGrid {
  int columns = 2, rows = 2;         // cells a window: even
  double width = 1, height = 1;      // of a cell, in working pixels
  int samples_x = 1, samples_y = 1;  // a cell

  // The places that cell column (or row) k stands for: [first_place(k), first_place(k + 1)).
  static int first_place(int k, double size);
};
CellGrid cell_grid(const WindowClass& windows);
// Cells of this size; columns and rows are as they are by default.
CellGrid cells_of(double width, double height);

// Largest entry for which scores fit 32 bits.
int largest_score_entry(int channels);

class CoarseMap {
 public:
  // For a panel of this size and number of channels, not yet measured. `filled`: all windows are full of pixels that
  // count.
  CoarseMap(const cv::Size& panel, int channels, const Lattice& lattice, const CellGrid& grid, bool filled);
  // From the panel's entries (window_samples.h). kCancelled: within a row of cells after a stop was requested, with
  // half of them measured. The same for what follows.
  Status measure(const cv::Mat& entries, const Lattice& lattice, const std::stop_token& stop);
  // What measure() finds, as bytes to be kept and filled in again (index_cache.h).
  std::vector<std::span<std::byte>> measured();

  int rows() const { return static_cast<int>(begin_.size()); }
  int pairs() const { return static_cast<int>(planes_.size()); }
  // Stored cells of a row.
  int begin(int row) const { return begin_[static_cast<std::size_t>(row)]; }
  int end(int row) const { return end_[static_cast<std::size_t>(row)]; }

  // Unless windows are filled, the last channel is half the squared length in a block, divided by this; a tap is a
  // share of the block times the same.
  static constexpr int kEnergyUnit = 1024;

  // Two channels of the block whose upper left cell is begin(row) + k, at [2 * k]; reading a little beyond is safe.
  const std::int16_t* blocks(int pair, int row, int first_cell) const {
    return planes_[static_cast<std::size_t>(pair)].data() + 2 * (base_[static_cast<std::size_t>(row)] + first_cell);
  }
  // Half the squared length of the features in the cell's window, in units of one block's: at [k]. 0 unless filled.
  const std::int32_t* half_energy(int row) const {
    return half_energy_.data() + base_[static_cast<std::size_t>(row)] + begin(row);
  }

  // Groups of kernels::kGroup cells, counted from begin(row): one bit for each cell that has a place left.
  int groups(int row) const { return (end(row) - begin(row) + kernels::kGroup - 1) / kernels::kGroup; }
  const std::uint16_t* alive(int row) const { return alive_.data() + group_base_[static_cast<std::size_t>(row)]; }
  // Looks again which cells have places, for the places in `changed`.
  Status find_alive(const PlaceBits& places, const cv::Rect& changed, const std::stop_token& stop);
  void find_alive(const PlaceBits& places, const cv::Rect& changed);
  // To be called once, after measure() and find_alive(), if windows are filled: bounds for the cells alive now.
  Status find_bounds(const std::stop_token& stop);
  // For each group of the map what to compare with TapSums::most(); nothing certain when there are no bounds.
  void find_score_bounds(const TapSums& taps, std::vector<float>& out) const;
  // The groups of a row that have a place left and a bound of at most `most`, by their first cells, counted from
  // begin(row).
  void groups_within(int row, const std::vector<float>& bounds, float most, std::vector<std::uint32_t>& out) const;
  std::size_t alive_cells() const;
  std::size_t bytes() const;

 private:
  struct Measured;
  void find_rows(const Lattice& lattice, const cv::Size& panel);
  Result<Measured> measure_cells(const cv::Mat& entries, const Lattice& lattice, const std::stop_token& stop) const;
  Status average_blocks(const Measured& cells, const std::stop_token& stop);
  Status add_up_energy(const Measured& cells, const std::stop_token& stop);

  // Cells that reading beyond a row may touch.
  std::ptrdiff_t margin() const { return 64 + grid_.columns; }

  CellGrid grid_;
  int channels_;
  bool filled_;
  std::vector<int> begin_, end_;
  std::vector<std::ptrdiff_t> base_;  // of each row, so that base + cell is an index
  std::ptrdiff_t size_ = 0;
  std::vector<std::vector<std::int16_t>> planes_;  // one a pair of channels
  std::vector<std::int32_t> half_energy_;
  std::vector<std::size_t> group_base_;
  std::vector<std::uint16_t> alive_;
  std::optional<GroupBounds> bounds_;
};

}  // namespace veneer::planner
