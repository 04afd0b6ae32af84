#include "planner/matching/group_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "planner/matching/clones.h"

namespace veneer::planner {
namespace {

using kernels::kGroup;

// What rounding to single precision may add to a bound: a part of it, and a little for rests below 0.
constexpr double kSlackPart = 1e-5, kSlack = 64;

// Intervals, one a group, and what they are compared with.
struct Intervals {
  const std::int16_t *low, *high;
  float at, factor;
};

// `to` grows by factor times the squared distance from each interval.
VENEER_CLONES void add_distances(Intervals a, Intervals b, std::size_t count, float* to) {
  const auto squared = [](const Intervals& it, std::size_t g) {
    const float below = static_cast<float>(it.low[g]) - it.at, beyond = it.at - static_cast<float>(it.high[g]);
    const float distance = std::max(0.0F, std::max(below, beyond));
    return it.factor * distance * distance;
  };
  for (std::size_t g = 0; g < count; ++g) to[g] += squared(a, g) + squared(b, g);
}

// Sums over the blocks of each window and of their squares; channel `ch` of those at `rows`.
VENEER_CLONES void add_up_blocks(const std::int16_t* const* rows, int block_rows, int block_columns, int ch,
                                 std::size_t cells, std::vector<std::int32_t>& column, std::int32_t* sum,
                                 std::int32_t* squares) {
  const std::size_t wide = cells + 2 * static_cast<std::size_t>(block_columns - 1);
  column.assign(2 * wide, 0);
  std::int32_t *once = column.data(), *twice = once + wide;
  for (int r = 0; r < block_rows; ++r) {
    const std::int16_t* from = rows[r] + ch;
    for (std::size_t i = 0; i < wide; ++i) {
      const std::int32_t v = from[2 * i];
      once[i] += v, twice[i] += v * v;
    }
  }
  std::fill_n(sum, cells, 0), std::fill_n(squares, cells, 0);
  for (int c = 0; c < block_columns; ++c)
    for (std::size_t i = 0; i < cells; ++i) sum[i] += once[i + 2 * c], squares[i] += twice[i + 2 * c];
}

VENEER_CLONES void find_deviations(const std::int32_t* sum, const std::int32_t* squares, std::size_t cells, double n,
                                   float* mean, float* deviation, float* rest) {
  for (std::size_t i = 0; i < cells; ++i) {
    const double s = sum[i], q = squares[i];
    mean[i] = static_cast<float>(s / n);
    deviation[i] = static_cast<float>(std::sqrt(std::max(0.0, q - s * s / n)));
    rest[i] -= static_cast<float>(0.5 * q);
  }
}

std::int16_t below(float v) { return static_cast<std::int16_t>(std::floor(v - 0.01F)); }
std::int16_t above(float v) { return static_cast<std::int16_t>(std::ceil(v + 0.01F)); }

}  // namespace

TapSums tap_sums(const kernels::BlockTaps& taps, int channels) {
  TapSums out;
  out.blocks = taps.rows * taps.columns;
  for (int ch = 0; ch < channels; ++ch) {
    double sum = 0, squares = 0;
    for (int block = 0; block < out.blocks; ++block) {
      const std::int32_t pair = taps.taps[ch / 2 * out.blocks + block];
      const double t = static_cast<std::int16_t>(ch % 2 == 0 ? pair : pair >> 16);
      sum += t, squares += t * t;
    }
    const double mean = sum / out.blocks, deviation = std::sqrt(std::max(0.0, squares - sum * mean));
    out.mean.push_back(static_cast<float>(-mean));
    out.deviation.push_back(static_cast<float>(deviation));
    out.constant += squares / 2;
  }
  return out;
}

float TapSums::most(std::int32_t limit) const {
  return static_cast<float>((limit + constant) * (1 + kSlackPart) + kSlack);
}

GroupBounds::GroupBounds(int channels, std::size_t groups)
    : channels_(static_cast<std::size_t>(channels)), rest_(groups, std::numeric_limits<float>::lowest()) {
  constexpr auto kLeast = std::numeric_limits<std::int16_t>::min(), kMost = std::numeric_limits<std::int16_t>::max();
  for (Channel& it : channels_) {
    it.mean_low.assign(groups, kLeast), it.mean_high.assign(groups, kMost);
    it.deviation_low.assign(groups, 0), it.deviation_high.assign(groups, kMost);
  }
}

void GroupBounds::measure(std::size_t first, std::size_t count, const kernels::CellRow& row, int block_rows,
                          int block_columns, const std::uint16_t* alive) {
  const std::size_t cells = count * kGroup;
  std::vector<std::int32_t> column, sum(cells), squares(cells);
  std::vector<float> mean(cells), deviation(cells), rest(row.offsets, row.offsets + cells);
  for (std::size_t ch = 0; ch < channels_.size(); ++ch) {
    add_up_blocks(row.blocks + ch / 2 * static_cast<std::size_t>(block_rows), block_rows, block_columns,
                  static_cast<int>(ch % 2), cells, column, sum.data(), squares.data());
    find_deviations(sum.data(), squares.data(), cells, static_cast<double>(block_rows) * block_columns, mean.data(),
                    deviation.data(), rest.data());
    Channel& it = channels_[ch];
    for (std::size_t g = 0; g < count; ++g) {
      float m0 = 1e9F, m1 = -1e9F, d0 = 1e9F, d1 = -1e9F;
      for (unsigned bits = alive[g]; bits != 0; bits &= bits - 1) {
        const std::size_t i = g * kGroup + static_cast<std::size_t>(__builtin_ctz(bits));
        m0 = std::min(m0, mean[i]), m1 = std::max(m1, mean[i]);
        d0 = std::min(d0, deviation[i]), d1 = std::max(d1, deviation[i]);
      }
      if (alive[g] == 0) continue;
      it.mean_low[first + g] = below(m0), it.mean_high[first + g] = above(m1);
      it.deviation_low[first + g] = below(d0), it.deviation_high[first + g] = above(d1);
    }
  }
  for (std::size_t g = 0; g < count; ++g) {
    float least = std::numeric_limits<float>::max();
    for (unsigned bits = alive[g]; bits != 0; bits &= bits - 1)
      least = std::min(least, rest[g * kGroup + static_cast<std::size_t>(__builtin_ctz(bits))]);
    if (alive[g] != 0) rest_[first + g] = least;
  }
}

void GroupBounds::find(const TapSums& taps, std::vector<float>& out) const {
  out = rest_;
  const float half = 0.5F, mean_factor = half * static_cast<float>(taps.blocks);
  for (std::size_t ch = 0; ch < channels_.size(); ++ch) {
    const Channel& it = channels_[ch];
    add_distances({it.mean_low.data(), it.mean_high.data(), taps.mean[ch], mean_factor},
                  {it.deviation_low.data(), it.deviation_high.data(), taps.deviation[ch], half}, out.size(),
                  out.data());
  }
}

std::size_t GroupBounds::bytes() const {
  return rest_.size() * (sizeof(float) + channels_.size() * 4 * sizeof(std::int16_t));
}

}  // namespace veneer::planner
