// Small windows of a panel, turned and sampled on demand, and the target's side of the comparison.
//
// Entries are whole numbers from fixed-point arithmetic, so that every machine finds the same.
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <stop_token>
#include <vector>

#include "planner/matching/kernels.h"
#include "planner/matching/matcher.h"

namespace veneer::planner {

// Features (CV_32FC(n)) as whole numbers, CV_16SC(n): entry = response * entries_per_unit, rounded.
// kCancelled: within a row after a stop was requested.
Result<cv::Mat> rounded_entries(const cv::Mat& features, double entries_per_unit, const std::stop_token& stop);

// Samples on a grid over part of a lattice: sample (i, k) is taken at lattice point
// (x + (i + 0.5) * step_x, y + (k + 0.5) * step_y), bilinearly between pixels; beyond the panel its border repeats.
struct SampleGrid {
  double x = 0, y = 0;
  double step_x = 1, step_y = 1;
  int columns = 0, rows = 0;
};
// Columns of a row of samples: [first, last).
struct SampledPart {
  int first = 0, last = 0;
};
// `entries` below 4096 in size. Row k of the result starts at k * row_length; what lies between rows is left alone, and
// with `parts`, one a row, what lies beside them.
void sample(const cv::Mat& entries, const Lattice& lattice, const SampleGrid& grid, std::size_t row_length,
            std::int16_t* out, const SampledPart* parts = nullptr);

// A patch's pixels, or a sample of them on a regular grid: what a window of samples is compared with.
class TargetWindow {
 public:
  // One in `stride` x `stride` pixels.
  TargetWindow(const MatchPatch& patch, double entries_per_unit, int stride);

  int columns() const { return columns_; }
  int rows() const { return rows_; }
  // The grid of samples of a window at a place.
  SampleGrid at(int x, int y) const {
    // The first sample is the middle pixel of the first stride x stride.
    const int middle = stride_ / 2;
    const double to_first = middle + 0.5 - stride_ * 0.5, step = stride_;
    return {x + to_first, y + to_first, step, step, columns_, rows_};
  }
  kernels::WindowRows pixels() const {
    return {target_.data(), mask_.data(), row_length_, order_.data(), static_cast<int>(order_.size())};
  }
  std::size_t row_length() const { return row_length_; }
  // One a row: the samples between the first and the last that count.
  const std::vector<SampledPart>& parts() const { return parts_; }
  // Where rows of samples start that follow each other, and how many entries to keep ready for them.
  const std::ptrdiff_t* row_base() const { return row_base_.data(); }
  std::size_t sample_entries() const { return target_.size() + kernels::kRowStep; }

 private:
  int stride_, columns_, rows_;
  std::size_t row_length_;
  std::vector<std::int16_t> target_;
  std::vector<std::uint32_t> mask_;
  std::vector<int> order_;
  std::vector<std::ptrdiff_t> row_base_;
  std::vector<SampledPart> parts_;
};

// The means of a patch's features over a grid of columns x rows boxes of box_width x box_height pixels from its
// window's upper left corner, and the share of each box that belongs to the patch. Pixels that do not count as 0.
struct BoxMeans {
  std::vector<double> means;     // [row][column][channel], in features
  std::vector<double> coverage;  // [row][column], 0 to 1
};
BoxMeans box_means(const MatchPatch& patch, int columns, int rows, double box_width, double box_height);

}  // namespace veneer::planner
