// The features of one panel sampled on one lattice, rounded to 16 bits for fast comparison.
//
// Rounding is bounded (kRoundingPerEntry), so that bounds computed on these numbers hold for the exact cost. Only the
// part of the lattice that lies on the panel is stored, widened by kReach pixels so that the neighbours of a feasible
// place can be read without checks; beyond the panel its border pixels are repeated. Immutable; thread-safe.
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <stop_token>
#include <vector>

#include "base/result.h"
#include "planner/matching/lattice.h"

namespace veneer::planner {

class RotatedPanel {
 public:
  static constexpr int kReach = 8;
  static constexpr double kRoundingPerEntry = 0.505;

  // `features`: weighted responses of the whole panel, CV_32FC(n). Stored entry = response * entries_per_unit.
  // kCancelled: within a row after a stop was requested.
  static Result<RotatedPanel> make(const cv::Mat& features, const Lattice& lattice, double entries_per_unit,
                                   const std::stop_token& stop);

  const Lattice& lattice() const { return lattice_; }
  int channels() const { return channels_; }
  int rows() const { return static_cast<int>(begin_.size()); }
  // Stored columns of a row.
  int begin(int row) const { return begin_[static_cast<std::size_t>(row)]; }
  int end(int row) const { return end_[static_cast<std::size_t>(row)]; }
  // Entry of channel c at (column, row): data()[row_base()[row] + column * channels() + c].
  const std::int16_t* data() const { return data_.data(); }
  const std::ptrdiff_t* row_base() const { return row_base_.data(); }
  std::size_t bytes() const { return data_.size() * sizeof(std::int16_t); }

 private:
  RotatedPanel(const cv::Mat& features, const Lattice& lattice);
  void find_spans(const cv::Size& panel);
  template <int kChannels>
  void sample_row(const cv::Mat& features, int row, float scale);

  Lattice lattice_;
  int channels_;
  std::vector<int> begin_, end_;
  std::vector<std::ptrdiff_t> row_base_;
  std::vector<std::int16_t> data_;
};

}  // namespace veneer::planner
