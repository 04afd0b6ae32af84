#include "planner/pictures/resample.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "planner/cancelled.h"

namespace veneer::planner {
namespace {

// The source pixels that make up one pixel out, with weights that sum to 1.
struct Contribution {
  int first = 0;
  std::vector<float> weights;
};

Contribution area_average(double begin, double end, int source_size) {
  begin = std::clamp(begin, 0.0, source_size - 1e-9);
  end = std::clamp(end, begin + 1e-9, static_cast<double>(source_size));
  Contribution out{static_cast<int>(begin), {}};
  const int last = std::min(static_cast<int>(std::ceil(end - 1e-9)), source_size) - 1;
  for (int i = out.first; i <= std::max(last, out.first); ++i) {
    const double covered = std::min<double>(end, i + 1) - std::max<double>(begin, i);
    out.weights.push_back(static_cast<float>(std::max(covered, 0.0) / (end - begin)));
  }
  return out;
}

Contribution linear(double centre, int source_size) {
  const double at = std::clamp(centre - 0.5, 0.0, source_size - 1.0);
  const int first = std::min(static_cast<int>(at), std::max(source_size - 2, 0));
  const auto fraction = static_cast<float>(at - first);
  if (source_size == 1) return {0, {1}};
  return {first, {1 - fraction, fraction}};
}

std::vector<Contribution> contributions(const AxisScale& axis, int source_size) {
  std::vector<Contribution> out;
  out.reserve(static_cast<std::size_t>(axis.size));
  for (int i = 0; i < axis.size; ++i) {
    const double begin = axis.offset + i * axis.step;
    out.push_back(axis.step > 1 ? area_average(begin, begin + axis.step, source_size)
                                : linear(begin + axis.step / 2, source_size));
  }
  return out;
}

void resample_row(const std::uint8_t* source, const std::vector<Contribution>& columns, int channels, float* out) {
  for (const Contribution& column : columns) {
    const std::uint8_t* from = source + static_cast<std::ptrdiff_t>(column.first) * channels;
    for (int c = 0; c < channels; ++c) {
      float sum = 0;
      for (std::size_t k = 0; k < column.weights.size(); ++k)
        sum += column.weights[k] * static_cast<float>(from[k * static_cast<std::size_t>(channels) + c]);
      *out++ = sum;
    }
  }
}

}  // namespace

Result<cv::Mat> resample(const cv::Mat& source, const AxisScale& columns, const AxisScale& rows,
                         const std::stop_token& stop) {
  CV_Assert(source.depth() == CV_8U && !source.empty() && columns.size > 0 && rows.size > 0);
  const auto across = contributions(columns, source.cols);
  const auto down = contributions(rows, source.rows);
  const int channels = source.channels();
  const std::size_t length = static_cast<std::size_t>(columns.size) * static_cast<std::size_t>(channels);
  cv::Mat out(rows.size, columns.size, source.type());

  // Neighbouring rows out share source rows, so the last few resampled rows are kept.
  const std::size_t kept = [&] {
    std::size_t most = 2;
    for (const auto& c : down) most = std::max(most, c.weights.size() + 1);
    return most;
  }();
  std::vector<std::vector<float>> ring(kept, std::vector<float>(length));
  std::vector<int> ring_row(kept, -1);
  std::vector<float> sum(length);
  for (int r = 0; r < rows.size; ++r) {
    if (stop.stop_requested()) return cancelled();
    std::fill(sum.begin(), sum.end(), 0.0F);
    const Contribution& contribution = down[static_cast<std::size_t>(r)];
    for (std::size_t k = 0; k < contribution.weights.size(); ++k) {
      const int row = contribution.first + static_cast<int>(k);
      const std::size_t slot = static_cast<std::size_t>(row) % kept;
      if (ring_row[slot] != row) {
        resample_row(source.ptr<std::uint8_t>(row), across, channels, ring[slot].data());
        ring_row[slot] = row;
      }
      const float weight = contribution.weights[k];
      for (std::size_t i = 0; i < length; ++i) sum[i] += weight * ring[slot][i];
    }
    auto* to = out.ptr<std::uint8_t>(r);
    for (std::size_t i = 0; i < length; ++i)
      to[i] = static_cast<std::uint8_t>(std::clamp(std::lround(sum[i]), 0L, 255L));
  }
  return out;
}

Result<cv::Mat> stretch(const cv::Mat& source, int width, int height, const std::stop_token& stop) {
  if (source.cols == width && source.rows == height) return source;
  return resample(source, {width, static_cast<double>(source.cols) / width, 0},
                  {height, static_cast<double>(source.rows) / height, 0}, stop);
}

cv::Mat stretch(const cv::Mat& source, int width, int height) {
  return *stretch(source, width, height, std::stop_token());
}

template <class Frame>
Result<Raster<Frame>> at_resolution(const Raster<Frame>& raster, ScanResolution resolution,
                                    const std::stop_token& stop) {
  const double step = raster.resolution.px_per_mm / resolution.px_per_mm;
  if (std::abs(step - 1) < 1e-9) return raster;
  constexpr double kRounding = 1e-6;  // a panel of exactly N pixels keeps its last one
  const int width = std::max(1, static_cast<int>(std::floor(raster.pixels.cols / step + kRounding)));
  const int height = std::max(1, static_cast<int>(std::floor(raster.pixels.rows / step + kRounding)));
  const Result<cv::Mat> pixels =
      resample(raster.pixels, {width, step, 0}, {height, step, raster.pixels.rows - height * step}, stop);
  if (!pixels.ok()) return pixels.error();
  Raster<Frame> out;
  out.pixels = *pixels;
  out.resolution = resolution;
  out.origin = raster.origin;
  return out;
}

template Result<Raster<PanelFrame>> at_resolution(const Raster<PanelFrame>&, ScanResolution, const std::stop_token&);

}  // namespace veneer::planner
