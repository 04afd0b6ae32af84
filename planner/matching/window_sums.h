// Sums of entries and of their squares over rectangles at every place of a rotated panel; what cell_index.cc is built
// with.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "planner/matching/rotated_panel.h"

namespace veneer::planner {

// Sums over some rows of a rotated panel, slid down row by row, for all channels side by side.
class ColumnSums {
 public:
  ColumnSums(const RotatedPanel& panel, int columns, int height)
      : panel_(panel),
        height_(height),
        sums_(static_cast<std::size_t>(columns * panel.channels()), 0),
        squares_(static_cast<std::size_t>(columns * panel.channels()), 0) {}

  // Sums rows [row, row + height); rows may only be visited in rising order.
  void move_to(int row) {
    for (; dropped_ < row && dropped_ < added_; ++dropped_) change<-1>(dropped_);
    for (; added_ < std::min(row + height_, panel_.rows()); ++added_) change<1>(added_);
  }
  const std::uint32_t* sums() const { return sums_.data(); }
  const std::uint64_t* squares() const { return squares_.data(); }

 private:
  template <int kSign>
  void change(int row) {
    const auto channels = static_cast<std::ptrdiff_t>(panel_.channels());
    const auto first = panel_.begin(row) * channels, last = panel_.end(row) * channels;
    const std::int16_t* entry = panel_.data() + panel_.row_base()[row];
    std::uint32_t* sums = sums_.data();
    std::uint64_t* squares = squares_.data();
    for (std::ptrdiff_t i = first; i < last; ++i) {
      const auto value = static_cast<std::uint32_t>(entry[i]);
      sums[i] += kSign > 0 ? value : 0U - value;
      const std::uint64_t square = value * value;
      squares[i] += kSign > 0 ? square : 0U - square;
    }
  }

  const RotatedPanel& panel_;
  int height_;
  int dropped_ = 0, added_ = 0;
  std::vector<std::uint32_t> sums_;
  std::vector<std::uint64_t> squares_;
};

// A rectangle whose corner is the place, of which a part is made: blocks are one, the rest is a difference of two.
struct Term {
  int sign;
  int width;
  ColumnSums columns;
};

// Sums and squares of a part at each place of a row, one channel.
class PlaceSums {
 public:
  explicit PlaceSums(int columns)
      : sum(static_cast<std::size_t>(columns)),
        squares(static_cast<std::size_t>(columns)),
        sum_before_(static_cast<std::size_t>(columns) + 1),
        squares_before_(static_cast<std::size_t>(columns) + 1) {}

  void clear(int count) {
    std::fill_n(sum.begin(), count, 0);
    std::fill_n(squares.begin(), count, 0);
  }
  // Index 0 is the place in column `first`.
  void add(const Term& term, int channel, int channels, int first, int count) {
    std::int64_t running_sum = 0, running_squares = 0;
    const std::uint32_t* s = term.columns.sums() + first * channels + channel;
    const std::uint64_t* q = term.columns.squares() + first * channels + channel;
    for (int i = 0; i < count + term.width; ++i) {
      sum_before_[static_cast<std::size_t>(i)] = running_sum;
      squares_before_[static_cast<std::size_t>(i)] = running_squares;
      running_sum += static_cast<std::int32_t>(s[i * channels]);
      running_squares += static_cast<std::int64_t>(q[i * channels]);
    }
    const std::int64_t* a = sum_before_.data();
    const std::int64_t* b = squares_before_.data();
    for (int i = 0; i < count; ++i) {
      sum[static_cast<std::size_t>(i)] += term.sign * (a[i + term.width] - a[i]);
      squares[static_cast<std::size_t>(i)] += term.sign * (b[i + term.width] - b[i]);
    }
  }

  std::vector<std::int64_t> sum, squares;

 private:
  std::vector<std::int64_t> sum_before_, squares_before_;
};

// Extremes over the places of one cell row, per column.
struct RowExtremes {
  explicit RowExtremes(int columns)
      : sum_low(static_cast<std::size_t>(columns)),
        sum_high(static_cast<std::size_t>(columns)),
        spread_low(static_cast<std::size_t>(columns)),
        spread_high(static_cast<std::size_t>(columns)) {}
  void reset(int count) {
    std::fill_n(sum_low.begin(), count, std::numeric_limits<double>::max());
    std::fill_n(sum_high.begin(), count, 0.0);
    std::fill_n(spread_low.begin(), count, std::numeric_limits<double>::max());
    std::fill_n(spread_high.begin(), count, 0.0);
  }
  void add(const PlaceSums& places, double pixels, int count) {
    const std::int64_t* s = places.sum.data();
    const std::int64_t* q = places.squares.data();
    double *s_low = sum_low.data(), *s_high = sum_high.data(), *v_low = spread_low.data(), *v_high = spread_high.data();
    for (int i = 0; i < count; ++i) {
      const auto sum = static_cast<double>(s[i]);
      const double squares = pixels * static_cast<double>(q[i]);
      const double spread = squares - sum * sum, slack = squares * kRoundingOfSums;
      s_low[i] = std::min(s_low[i], sum), s_high[i] = std::max(s_high[i], sum);
      v_low[i] = std::min(v_low[i], spread - slack), v_high[i] = std::max(v_high[i], spread + slack);
    }
  }
  // What the rounding of two products and their difference can make of the larger one, several times over.
  static constexpr double kRoundingOfSums = 1e-15;

  std::vector<double> sum_low, sum_high;
  std::vector<double> spread_low, spread_high;  // n * sum of squares - square of sum = (n * deviation)^2
};

}  // namespace veneer::planner
