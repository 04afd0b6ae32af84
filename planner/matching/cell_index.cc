#include "planner/matching/cell_index.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "planner/cancelled.h"
#include "planner/matching/kernels.h"
#include "planner/matching/window_sums.h"

namespace veneer::planner {
namespace {

std::uint16_t rounded_down(double value) {
  return static_cast<std::uint16_t>(std::clamp(std::floor(value), 0.0, 65535.0));
}
std::uint16_t rounded_up(double value) {
  return static_cast<std::uint16_t>(std::clamp(std::ceil(value), 0.0, 65535.0));
}

}  // namespace

BlockAxis choose_blocks(int window) {
  if (window < 12) return {1, 1, window};
  BlockAxis best;
  double best_score = -1;
  for (const int cell : {3, 4, 5}) {
    for (int block = 3 * cell; block <= window; block += cell) {
      const int blocks = std::min(5, window / block);
      // About four blocks an axis see enough structure; more only cost time. Larger cells are fewer cells.
      constexpr std::array<double, 6> kWorth{0, 0.6, 0.8, 0.97, 1, 1};
      const double covered = static_cast<double>(blocks * block) / window;
      const double score = covered * kWorth[static_cast<std::size_t>(blocks)] * (0.97 + 0.01 * cell);
      if (score > best_score) best_score = score, best = {cell, blocks, block};
    }
  }
  return best;
}

Result<BlockedPixels> blocked_pixels(const Raster<PanelFrame>& free, Millimetres shortest_side,
                                     const std::stop_token& stop) {
  const cv::Mat& mask = free.pixels;
  const int stride = std::max(1, static_cast<int>(free.resolution.to_px(shortest_side).count() / 2));
  BlockedPixels out;
  out.side = free.resolution.to_mm(Pixels(1));
  const auto is_free = [&](int row, int column) {
    return row >= 0 && column >= 0 && row < mask.rows && column < mask.cols && mask.at<std::uint8_t>(row, column) != 0;
  };
  for (int r = 0; r < mask.rows; ++r) {
    if (stop.stop_requested()) return cancelled();
    for (int c = 0; c < mask.cols; ++c) {
      if (mask.at<std::uint8_t>(r, c) != 0) continue;
      bool wanted = r % stride == 0 && c % stride == 0;
      for (int dr = -1; dr <= 1 && !wanted; ++dr)
        for (int dc = -1; dc <= 1 && !wanted; ++dc) wanted = is_free(r + dr, c + dc);
      if (wanted) out.centres.push_back(free.from_pixels(c + 0.5, r + 0.5));
    }
  }
  return out;
}

BandedPolygon on_lattice(const std::vector<Ring<PanelFrame>>& rings, const Raster<PanelFrame>& picture,
                         const Lattice& lattice) {
  std::vector<BandedPolygon::Corners> corners;
  for (const Ring<PanelFrame>& ring : rings) {
    BandedPolygon::Corners& it = corners.emplace_back();
    for (const Point<PanelFrame>& p : ring) {
      double column = 0, row = 0;
      picture.to_pixels(p, column, row);
      lattice.from_panel(column, row, it.x.emplace_back(), it.y.emplace_back());
    }
  }
  return BandedPolygon(std::move(corners));
}

CellIndex::CellIndex(const RotatedPanel& panel, const WindowClass& windows)
    : lattice_(panel.lattice()), windows_(windows), channels_(panel.channels()) {
  find_rows(panel);
}

Result<CellIndex> CellIndex::make(const RotatedPanel& panel, const WindowClass& windows,
                                  const Raster<PanelFrame>& picture, const BlockedPixels& blocked, Millimetres border,
                                  const std::stop_token& stop) {
  CellIndex index(panel, windows);
  Status done = index.measure(panel, kBlock, stop);
  if (done.ok() && windows.rest_pixels() > 0) done = index.measure(panel, kRest, stop);
  if (done.ok()) done = index.find_places(picture, blocked, border, stop);
  if (!done.ok()) return done.error();
  return index;
}

void CellIndex::find_rows(const RotatedPanel& panel) {
  const BlockAxis &x = windows_.x, &y = windows_.y;
  const int cell_rows = (lattice_.height() + y.cell - 1) / y.cell;
  std::ptrdiff_t size = 0;
  for (int row = 0; row < cell_rows; ++row) {
    const int first = row * y.cell, last = first + y.cell - 1 + y.block;
    int low = 0, high = last <= panel.rows() ? std::numeric_limits<int>::max() : 0;
    for (int r = first; r < last && high > 0; ++r)
      low = std::max(low, panel.begin(r)), high = std::min(high, panel.end(r));
    const int begin = (low + x.cell - 1) / x.cell;
    const int end = std::max(begin, (high - x.block - x.cell + 1) / x.cell + 1);
    // A window with an empty corner may lie partly beyond the panel; its full blocks do not.
    begin_.push_back(windows_.filled && high > low ? begin : 0);
    end_.push_back(!windows_.filled ? (lattice_.width() + x.cell - 1) / x.cell : high > low ? end : 0);
    base_.push_back(size - begin_.back());
    size += end_.back() - begin_.back();
  }
  // Cells are compared many at a time, past the end of the last row.
  const auto padded =
      static_cast<std::size_t>(size + 2 * kernels::kCellsAtOnce + (windows_.filled ? 0 : windows_.width));
  places_.assign(padded, 0);
  maps_.resize(map_of(windows_.rest_pixels() > 0 ? kRest : kBlock, channels_ - 1, kDeviation) + 1);
  for (Intervals& map : maps_) map.low.assign(padded, 0), map.high.assign(padded, 0);
}

Status CellIndex::measure(const RotatedPanel& panel, Part part, const std::stop_token& stop) {
  const BlockAxis &x = windows_.x, &y = windows_.y;
  const int columns = lattice_.width() + 2 * RotatedPanel::kReach + x.cell + 2 * windows_.width;
  std::vector<Term> terms;
  if (part == kBlock) {
    terms.push_back({1, x.block, ColumnSums(panel, columns, y.block)});
  } else {
    terms.push_back({1, windows_.width, ColumnSums(panel, columns, windows_.height)});
    terms.push_back({-1, x.covered(), ColumnSums(panel, columns, y.covered())});
  }
  const double pixels = part == kBlock ? windows_.block_pixels() : windows_.rest_pixels();
  const double scale = kFineUnits / pixels * (part == kBlock ? 1 : windows_.rest_scale());
  PlaceSums places(columns);
  std::vector<RowExtremes> extremes(static_cast<std::size_t>(channels_), RowExtremes(columns));
  for (std::size_t row = 0; row < begin_.size(); ++row) {
    if (stop.stop_requested()) return cancelled();
    const int first = begin_[row] * x.cell, count = (end_[row] - begin_[row]) * x.cell;
    for (RowExtremes& e : extremes) e.reset(count);
    for (int place_row = static_cast<int>(row) * y.cell; place_row < static_cast<int>(row + 1) * y.cell; ++place_row) {
      for (Term& term : terms) term.columns.move_to(place_row);
      for (int c = 0; c < channels_ && count > 0; ++c) {
        places.clear(count);
        for (const Term& term : terms) places.add(term, c, channels_, first, count);
        extremes[static_cast<std::size_t>(c)].add(places, pixels, count);
      }
    }
    for (int c = 0; c < channels_; ++c) store_row(extremes[static_cast<std::size_t>(c)], part, c, row, scale);
  }
  return Ok();
}

void CellIndex::store_row(const RowExtremes& e, Part part, int channel, std::size_t row, double scale) {
  const int cell_width = windows_.x.cell;
  Intervals& mean = maps_[map_of(part, channel, kMean)];
  Intervals& deviation = maps_[map_of(part, channel, kDeviation)];
  for (int cell = 0; cell < end_[row] - begin_[row]; ++cell) {
    const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(cell) * cell_width, last = first + cell_width;
    const auto least = [&](const std::vector<double>& v) {
      return *std::min_element(v.begin() + first, v.begin() + last);
    };
    const auto most = [&](const std::vector<double>& v) {
      return *std::max_element(v.begin() + first, v.begin() + last);
    };
    const auto at = static_cast<std::size_t>(base_[row] + begin_[row] + cell);
    mean.low[at] = rounded_down(least(e.sum_low) * scale - kClearSlack);
    mean.high[at] = rounded_up(most(e.sum_high) * scale + kClearSlack);
    // The root's own rounding is covered by kClearSlack.
    deviation.low[at] = rounded_down(std::sqrt(std::max(least(e.spread_low), 0.0)) * scale - kClearSlack);
    deviation.high[at] = rounded_up(std::sqrt(std::max(most(e.spread_high), 0.0)) * scale + kClearSlack);
  }
}

Status CellIndex::find_places(const Raster<PanelFrame>& picture, const BlockedPixels& blocked, Millimetres border,
                              const std::stop_token& stop) {
  if (stop.stop_requested()) return cancelled();
  std::fill(places_.begin(), places_.end(), 0U);
  const double grow = picture.resolution.to_px(border).count();
  const double left = windows_.filled ? windows_.left - grow : windows_.middle_x();
  const double right = windows_.filled ? windows_.right + grow : left;
  const double top = windows_.filled ? windows_.top - grow : windows_.middle_y();
  const double bottom = windows_.filled ? windows_.bottom + grow : top;
  const double beyond = windows_.filled ? 0 : windows_.middle_doubt();
  const int width = lattice_.width(), height = lattice_.height();
  const auto stride = static_cast<std::size_t>(width) + 1;
  // Corners of the rectangles of places that each blocked pixel forbids; summed up below.
  std::vector<std::int32_t> change(stride * (static_cast<std::size_t>(height) + 1), 0);
  const double inscribed =
      picture.resolution.to_px(blocked.side).count() / 2 / (std::abs(lattice_.cos()) + std::abs(lattice_.sin())) -
      kClearSlack;
  for (const Point<PanelFrame>& centre : blocked.centres) {
    if (!windows_.filled) break;
    double column = 0, row = 0, x = 0, y = 0;
    picture.to_pixels(centre, column, row);
    lattice_.from_panel(column, row, x, y);
    const int x0 = std::clamp(static_cast<int>(std::floor(x - inscribed - right)) + 1, 0, width);
    const int x1 = std::clamp(static_cast<int>(std::ceil(x + inscribed - left)), 0, width);
    const int y0 = std::clamp(static_cast<int>(std::floor(y - inscribed - bottom)) + 1, 0, height);
    const int y1 = std::clamp(static_cast<int>(std::ceil(y + inscribed - top)), 0, height);
    if (x0 >= x1 || y0 >= y1) continue;
    const auto at = [&](int r, int c) { return static_cast<std::size_t>(r) * stride + static_cast<std::size_t>(c); };
    ++change[at(y0, x0)], --change[at(y0, x1)], --change[at(y1, x0)], ++change[at(y1, x1)];
  }
  std::vector<std::int32_t> above(stride, 0);
  for (int y = 0; y < height; ++y) {
    if (stop.stop_requested()) return cancelled();
    // The place's four corners must lie on the panel: an interval of x.
    // A tight window lies within the lattice even where its corners lie beyond the panel.
    if (!windows_.filled && y + windows_.height > height) break;
    RowStretch on_panel{0, static_cast<double>(windows_.filled ? width - 1 : width - windows_.width)};
    for (const double dx : {left, right}) {
      for (const double dy : {top, bottom}) {
        double column = 0, row = 0;
        lattice_.to_panel(dx, y + dy, column, row);
        on_panel.keep_on_panel(lattice_, column + beyond, row + beyond, picture.pixels.cols + 2 * beyond,
                               picture.pixels.rows + 2 * beyond, kClearSlack);
      }
    }
    const int first = static_cast<int>(std::ceil(on_panel.low - kClearSlack));
    const int last = on_panel.high < on_panel.low - 1 ? -1 : static_cast<int>(std::floor(on_panel.high + kClearSlack));
    std::int32_t covering = 0;
    const int cell_row = y / windows_.y.cell;
    const auto base = base_[static_cast<std::size_t>(cell_row)];
    for (int x = 0; x < width; ++x) {
      const std::size_t at = static_cast<std::size_t>(y) * stride + static_cast<std::size_t>(x);
      above[static_cast<std::size_t>(x)] += change[at];
      covering += above[static_cast<std::size_t>(x)];
      if (covering > 0 || x < first || x > last) continue;
      const int cell = x / windows_.x.cell;
      if (cell < begin_[static_cast<std::size_t>(cell_row)] || cell >= end_[static_cast<std::size_t>(cell_row)])
        continue;
      places_[static_cast<std::size_t>(base + cell)] |=
          1U << ((y % windows_.y.cell) * windows_.x.cell + x % windows_.x.cell);
    }
  }
  find_alive_cells();
  return Ok();
}

void CellIndex::find_alive_cells() {
  alive_begin_.clear(), alive_end_.clear();
  for (std::size_t row = 0; row < begin_.size(); ++row) {
    int begin = begin_[row], end = end_[row];
    const auto place = [&](int cell) { return places_[static_cast<std::size_t>(base_[row] + cell)]; };
    while (begin < end && place(begin) == 0) ++begin;
    while (begin < end && place(end - 1) == 0) --end;
    alive_begin_.push_back(begin), alive_end_.push_back(end);
  }
}

void CellIndex::remove(const std::vector<Ring<PanelFrame>>& taken, const Raster<PanelFrame>& picture,
                       Millimetres kerf) {
  // As PlaceBits::remove().
  if (!windows_.filled) return;
  const double grow = picture.resolution.to_px(kerf).count() - kClearSlack;
  const double left = windows_.left - grow, right = windows_.right + grow;
  const double top = windows_.top - grow, bottom = windows_.bottom + grow;
  const BandedPolygon shape = on_lattice(taken, picture, lattice_);
  const int first = std::max(0, static_cast<int>(std::ceil(shape.top() - bottom)));
  const int last = std::min(lattice_.height() - 1, static_cast<int>(std::floor(shape.bottom() - top)));
  for (int y = first; y <= last; ++y) {
    const auto cell_row = static_cast<std::size_t>(y / windows_.y.cell);
    for (const auto& [low, high] : shape.within(y + top, y + bottom)) {
      const int x0 = std::max(0, static_cast<int>(std::floor(low - right)) + 1);
      const int x1 = std::min(lattice_.width(), static_cast<int>(std::ceil(high - left)));
      for (int x = x0; x < x1; ++x) {
        const int cell = x / windows_.x.cell;
        if (cell < begin_[cell_row] || cell >= end_[cell_row]) continue;
        places_[static_cast<std::size_t>(base_[cell_row] + cell)] &=
            ~(1U << ((y % windows_.y.cell) * windows_.x.cell + x % windows_.x.cell));
      }
    }
  }
}

std::size_t CellIndex::bytes() const {
  std::size_t sum = places_.size() * sizeof(std::uint32_t);
  for (const Intervals& map : maps_) sum += (map.low.size() + map.high.size()) * sizeof(std::uint16_t);
  return sum;
}

}  // namespace veneer::planner
