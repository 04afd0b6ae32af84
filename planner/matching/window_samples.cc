#include "planner/matching/window_samples.h"

#include <algorithm>
#include <cmath>

#include "planner/cancelled.h"

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace veneer::planner {
namespace {

// Positions are whole numbers with so many binary places; weights of bilinear interpolation have fewer, and the sums
// along columns are rounded to fit 16 bits before the sums along rows.
constexpr int kFractionBits = 32, kWeightBits = 8, kWhole = 1 << kWeightBits;
constexpr int kDropped = 5, kRest = 2 * kWeightBits - kDropped;

struct Walk {
  std::int64_t column, row, column_step, row_step;
  void advance(int samples) { column += column_step * samples, row += row_step * samples; }
};

std::int64_t fixed(double value) {
  return static_cast<std::int64_t>(std::floor(value * static_cast<double>(std::int64_t{1} << kFractionBits)));
}
int weight_of(std::int64_t position) {
  return static_cast<int>(position >> (kFractionBits - kWeightBits)) & (kWhole - 1);
}

std::int16_t interpolate(int a, int b, int d, int e, int fx, int fy) {
  constexpr int kHalf = 1 << (kDropped - 1), kHalfRest = 1 << (kRest - 1);
  const int left = (a * (kWhole - fy) + d * fy + kHalf) >> kDropped;
  const int right = (b * (kWhole - fy) + e * fy + kHalf) >> kDropped;
  return static_cast<std::int16_t>((left * (kWhole - fx) + right * fx + kHalfRest) >> kRest);
}

// Positions beyond the map are moved to its border.
void sample_row(const cv::Mat& map, Walk walk, int count, std::int16_t* out) {
  const int channels = map.channels();
  const auto stride = static_cast<std::ptrdiff_t>(map.step1());
  const auto* origin = map.ptr<std::int16_t>(0);
  const std::int64_t last_column = static_cast<std::int64_t>(map.cols - 1) << kFractionBits;
  const std::int64_t last_row = static_cast<std::int64_t>(map.rows - 1) << kFractionBits;
  for (int i = 0; i < count; ++i, walk.column += walk.column_step, walk.row += walk.row_step) {
    const std::int64_t x = std::clamp<std::int64_t>(walk.column, 0, last_column);
    const std::int64_t y = std::clamp<std::int64_t>(walk.row, 0, last_row);
    const std::int16_t* upper = origin + (y >> kFractionBits) * stride + (x >> kFractionBits) * channels;
    const std::int16_t* lower = upper + (y < last_row ? stride : 0);
    const int right = x < last_column ? channels : 0;
    for (int ch = 0; ch < channels; ++ch)
      *out++ = interpolate(upper[ch], upper[ch + right], lower[ch], lower[ch + right], weight_of(x), weight_of(y));
  }
}

#ifdef __SSE2__

// Narrows [first, last) to the samples whose position lies on the map before its last pixel.
void keep_within(std::int64_t start, std::int64_t step, int size, int& first, int& last) {
  const std::int64_t end = static_cast<std::int64_t>(size - 1) << kFractionBits;
  const auto inside = [&](int i) { return start + step * i >= 0 && start + step * i < end; };
  if (step == 0) {
    if (!inside(0)) last = first;
    return;
  }
  // Whole-number division rounds towards 0, so the ends are looked at once more.
  const std::int64_t to_zero = -start / step, to_end = (end - start) / step;
  // Half a turn is not quite one, so steps may be so small that the ends lie farther off than an int counts.
  const int before = first, after = last;
  first = static_cast<int>(std::clamp<std::int64_t>(std::min(to_zero, to_end) - 1, before, after));
  last = static_cast<int>(std::clamp<std::int64_t>(std::max(to_zero, to_end) + 2, before, after));
  while (first < last && !inside(first)) ++first;
  while (first < last && !inside(last - 1)) --last;
}

// Whether all samples of a row need no pixel beyond the map.
bool stays_within(const Walk& walk, int count, const cv::Size& map) {
  const auto within = [&](std::int64_t start, std::int64_t step, int size) {
    const std::int64_t end = start + step * (count - 1);
    return std::min(start, end) >= 0 && std::max(start, end) < static_cast<std::int64_t>(size - 1) << kFractionBits;
  };
  return within(walk.column, walk.column_step, map.width) && within(walk.row, walk.row_step, map.height);
}

// (kWhole - f, f) four times over, for every weight f, and for kWhole.
struct WeightTable {
  alignas(16) std::int16_t weights[kWhole + 1][8];
  constexpr WeightTable() : weights() {
    for (int f = 0; f <= kWhole; ++f)
      for (int k = 0; k < 8; ++k) weights[f][k] = static_cast<std::int16_t>(k % 2 == 0 ? kWhole - f : f);
  }
  const __m128i& operator[](int f) const { return *reinterpret_cast<const __m128i*>(weights[f]); }
};
constexpr WeightTable kWeights;

// The sums along columns of the two pixels left and right of a position: channels 0, 1, then 0, 1 of the right one.
__m128i along_columns(const std::int16_t* upper, const std::int16_t* lower, int fy) {
  const __m128i above = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(upper));
  const __m128i below = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(lower));
  const __m128i sums = _mm_madd_epi16(_mm_unpacklo_epi16(above, below), kWeights[fy]);
  return _mm_srai_epi32(_mm_add_epi32(sums, _mm_set1_epi32(1 << (kDropped - 1))), kDropped);
}

