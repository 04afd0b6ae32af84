#include "planner/match_query.h"

#include <algorithm>
#include <cmath>

namespace veneer::planner {
namespace {

// A window's entries, row by row, with what counts.
struct Entries {
  int width, height;
  std::size_t channels, row_length;
  std::vector<std::int16_t> target;
  std::vector<std::uint8_t> counts;

  std::size_t at(int row, int column, std::size_t channel) const {
    return static_cast<std::size_t>(row) * row_length + static_cast<std::size_t>(column) * channels + channel;
  }
};

Entries rounded_entries(const MatchPatch& patch, double scale, double& squared_rounding) {
  const PatchPixels& pixels = patch.pixels;
  Entries out;
  out.width = pixels.width, out.height = pixels.height;
  out.channels = static_cast<std::size_t>(patch.features->channels());
  const std::size_t wanted = static_cast<std::size_t>(pixels.width) * out.channels;
  out.row_length = (wanted + kernels::kRowStep - 1) / kernels::kRowStep * kernels::kRowStep;
  out.target.assign(out.row_length * static_cast<std::size_t>(pixels.height), 0);
  out.counts.assign(out.target.size(), 0);
  for (int r = 0; r < pixels.height; ++r) {
    const PatchPixels::Span span = pixels.rows[static_cast<std::size_t>(r)];
    const auto* from = patch.features->ptr<float>(pixels.top + r);
    for (int c = span.begin; c < span.end; ++c) {
      for (std::size_t ch = 0; ch < out.channels; ++ch) {
        const double exact = from[static_cast<std::size_t>(c) * out.channels + ch] * scale;
        const double rounded = std::clamp(std::floor(exact + 0.5), 0.0, static_cast<double>(kernels::kLargestEntry));
        const std::size_t at = out.at(r, c - pixels.left, ch);
        out.target[at] = static_cast<std::int16_t>(rounded);
        out.counts[at] = 1;
        squared_rounding += (rounded - exact) * (rounded - exact);
      }
    }
  }
  return out;
}

// Adds the sum of `sum` rows from `row` on; entries count where all of their rows do.
void add_row(const Entries& entries, int row, int sum, MatchQuery::Rows& out) {
  const std::size_t steps = entries.row_length / kernels::kRowStep;
  const std::size_t first = out.target.size(), first_mask = out.mask.size();
  out.rows.push_back(row);
  out.target.resize(first + entries.row_length, 0);
  out.mask.resize(first_mask + steps, 0);
  for (std::size_t i = 0; i < entries.row_length; ++i) {
    int value = 0;
    bool counts = true;
    for (int k = 0; k < sum; ++k) {
      const std::size_t at = static_cast<std::size_t>(row + k) * entries.row_length + i;
      value += entries.target[at];
      counts = counts && entries.counts[at] != 0;
    }
    out.target[first + i] = static_cast<std::int16_t>(value);
    if (counts) out.mask[first_mask + i / kernels::kRowStep] |= 1U << (i % kernels::kRowStep);
  }
}

// Visits all parts of a window early, so that a bad place is noticed after few rows.
template <class Visit>
void spread_over(int count, Visit visit) {
  constexpr int kStep = 8;
  for (const int start : {0, 4, 2, 6, 1, 5, 3, 7})
    for (int i = start; i < count; i += kStep) visit(i);
}

// Mean and deviation of one part of the window.
struct Moments {
  double sum = 0, squares = 0, count = 0;
  void add(double v) { sum += v, squares += v * v, count += 1; }
  double of(CellIndex::Feature feature) const {
    if (feature == CellIndex::kMean) return sum / count;
    return std::sqrt(std::max(0.0, count * squares - sum * sum)) / count;
  }
};

MatchQuery::Tap tap_of(CellIndex::Part part, std::size_t channel, CellIndex::Feature feature, int cell_x, int cell_y,
                       double value) {
  constexpr double kTolerance = 1e-6;
  const double fine = value * CellIndex::kFineUnits;
  return {part,
          static_cast<int>(channel),
          feature,
          cell_x,
          cell_y,
          static_cast<std::uint16_t>(std::clamp(std::floor(fine - kTolerance), 0.0, 65535.0)),
          static_cast<std::uint16_t>(std::clamp(std::ceil(fine + kTolerance), 0.0, 65535.0))};
}

std::vector<MatchQuery::Tap> taps_of(const Entries& entries, const WindowClass& windows) {
  const BlockAxis &x = windows.x, &y = windows.y;
  std::vector<MatchQuery::Tap> taps;
  for (std::size_t ch = 0; ch < entries.channels; ++ch) {
    std::vector<Moments> blocks(static_cast<std::size_t>(x.blocks * y.blocks));
    Moments rest;
    for (int r = 0; r < windows.height; ++r) {
      for (int c = 0; c < windows.width; ++c) {
        const double v = entries.target[entries.at(r, c, ch)];
        if (r < y.covered() && c < x.covered())
          blocks[static_cast<std::size_t>(r / y.block * x.blocks + c / x.block)].add(v);
        else
          rest.add(v);
      }
    }
    for (const CellIndex::Feature feature : {CellIndex::kMean, CellIndex::kDeviation}) {
      for (int j = 0; j < y.blocks; ++j)
        for (int i = 0; i < x.blocks; ++i)
          taps.push_back(tap_of(CellIndex::kBlock, ch, feature, i * x.block / x.cell, j * y.block / y.cell,
                                blocks[static_cast<std::size_t>(j * x.blocks + i)].of(feature)));
      if (rest.count > 0)
        taps.push_back(tap_of(CellIndex::kRest, ch, feature, 0, 0, rest.of(feature) * windows.rest_scale()));
    }
  }
  return taps;
}

}  // namespace

MatchQuery::MatchQuery(const MatchPatch& patch, const WindowClass& windows, double scale, int rows_a_sum)
    : block_pixels(windows.block_pixels()), entries_per_unit(scale), sum_height(rows_a_sum) {
  double squared_rounding = 0;
  const Entries entries = rounded_entries(patch, scale, squared_rounding);
  row_length = entries.row_length;
  rounding = std::sqrt(squared_rounding) +
             RotatedPanel::kRoundingPerEntry *
                 std::sqrt(static_cast<double>(patch.pixels.count) * static_cast<double>(entries.channels));
  spread_over(entries.height, [&](int row) { add_row(entries, row, 1, pixel_rows); });
  const int sums = entries.height / rows_a_sum;
  spread_over(sums, [&](int i) { add_row(entries, i * rows_a_sum, rows_a_sum, sum_rows); });
  for (int row = sums * rows_a_sum; row < entries.height; ++row) add_row(entries, row, 1, leftover_rows);
  taps = taps_of(entries, windows);
}

double MatchQuery::entries_limit(double cost) const {
  const double length = std::sqrt(cost) * entries_per_unit + rounding;
  return length * length * (1 + 1e-9);
}

}  // namespace veneer::planner
