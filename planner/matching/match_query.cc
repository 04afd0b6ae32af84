#include "planner/matching/match_query.h"

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
  for (const PatchPixels::Span& span : pixels.spans) {
    const auto* from = patch.features->ptr<float>(span.row);
    for (int c = span.begin; c < span.end; ++c) {
      for (std::size_t ch = 0; ch < out.channels; ++ch) {
        const double exact = from[static_cast<std::size_t>(c) * out.channels + ch] * scale;
        const double rounded = std::clamp(std::floor(exact + 0.5), 0.0, static_cast<double>(kernels::kLargestEntry));
        const std::size_t at = out.at(span.row - pixels.top, c - pixels.left, ch);
        out.target[at] = static_cast<std::int16_t>(rounded);
        out.counts[at] = 1;
        squared_rounding += (rounded - exact) * (rounded - exact);
      }
    }
  }
  return out;
}

// The number of rows a sum for which sums and leftover rows together are fewest.
int choose_sum_height(int window_height) {
  int best = 1, fewest = window_height;
  for (int rows = 2; rows <= kernels::kTallestSum; ++rows) {
    const int left = window_height / rows + window_height % rows;
    if (left <= fewest) best = rows, fewest = left;
  }
  return best;
}

struct RowOfEntries {
  int first, count;  // rows of the window that are summed up; one: as it is
  int number;        // what the row is compared with
};

// Adds a row; entries count where all of their rows do. `squared_rounding` grows by what rounding a sum takes away.
void add_row(const Entries& entries, const RowOfEntries& row, MatchQuery::Rows& out, double& squared_rounding) {
  const std::size_t steps = entries.row_length / kernels::kRowStep;
  const std::size_t first = out.target.size(), first_mask = out.mask.size();
  out.rows.push_back(row.number);
  out.target.resize(first + entries.row_length, 0);
  out.mask.resize(first_mask + steps, 0);
  for (std::size_t i = 0; i < entries.row_length; ++i) {
    int value = 0;
    bool counts = true;
    for (int k = 0; k < row.count; ++k) {
      const std::size_t at = static_cast<std::size_t>(row.first + k) * entries.row_length + i;
      value += entries.target[at];
      counts = counts && entries.counts[at] != 0;
    }
    if (row.count > 1) {
      const int rounded = (value + kernels::kSumDivisor / 2) / kernels::kSumDivisor;
      const double lost = rounded - static_cast<double>(value) / kernels::kSumDivisor;
      if (counts) squared_rounding += lost * lost;
      value = rounded;
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
  bool whole = true;  // all of its pixels belong to the patch: otherwise nothing is known of it
  void add(double v, bool counts) { sum += v, squares += v * v, count += 1, whole = whole && counts; }
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
        const std::size_t at = entries.at(r, c, ch);
        const bool in_block = r < y.covered() && c < x.covered();
        Moments& part = in_block ? blocks[static_cast<std::size_t>(r / y.block * x.blocks + c / x.block)] : rest;
        part.add(entries.target[at], entries.counts[at] != 0);
      }
    }
    for (const CellIndex::Feature feature : {CellIndex::kMean, CellIndex::kDeviation}) {
      for (int j = 0; j < y.blocks; ++j)
        for (int i = 0; i < x.blocks; ++i)
          if (const Moments& block = blocks[static_cast<std::size_t>(j * x.blocks + i)]; block.whole)
            taps.push_back(
                tap_of(CellIndex::kBlock, ch, feature, i * x.block / x.cell, j * y.block / y.cell, block.of(feature)));
      if (rest.count > 0 && rest.whole)
        taps.push_back(tap_of(CellIndex::kRest, ch, feature, 0, 0, rest.of(feature) * windows.rest_scale()));
    }
  }
  return taps;
}

}  // namespace

MatchQuery::MatchQuery(const MatchPatch& patch, const WindowClass& windows, double scale)
    : block_pixels(windows.block_pixels()),
      entries_per_unit(scale),
      sum_height(choose_sum_height(patch.pixels.height)),
      sum_groups(sum_height > 1 ? patch.pixels.height / sum_height : 0) {
  double squared_rounding = 0, unused = 0, squared_sums_rounding = 0;
  const Entries entries = rounded_entries(patch, scale, squared_rounding);
  row_length = entries.row_length;
  rounding = std::sqrt(squared_rounding) +
             RotatedPanel::kRoundingPerEntry *
                 std::sqrt(static_cast<double>(patch.pixels.count) * static_cast<double>(entries.channels));
  spread_over(entries.height, [&](int row) { add_row(entries, {row, 1, row}, pixel_rows, unused); });
  spread_over(sum_groups, [&](int group) {
    add_row(entries, {group * sum_height, sum_height, group}, sum_rows, squared_sums_rounding);
  });
  for (int row = sum_groups * sum_height; row < entries.height; ++row)
    add_row(entries, {row, 1, row}, leftover_rows, unused);
  double counted = 0;
  for (const std::uint32_t bits : sum_rows.mask) counted += __builtin_popcount(bits);
  sums_rounding = std::sqrt(squared_sums_rounding) + 0.5 * std::sqrt(counted);
  taps = taps_of(entries, windows);
}

double MatchQuery::entries_limit(double cost) const {
  const double length = std::sqrt(cost) * entries_per_unit + rounding;
  return length * length * (1 + 1e-9);
}

double MatchQuery::entries_limit_from(std::uint64_t distance) const {
  const double length = std::sqrt(static_cast<double>(distance)) + 2 * rounding;
  return length * length * (1 + 1e-9);
}

double MatchQuery::sums_limit(double entries) const {
  const double length = std::sqrt(entries * sum_height) / kernels::kSumDivisor + sums_rounding;
  return length * length * (1 + 1e-9);
}

double MatchQuery::least_entries(std::uint64_t sums_distance) const {
  const double length =
      std::max(0.0, std::sqrt(static_cast<double>(sums_distance)) - sums_rounding) * kernels::kSumDivisor;
  return length * length / sum_height * (1 - 1e-9);
}

}  // namespace veneer::planner