// The sums of left and right neighbours, rounded to entries. `sides`: (left, right) of four of them.
__m128i along_row(const __m128i& sides, const __m128i& weights) {
  const __m128i sums = _mm_madd_epi16(sides, weights);
  return _mm_srai_epi32(_mm_add_epi32(sums, _mm_set1_epi32(1 << (kRest - 1))), kRest);
}

// Two channels, and no sample needs a pixel beyond the map.
void sample_row_of_two(const cv::Mat& map, Walk walk, int count, std::int16_t* out) {
  const auto stride = static_cast<std::ptrdiff_t>(map.step1());
  const auto* origin = map.ptr<std::int16_t>(0);
  const auto pair = [&](int& fx) {
    const std::int16_t* upper = origin + (walk.row >> kFractionBits) * stride + (walk.column >> kFractionBits) * 2;
    const __m128i sums = along_columns(upper, upper + stride, weight_of(walk.row));
    fx = weight_of(walk.column);
    walk.column += walk.column_step, walk.row += walk.row_step;
    return sums;
  };
  for (int i = 0; i + 2 <= count; i += 2) {
    int fx = 0, next_fx = 0;
    const __m128i first = pair(fx), second = pair(next_fx);
    // Channel by channel: left, right.
    __m128i sides = _mm_packs_epi32(first, second);
    sides = _mm_shufflehi_epi16(_mm_shufflelo_epi16(sides, _MM_SHUFFLE(3, 1, 2, 0)), _MM_SHUFFLE(3, 1, 2, 0));
    const __m128i sums = along_row(sides, _mm_unpacklo_epi64(kWeights[fx], kWeights[next_fx]));
    _mm_storel_epi64(reinterpret_cast<__m128i*>(out + static_cast<std::ptrdiff_t>(2) * i), _mm_packs_epi32(sums, sums));
  }
  if (count % 2 != 0) sample_row(map, walk, 1, out + static_cast<std::ptrdiff_t>(2) * (count - 1));
}

// The same for four channels, as many as brightness, edges and colour have together. Positions beyond the map are moved
// to its border, unless kInside; on the border they are the right or lower neighbour of the pixel before it.
template <bool kInside>
void sample_row_of_four(const cv::Mat& map, Walk walk, int count, std::int16_t* out) {
  const auto stride = static_cast<std::ptrdiff_t>(map.step1());
  const auto* origin = map.ptr<std::int16_t>(0);
  const std::int64_t last_column = map.cols - 1, last_row = map.rows - 1;
  const __m128i half = _mm_set1_epi32(1 << (kDropped - 1));
  const auto place = [](std::int64_t position, std::int64_t last, int& weight) {
    if constexpr (kInside) {
      weight = weight_of(position);
      return position >> kFractionBits;
    }
    const std::int64_t at = std::clamp<std::int64_t>(position, 0, last << kFractionBits);
    const std::int64_t pixel = std::min(at >> kFractionBits, last - 1);
    weight = static_cast<int>((at - (pixel << kFractionBits)) >> (kFractionBits - kWeightBits));
    return pixel;
  };
  for (int i = 0; i < count; ++i, out += 4, walk.column += walk.column_step, walk.row += walk.row_step) {
    int fx = 0, fy = 0;
    const std::int64_t column = place(walk.column, last_column, fx), row = place(walk.row, last_row, fy);
    const std::int16_t* upper = origin + row * stride + column * 4;
    const __m128i above = _mm_loadu_si128(reinterpret_cast<const __m128i*>(upper));
    const __m128i below = _mm_loadu_si128(reinterpret_cast<const __m128i*>(upper + stride));
    const __m128i left = _mm_madd_epi16(_mm_unpacklo_epi16(above, below), kWeights[fy]);
    const __m128i right = _mm_madd_epi16(_mm_unpackhi_epi16(above, below), kWeights[fy]);
    const __m128i both = _mm_packs_epi32(_mm_srai_epi32(_mm_add_epi32(left, half), kDropped),
                                         _mm_srai_epi32(_mm_add_epi32(right, half), kDropped));
    const __m128i sums = along_row(_mm_unpacklo_epi16(both, _mm_srli_si128(both, 8)), kWeights[fx]);
    _mm_storel_epi64(reinterpret_cast<__m128i*>(out), _mm_packs_epi32(sums, sums));
  }
}

