#include "planner/matching/coarse_map.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "planner/cancelled.h"
#include "planner/matching/window_samples.h"

namespace veneer::planner {
namespace {

constexpr int kCellsAWindow = 12;
constexpr int kMostSamples = 6;  // a cell and axis, unless half its pixels are more

int cells_along(int window) { return std::min(kCellsAWindow, std::max(2, window / 2 * 2)); }

}  // namespace

int CellGrid::first_place(int k, double size) { return static_cast<int>(std::ceil((k - 0.5) * size - 1e-9)); }

CellGrid cell_grid(const WindowClass& windows) {
  const int columns = cells_along(windows.width), rows = cells_along(windows.height);
  CellGrid grid = cells_of(static_cast<double>(windows.width) / columns, static_cast<double>(windows.height) / rows);
  grid.columns = columns, grid.rows = rows;
  return grid;
}

CellGrid cells_of(double width, double height) {
  CellGrid grid;
  grid.width = width, grid.height = height;
  // All pixels of small cells; a sample of large ones says as much.
  const auto samples = [](double size) {
    const int pixels = std::max(1, static_cast<int>(std::lround(size)));
    return pixels <= kMostSamples ? pixels : std::max(kMostSamples, pixels / 2);
  };
  grid.samples_x = samples(width), grid.samples_y = samples(height);
  return grid;
}

int largest_score_entry(int channels) {
  // Sums of products over all blocks and channels, and half the energy, each within 2^30.
  const int blocks = kCellsAWindow * kCellsAWindow / 4;
  const int pairs = (channels + 1) / 2;
  return std::min(4095, static_cast<int>(std::sqrt(static_cast<double>(1 << 30) / (blocks * 2 * pairs))));
}

// Means of the cells, before they become blocks.
struct CoarseMap::Measured {
  std::vector<std::int16_t> means;   // channels side by side
  std::vector<std::int32_t> energy;  // an eighth of the mean squared length
};

CoarseMap::CoarseMap(const cv::Size& panel, int channels, const Lattice& lattice, const CellGrid& grid, bool filled)
    : grid_(grid), channels_(channels), filled_(filled) {
  find_rows(lattice, panel);
  planes_.assign(static_cast<std::size_t>((channels_ + (filled_ ? 0 : 1) + 1) / 2),
                 std::vector<std::int16_t>(static_cast<std::size_t>(2 * size_), 0));
  half_energy_.assign(static_cast<std::size_t>(size_), 0);
}

Status CoarseMap::measure(const cv::Mat& entries, const Lattice& lattice, const std::stop_token& stop) {
  const Result<Measured> cells = measure_cells(entries, lattice, stop);
  if (!cells.ok()) return cells.error();
  if (Status done = average_blocks(*cells, stop); !done.ok() || !filled_) return done;
  return add_up_energy(*cells, stop);
}

std::vector<std::span<std::byte>> CoarseMap::measured() {
  std::vector<std::span<std::byte>> out;
  for (auto& plane : planes_) out.push_back(std::as_writable_bytes(std::span(plane)));
  out.push_back(std::as_writable_bytes(std::span(half_energy_)));
  return out;
}

void CoarseMap::find_rows(const Lattice& lattice, const cv::Size& panel) {
  // Of windows that are not filled the last blocks may reach beyond the lattice.
  const int beyond = filled_ ? 0 : 2;
  const int rows = static_cast<int>(lattice.height() / grid_.height) + 1 + beyond;
  std::size_t groups = 0;
  size_ = margin();
  for (int row = 0; row < rows; ++row) {
    // Where the line through the cells' centres crosses the panel.
    RowStretch on_panel{0, static_cast<double>(lattice.width())};
    double column = 0, down = 0;
    lattice.to_panel(0, (row + 0.5) * grid_.height, column, down);
    on_panel.keep_on_panel(lattice, column, down, panel.width, panel.height);
    // Windows with empty corners may begin beyond it.
    if (!filled_) on_panel = {0, static_cast<double>(lattice.width())};
    const bool any = on_panel.high > on_panel.low;
    begin_.push_back(any ? std::max(0, static_cast<int>(on_panel.low / grid_.width) - 1) : 0);
    end_.push_back(any ? static_cast<int>(on_panel.high / grid_.width) + 2 + beyond : 0);
    base_.push_back(size_ - begin_.back());
    size_ += end_.back() - begin_.back();
    group_base_.push_back(groups);
    groups += static_cast<std::size_t>(this->groups(row));
  }
  size_ += margin();
  alive_.assign(groups, 0);
}

Result<CoarseMap::Measured> CoarseMap::measure_cells(const cv::Mat& entries, const Lattice& lattice,
                                                     const std::stop_token& stop) const {
  Measured out;
  out.means.assign(static_cast<std::size_t>(size_ * channels_), 0);
  out.energy.assign(static_cast<std::size_t>(size_), 0);
  std::vector<std::int16_t> samples;
  std::vector<std::int32_t> sums, squares;
  const double per_sample = 1.0 / (grid_.samples_x * grid_.samples_y);
  for (int row = 0; row < rows(); ++row) {
    const int cells = end(row) - begin(row), a_cell = grid_.samples_x * channels_;
    if (cells == 0) continue;
    if (stop.stop_requested()) return cancelled();
    const auto length = static_cast<std::size_t>(cells * a_cell);
    samples.resize(length * static_cast<std::size_t>(grid_.samples_y));
    sample(entries, lattice,
           {begin(row) * grid_.width, row * grid_.height, grid_.width / grid_.samples_x, grid_.height / grid_.samples_y,
            cells * grid_.samples_x, grid_.samples_y},
           length, samples.data());
    sums.assign(length, 0), squares.assign(length, 0);
    for (int k = 0; k < grid_.samples_y; ++k) {
      const std::int16_t* from = samples.data() + static_cast<std::size_t>(k) * length;
      for (std::size_t i = 0; i < length; ++i) {
        const std::int32_t v = from[i];
        sums[i] += v, squares[i] += v * v;
      }
    }
    const std::ptrdiff_t first = base_[static_cast<std::size_t>(row)] + begin(row);
    for (int cell = 0; cell < cells; ++cell) {
      std::int64_t energy = 0;
      for (int i = cell * a_cell; i < (cell + 1) * a_cell; ++i) energy += squares[static_cast<std::size_t>(i)];
      out.energy[static_cast<std::size_t>(first + cell)] =
          static_cast<std::int32_t>(std::lrint(static_cast<double>(energy) * per_sample / 8));
      for (int ch = 0; ch < channels_; ++ch) {
        std::int32_t sum = 0;
        for (int i = 0; i < grid_.samples_x; ++i)
          sum += sums[static_cast<std::size_t>(cell * a_cell + i * channels_ + ch)];
        out.means[static_cast<std::size_t>((first + cell) * channels_ + ch)] =
            static_cast<std::int16_t>(std::lrint(sum * per_sample));
      }
    }
  }
  return out;
}

Status CoarseMap::average_blocks(const Measured& cells, const std::stop_token& stop) {
  for (int row = 0; row + 1 < rows(); ++row) {
    if (stop.stop_requested()) return cancelled();
    const std::int16_t* upper = cells.means.data() + base_[static_cast<std::size_t>(row)] * channels_;
    const std::int16_t* lower = cells.means.data() + base_[static_cast<std::size_t>(row) + 1] * channels_;
    const int first = std::max(begin(row), begin(row + 1)), last = std::min(end(row), end(row + 1)) - 1;
    for (int ch = 0; ch < channels_; ++ch) {
      std::int16_t* to = planes_[static_cast<std::size_t>(ch) / 2].data() + 2 * base_[static_cast<std::size_t>(row)];
      for (int cell = first; cell < last; ++cell) {
        const int left = cell * channels_ + ch, right = left + channels_;
        to[2 * cell + ch % 2] =
            static_cast<std::int16_t>((upper[left] + upper[right] + lower[left] + lower[right] + 2) >> 2);
      }
    }
    if (filled_) continue;
    const std::int32_t* energy = cells.energy.data() + base_[static_cast<std::size_t>(row)];
    const std::int32_t* energy_below = cells.energy.data() + base_[static_cast<std::size_t>(row) + 1];
    std::int16_t* to = planes_.back().data() + 2 * base_[static_cast<std::size_t>(row)] + channels_ % 2;
    for (int cell = first; cell < last; ++cell)
      to[2 * cell] = static_cast<std::int16_t>(
          (energy[cell] + energy[cell + 1] + energy_below[cell] + energy_below[cell + 1]) / kEnergyUnit);
  }
  return Ok();
}

Status CoarseMap::add_up_energy(const Measured& cells, const std::stop_token& stop) {
  int widest = 0;
  for (int row = 0; row < rows(); ++row) widest = std::max(widest, end(row));
  // Sums over the window's rows, slid down; windows that leave the panel get something small, but no place.
  std::vector<std::int32_t> column_sums(static_cast<std::size_t>(widest) + 1, 0);
  const auto add_row = [&](int row, int sign) {
    if (row >= rows()) return;
    const std::int32_t* from = cells.energy.data() + base_[static_cast<std::size_t>(row)];
    for (int cell = begin(row); cell < end(row); ++cell)
      column_sums[static_cast<std::size_t>(cell)] += sign * from[cell];
  };
  for (int row = 0; row < grid_.rows; ++row) add_row(row, 1);
  for (int row = 0; row < rows(); ++row) {
    if (stop.stop_requested()) return cancelled();
    std::int32_t* to = half_energy_.data() + base_[static_cast<std::size_t>(row)];
    std::int64_t sum = 0;
    for (int cell = begin(row); cell < std::min(begin(row) + grid_.columns, widest); ++cell)
      sum += column_sums[static_cast<std::size_t>(cell)];
    for (int cell = begin(row); cell < end(row); ++cell) {
      to[cell] = static_cast<std::int32_t>(sum);
      sum -= column_sums[static_cast<std::size_t>(cell)];
      if (cell + grid_.columns < widest) sum += column_sums[static_cast<std::size_t>(cell + grid_.columns)];
    }
    add_row(row, -1);
    add_row(row + grid_.rows, 1);
  }
  return Ok();
}

Status CoarseMap::find_alive(const PlaceBits& places, const cv::Rect& changed, const std::stop_token& stop) {
  // One cell more on each side than the places need.
  const int first_row = std::max(0, static_cast<int>(changed.y / grid_.height) - 1);
  const int last_row = std::min(rows() - 1, static_cast<int>(changed.br().y / grid_.height) + 1);
  const int first_cell = static_cast<int>(changed.x / grid_.width) - 1;
  const int last_cell = static_cast<int>(changed.br().x / grid_.width) + 1;
  for (int row = first_row; row <= last_row; ++row) {
    if (stop.stop_requested()) return cancelled();
    const int y0 = CellGrid::first_place(row, grid_.height), y1 = CellGrid::first_place(row + 1, grid_.height);
    std::uint16_t* alive = alive_.data() + group_base_[static_cast<std::size_t>(row)];
    for (int cell = std::max(begin(row), first_cell); cell < std::min(end(row), last_cell + 1); ++cell) {
      const int x0 = CellGrid::first_place(cell, grid_.width), x1 = CellGrid::first_place(cell + 1, grid_.width);
      const int k = cell - begin(row);
      const auto bit = static_cast<std::uint16_t>(1U << (k % kernels::kGroup));
      std::uint16_t& group = alive[k / kernels::kGroup];
      group = static_cast<std::uint16_t>(places.any(x0, x1, y0, y1) ? group | bit : group & ~bit);
    }
  }
  return Ok();
}

void CoarseMap::find_alive(const PlaceBits& places, const cv::Rect& changed) {
  (void)find_alive(places, changed, std::stop_token());  // which never stops
}

Status CoarseMap::find_bounds(const std::stop_token& stop) {
  bounds_.emplace(channels_, alive_.size());
  std::vector<const std::int16_t*> rows_of_blocks;
  for (int row = 0; row + grid_.rows <= rows(); ++row) {
    if (stop.stop_requested()) return cancelled();
    const auto count = static_cast<std::size_t>(groups(row));
    if (std::all_of(alive(row), alive(row) + count, [](std::uint16_t group) { return group == 0; })) continue;
    rows_of_blocks.clear();
    for (int pair = 0; pair < pairs(); ++pair)
      for (int k = 0; k < grid_.rows / 2; ++k) rows_of_blocks.push_back(blocks(pair, row + 2 * k, begin(row)));
    bounds_->measure(group_base_[static_cast<std::size_t>(row)], count, {rows_of_blocks.data(), half_energy(row)},
                     grid_.rows / 2, grid_.columns / 2, alive(row));
  }
  return Ok();
}

void CoarseMap::find_score_bounds(const TapSums& taps, std::vector<float>& out) const {
  if (bounds_)
    bounds_->find(taps, out);
  else
    out.assign(alive_.size(), std::numeric_limits<float>::lowest());
}

void CoarseMap::groups_within(int row, const std::vector<float>& bounds, float most,
                              std::vector<std::uint32_t>& out) const {
  out.clear();
  const float* bound = bounds.data() + group_base_[static_cast<std::size_t>(row)];
  const std::uint16_t* alive = this->alive(row);
  for (int g = 0; g < groups(row); ++g)
    if (bound[g] <= most && alive[g] != 0) out.push_back(static_cast<std::uint32_t>(g * kernels::kGroup));
}

std::size_t CoarseMap::alive_cells() const {
  std::size_t sum = 0;
  for (const std::uint16_t group : alive_) sum += static_cast<std::size_t>(__builtin_popcount(group));
  return sum;
}

std::size_t CoarseMap::bytes() const {
  return planes_.size() * static_cast<std::size_t>(size_) * 2 * sizeof(std::int16_t) +
         half_energy_.size() * sizeof(std::int32_t) + alive_.size() * sizeof(std::uint16_t) +
         (bounds_ ? bounds_->bytes() : 0);
}

}  // namespace veneer::planner
