#include "planner/matching/rotated_panel.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "planner/cancelled.h"
#include "planner/matching/kernels.h"

namespace veneer::planner {
namespace {

// Columns of a lattice row whose pixel centres lie on the panel; empty when begin >= end.
std::pair<int, int> centres_on_panel(const Lattice& lattice, int row, const cv::Size& panel) {
  RowStretch on_panel{0, static_cast<double>(lattice.width())};
  double column = 0, down = 0;
  lattice.to_panel(0, row + 0.5, column, down);
  on_panel.keep_on_panel(lattice, column, down, panel.width, panel.height);
  if (on_panel.high < on_panel.low) return {0, 0};
  return {static_cast<int>(std::ceil(on_panel.low - 0.5)), static_cast<int>(std::floor(on_panel.high - 0.5)) + 1};
}

}  // namespace

RotatedPanel::RotatedPanel(const cv::Mat& features, const Lattice& lattice)
    : lattice_(lattice), channels_(features.channels()) {
  find_spans(features.size());
  // Windows with empty corners are read whole, beyond the panel too: there lies what does not count.
  const auto margin = static_cast<std::ptrdiff_t>(
      (static_cast<std::size_t>((lattice_.width() + kReach) * channels_) + kernels::kRowStep - 1) / kernels::kRowStep *
      kernels::kRowStep);
  std::ptrdiff_t size = margin;
  for (int row = 0; row < rows(); ++row) {
    row_base_.push_back(size - static_cast<std::ptrdiff_t>(begin(row)) * channels_);
    size += static_cast<std::ptrdiff_t>(end(row) - begin(row)) * channels_;
  }
  // Whole steps are read, for the widest window of a cell, past the end of the last row.
  data_.assign(static_cast<std::size_t>(size + margin) + 2 * kernels::kRowStep, 0);
}

Result<RotatedPanel> RotatedPanel::make(const cv::Mat& features, const Lattice& lattice, double entries_per_unit,
                                        const std::stop_token& stop) {
  RotatedPanel panel(features, lattice);
  const auto scale = static_cast<float>(entries_per_unit);
  for (int row = 0; row < panel.rows(); ++row) {
    if (stop.stop_requested()) return cancelled();
    switch (panel.channels()) {
      case 1:
        panel.sample_row<1>(features, row, scale);
        break;
      case 2:
        panel.sample_row<2>(features, row, scale);
        break;
      default:
        panel.sample_row<0>(features, row, scale);
        break;
    }
  }
  return panel;
}

void RotatedPanel::find_spans(const cv::Size& panel) {
  std::vector<std::pair<int, int>> inside;
  inside.reserve(static_cast<std::size_t>(lattice_.height()));
  for (int row = 0; row < lattice_.height(); ++row) inside.push_back(centres_on_panel(lattice_, row, panel));
  const int stored = lattice_.height() + kReach;
  begin_.assign(static_cast<std::size_t>(stored), 0);
  end_.assign(static_cast<std::size_t>(stored), 0);
  for (int row = 0; row < stored; ++row) {
    int low = lattice_.width() + kReach, high = 0;
    for (int near = std::max(0, row - kReach); near <= std::min(lattice_.height() - 1, row + kReach); ++near) {
      const auto [first, last] = inside[static_cast<std::size_t>(near)];
      if (first < last) low = std::min(low, first), high = std::max(high, last);
    }
    if (low >= high) continue;
    begin_[static_cast<std::size_t>(row)] = std::max(0, low - kReach);
    end_[static_cast<std::size_t>(row)] = high + kReach;
  }
}

template <int kChannels>
void RotatedPanel::sample_row(const cv::Mat& features, int row, float scale) {
  const int channels = kChannels > 0 ? kChannels : channels_;
  const double last_column = features.cols - 1, last_row = features.rows - 1;
  const int most_left = std::max(features.cols - 2, 0), most_up = std::max(features.rows - 2, 0);
  const int right = features.cols > 1 ? channels : 0;
  const std::ptrdiff_t down = features.rows > 1 ? static_cast<std::ptrdiff_t>(features.step1()) : 0;
  const auto stride = static_cast<std::ptrdiff_t>(features.step1());
  const auto* origin = features.ptr<float>(0);
  double column = 0, vertical = 0;
  lattice_.to_panel(begin(row) + 0.5, row + 0.5, column, vertical);
  column -= 0.5, vertical -= 0.5;
  std::int16_t* to =
      data_.data() + row_base_[static_cast<std::size_t>(row)] + static_cast<std::ptrdiff_t>(begin(row)) * channels;
  const int count = end(row) - begin(row);
  for (int k = 0; k < count; ++k) {
    const double x = std::min(std::max(column + lattice_.cos() * k, 0.0), last_column);
    const double y = std::min(std::max(vertical - lattice_.sin() * k, 0.0), last_row);
    const int c = std::min(static_cast<int>(x), most_left), r = std::min(static_cast<int>(y), most_up);
    const auto fx = static_cast<float>(x - c), fy = static_cast<float>(y - r);
    const float* upper = origin + r * stride + static_cast<std::ptrdiff_t>(c) * channels;
    const float* lower = upper + down;
    for (int ch = 0; ch < channels; ++ch) {
      const float above = upper[ch] + fx * (upper[ch + right] - upper[ch]);
      const float below = lower[ch] + fx * (lower[ch + right] - lower[ch]);
      // Moved by a half and cut off, which vectors do: rounding is a call. NOLINTNEXTLINE(bugprone-incorrect-roundings)
      *to++ = static_cast<std::int16_t>((above + fy * (below - above)) * scale + 0.5F);
    }
  }
}

}  // namespace veneer::planner