#endif

}  // namespace

Result<cv::Mat> rounded_entries(const cv::Mat& features, double entries_per_unit, const std::stop_token& stop) {
  cv::Mat out(features.size(), CV_MAKETYPE(CV_16S, features.channels()));
  const auto scale = static_cast<float>(entries_per_unit);
  const int length = features.cols * features.channels();
  for (int r = 0; r < features.rows; ++r) {
    if (stop.stop_requested()) return cancelled();
    const auto* from = features.ptr<float>(r);
    auto* to = out.ptr<std::int16_t>(r);
    for (int i = 0; i < length; ++i) {
      const float entry = from[i] * scale;
      to[i] = static_cast<std::int16_t>(static_cast<int>(entry + (entry < 0 ? -0.5F : 0.5F)));
    }
  }
  return out;
}

void sample(const cv::Mat& map, const Lattice& lattice, const SampleGrid& grid, std::size_t row_length,
            std::int16_t* out, const SampledPart* parts) {
  const std::int64_t column_step = fixed(lattice.cos() * grid.step_x), row_step = fixed(-lattice.sin() * grid.step_x);
  const auto walk_of_row = [&](int k) {
    double column = 0, row = 0;
    lattice.to_panel(grid.x + 0.5 * grid.step_x, grid.y + (k + 0.5) * grid.step_y, column, row);
    // Positions count from pixel centres.
    return Walk{fixed(column - 0.5), fixed(row - 0.5), column_step, row_step};
  };
  const auto channels = static_cast<std::size_t>(map.channels());
  // Calls sample_part(walk, count, to) for each row.
  const auto for_rows = [&](auto sample_part) {
    for (int k = 0; k < grid.rows; ++k) {
      const SampledPart part = parts != nullptr ? parts[k] : SampledPart{0, grid.columns};
      if (part.first >= part.last) continue;
      Walk walk = walk_of_row(k);
      walk.advance(part.first);
      sample_part(walk, part.last - part.first,
                  out + static_cast<std::size_t>(k) * row_length + static_cast<std::size_t>(part.first) * channels);
    }
  };
#ifdef __SSE2__
  const bool inside = stays_within(walk_of_row(0), grid.columns, map.size()) &&
                      stays_within(walk_of_row(grid.rows - 1), grid.columns, map.size());
  if (map.channels() == 4 && map.cols > 1 && map.rows > 1) {
    const auto sample_four = inside ? sample_row_of_four<true> : sample_row_of_four<false>;
    for_rows([&](const Walk& walk, int count, std::int16_t* to) { sample_four(map, walk, count, to); });
    return;
  }
  if (map.channels() == 2) {
    for_rows([&](Walk walk, int count, std::int16_t* to) {
      // The samples in the middle of the row that need no pixel beyond the map.
      int first = 0, last = count;
      if (!inside) {
        keep_within(walk.column, column_step, map.cols, first, last);
        keep_within(walk.row, row_step, map.rows, first, last);
        if (first >= last) first = last = count;
        sample_row(map, walk, first, to);
        walk.advance(first);
      }
      sample_row_of_two(map, walk, last - first, to + static_cast<std::ptrdiff_t>(2) * first);
      if (inside) return;
      walk.advance(last - first);
      sample_row(map, walk, count - last, to + static_cast<std::ptrdiff_t>(2) * last);
    });
    return;
  }
#endif
  for_rows([&](const Walk& walk, int count, std::int16_t* to) { sample_row(map, walk, count, to); });
}

BoxMeans box_means(const MatchPatch& patch, int columns, int rows, double box_width, double box_height) {
  const PatchPixels& pixels = patch.pixels;
  const auto channels = static_cast<std::size_t>(patch.features->channels());
  BoxMeans out;
  out.means.assign(static_cast<std::size_t>(columns * rows) * channels, 0);
  out.coverage.assign(static_cast<std::size_t>(columns * rows), 0);
  // A pixel belongs to at most two boxes an axis when boxes are at least as large as pixels.
  struct Part {
    int box;
    double share;
  };
  const auto parts_of = [](int pixel, double size, int count) {
    std::vector<Part> parts;
    for (int box = static_cast<int>(pixel / size); box < count && box * size < pixel + 1; ++box) {
      const double share = std::min<double>(pixel + 1, (box + 1) * size) - std::max<double>(pixel, box * size);
      if (share > 1e-9) parts.push_back({box, share});
    }
    return parts;
  };
  std::vector<std::vector<Part>> across;
  across.reserve(static_cast<std::size_t>(pixels.width));
  for (int c = 0; c < pixels.width; ++c) across.push_back(parts_of(c, box_width, columns));
  const double area = box_width * box_height;
  for (const PatchPixels::Span& span : pixels.spans) {
    const auto* from = patch.features->ptr<float>(span.row);
    for (const Part& down : parts_of(span.row - pixels.top, box_height, rows)) {
      for (int c = span.begin; c < span.end; ++c) {
        for (const Part& part : across[static_cast<std::size_t>(c - pixels.left)]) {
          const double share = down.share * part.share / area;
          const auto box = static_cast<std::size_t>(down.box * columns + part.box);
          out.coverage[box] += share;
          for (std::size_t ch = 0; ch < channels; ++ch)
            out.means[box * channels + ch] += share * from[static_cast<std::size_t>(c) * channels + ch];
        }
      }
    }
  }
  return out;
}

TargetWindow::TargetWindow(const MatchPatch& patch, double entries_per_unit, int stride) : stride_(stride) {
  const PatchPixels& pixels = patch.pixels;
  // The last stride may be cut short, but not before its sample.
  columns_ = (pixels.width - stride / 2 + stride - 1) / stride;
  rows_ = (pixels.height - stride / 2 + stride - 1) / stride;
  const auto channels = static_cast<std::size_t>(patch.features->channels());
  const std::size_t wanted = static_cast<std::size_t>(columns_) * channels;
  row_length_ = (wanted + kernels::kRowStep - 1) / kernels::kRowStep * kernels::kRowStep;
  target_.assign(row_length_ * static_cast<std::size_t>(rows_), 0);
  mask_.assign(target_.size() / kernels::kRowStep, 0);
  for (int r = 0; r < rows_; ++r) {
    order_.push_back(r);
    row_base_.push_back(static_cast<std::ptrdiff_t>(row_length_) * r);
  }
  parts_.assign(static_cast<std::size_t>(rows_), {columns_, 0});
  for (const PatchPixels::Span& span : pixels.spans) {
    const int r = (span.row - pixels.top) / stride;
    if ((span.row - pixels.top) % stride != stride / 2) continue;
    const auto* from = patch.features->ptr<float>(span.row);
    // The samples within the span.
    const auto first_from = [&](int column) { return (column - pixels.left - stride / 2 + stride - 1) / stride; };
    SampledPart& part = parts_[static_cast<std::size_t>(r)];
    const int first = first_from(span.begin), last = first_from(span.end);
    if (first < last) part = {std::min(part.first, first), std::max(part.last, last)};
    for (int c = first; c < last; ++c) {
      const int column = pixels.left + c * stride + stride / 2;
      for (std::size_t ch = 0; ch < channels; ++ch) {
        const std::size_t at = static_cast<std::size_t>(r) * row_length_ + static_cast<std::size_t>(c) * channels + ch;
        target_[at] = static_cast<std::int16_t>(
            std::lround(from[static_cast<std::size_t>(column) * channels + ch] * entries_per_unit));
        mask_[at / kernels::kRowStep] |= 1U << (at % kernels::kRowStep);
      }
    }
  }
  // Samples are taken two at once.
  for (SampledPart& part : parts_) {
    if ((part.last - part.first) % 2 == 0) continue;
    if (part.last < columns_)
      ++part.last;
    else if (part.first > 0)
      --part.first;
  }
}

}  // namespace veneer::planner
