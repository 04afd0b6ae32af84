#include "planner/matching/place_bits.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "planner/cancelled.h"

namespace veneer::planner {
namespace {

// Bits [first, last) of a row.
template <class Change>
void for_bits(std::uint64_t* row, int first, int last, Change change) {
  while (first < last) {
    const int bit = first % 64, count = std::min(64 - bit, last - first);
    const std::uint64_t ones = (count == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << count) - 1) << bit;
    change(row[first / 64], ones);
    first += count;
  }
}

// ORs into every bit the `length` - 1 bits below it, doubling the reach step by step.
void spread_up(std::uint64_t* row, std::size_t words, int length) {
  for (int reached = 1; reached < length;) {
    const int step = std::min(reached, length - reached);
    const auto whole = static_cast<std::size_t>(step) / 64;
    const unsigned rest = static_cast<unsigned>(step) % 64;
    for (std::size_t i = words; i-- > whole;) {
      std::uint64_t moved = row[i - whole] << rest;
      if (rest > 0 && i > whole) moved |= row[i - whole - 1] >> (64 - rest);
      row[i] |= moved;
    }
    reached += step;
  }
}

// The same from row to row.
Status spread_down(std::vector<std::uint64_t>& bits, std::size_t words, std::size_t rows, int length,
                   const std::stop_token& stop) {
  for (int reached = 1; reached < length;) {
    const int step = std::min(reached, length - reached);
    for (std::size_t row = rows; row-- > static_cast<std::size_t>(step);) {
      if (stop.stop_requested()) return cancelled();
      std::uint64_t* to = bits.data() + row * words;
      const std::uint64_t* from = to - static_cast<std::size_t>(step) * words;
      for (std::size_t i = 0; i < words; ++i) to[i] |= from[i];
    }
    reached += step;
  }
  return Ok();
}

}  // namespace

Result<PlaceBits> PlaceBits::make(const Lattice& lattice, const WindowClass& windows, const Raster<PanelFrame>& picture,
                                  const BlockedPixels& blocked, Millimetres border, const std::stop_token& stop) {
  PlaceBits bits(lattice, windows);
  const Reach covered = bits.reach(picture.resolution.to_px(border).count());
  bits.mark_places_on_panel(covered, picture.pixels.size());
  if (!windows.filled) return bits;
  if (const Status done = bits.clear_blocked(covered, picture, blocked, stop); !done.ok()) return done.error();
  return bits;
}

void PlaceBits::mark_places_on_panel(const Reach& covered, const cv::Size& panel) {
  std::vector<std::pair<int, int>> on_panel;
  const double beyond = windows_.filled ? 0 : windows_.middle_doubt();
  base_.push_back(0);
  for (int y = 0; y < height(); ++y) {
    // The window's four corners must lie on the panel: an interval of x.
    RowStretch inside{0, static_cast<double>(width() - 1)};
    for (const double dx : {covered.left, covered.right}) {
      for (const double dy : {covered.top, covered.bottom}) {
        double column = 0, down = 0;
        lattice_.to_panel(dx, y + dy, column, down);
        inside.keep_on_panel(lattice_, column + beyond, down + beyond, panel.width + 2 * beyond,
                             panel.height + 2 * beyond, kClearSlack);
      }
    }
    int first = static_cast<int>(std::ceil(inside.low - kClearSlack));
    int last = static_cast<int>(std::floor(inside.high + kClearSlack)) + 1;
    if (inside.high < inside.low - 1 || last <= first) first = last = 0;
    on_panel.emplace_back(first, last);
    begin_.push_back(first / 64 * 64);
    base_.push_back(base_.back() + static_cast<std::size_t>((last + 63) / 64 - first / 64));
  }
  words_.assign(base_.back(), 0);
  for (int y = 0; y < height(); ++y) {
    const auto [first, last] = on_panel[static_cast<std::size_t>(y)];
    const int begin = begin_[static_cast<std::size_t>(y)];
    for_bits(row(y), first - begin, last - begin, [](std::uint64_t& word, std::uint64_t ones) { word |= ones; });
  }
}

Status PlaceBits::clear_blocked(const Reach& covered, const Raster<PanelFrame>& picture, const BlockedPixels& blocked,
                                const std::stop_token& stop) {
  // A blocked pixel forbids a rectangle of places whose sides vary by one with its position. Its corners are marked and
  // spread over the shorter sides, all pixels at once.
  const double inscribed =
      picture.resolution.to_px(blocked.side).count() / 2 / (std::abs(lattice_.cos()) + std::abs(lattice_.sin())) -
      kClearSlack;
  const int across = std::max(1, static_cast<int>(std::floor(covered.right - covered.left + 2 * inscribed)));
  const int down = std::max(1, static_cast<int>(std::floor(covered.bottom - covered.top + 2 * inscribed)));
  const int pad_columns = (across + 63) / 64 * 64, pad_rows = down;
  const std::size_t words = static_cast<std::size_t>(width() + 63 + pad_columns) / 64;
  const auto rows = static_cast<std::size_t>(height() + pad_rows);
  std::vector<std::uint64_t> marks(words * rows, 0);
  for (const Point<PanelFrame>& centre : blocked.centres) {
    if (stop.stop_requested()) return cancelled();
    double column = 0, row = 0, x = 0, y = 0;
    picture.to_pixels(centre, column, row);
    lattice_.from_panel(column, row, x, y);
    const int x0 = static_cast<int>(std::floor(x - inscribed - covered.right)) + 1;
    const int x1 = static_cast<int>(std::ceil(x + inscribed - covered.left));
    const int y0 = static_cast<int>(std::floor(y - inscribed - covered.bottom)) + 1;
    const int y1 = static_cast<int>(std::ceil(y + inscribed - covered.top));
    if (x0 >= x1 || y0 >= y1) continue;
    for (const int at_y : {y0, y1 - down}) {
      const int r = at_y + pad_rows;
      if (r < 0 || r >= static_cast<int>(rows)) continue;
      for (const int at_x : {x0, x1 - across}) {
        const int c = at_x + pad_columns;
        if (c < 0 || c >= static_cast<int>(words * 64)) continue;
        marks[static_cast<std::size_t>(r) * words + static_cast<std::size_t>(c) / 64] |=
            std::uint64_t{1} << (static_cast<unsigned>(c) % 64);
      }
    }
  }
  for (std::size_t r = 0; r < rows; ++r) {
    if (stop.stop_requested()) return cancelled();
    spread_up(marks.data() + r * words, words, across);
  }
  if (Status spread = spread_down(marks, words, rows, down, stop); !spread.ok()) return spread;
  for (int y = 0; y < height(); ++y) {
    if (stop.stop_requested()) return cancelled();
    const int first = pad_columns + begin_[static_cast<std::size_t>(y)];
    const std::uint64_t* forbidden =
        marks.data() + static_cast<std::size_t>(y + pad_rows) * words + static_cast<std::size_t>(first) / 64;
    std::uint64_t* places = row(y);
    for (int i = 0; i < stored(y) / 64; ++i) places[i] &= ~forbidden[i];
  }
  return Ok();
}

bool PlaceBits::any(int x0, int x1, int y0, int y1) const {
  for (int y = std::max(y0, 0); y < std::min(y1, height()); ++y) {
    const int begin = begin_[static_cast<std::size_t>(y)], end = std::min(x1 - begin, stored(y));
    const std::uint64_t* words = row(y);
    for (int x = std::max(x0 - begin, 0); x < end;) {
      const int bit = x % 64, count = std::min(64 - bit, end - x);
      const std::uint64_t ones = count == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << count) - 1;
      if ((words[x / 64] >> bit & ones) != 0) return true;
      x += count;
    }
  }
  return false;
}

cv::Rect PlaceBits::remove(const std::vector<Ring<PanelFrame>>& taken, const Raster<PanelFrame>& picture,
                           Millimetres kerf) {
  if (!windows_.filled) return {};
  // Places whose rectangle overlaps the taken outline form the Minkowski sum of the outline and the mirrored rectangle;
  // its part in one row of places is what the outline's part within reach of the rectangle covers, widened.
  const Reach covered = reach(picture.resolution.to_px(kerf).count() - kClearSlack);
  const BandedPolygon shape = on_lattice(taken, picture, lattice_);
  const int first = std::clamp(static_cast<int>(std::ceil(shape.top() - covered.bottom)), 0, height());
  const int end = std::clamp(static_cast<int>(std::floor(shape.bottom() - covered.top)) + 1, first, height());
  int left = width(), right = 0;
  for (int y = first; y < end; ++y) {
    const int begin = begin_[static_cast<std::size_t>(y)];
    for (const auto& [low, high] : shape.within(y + covered.top, y + covered.bottom)) {
      const int x0 = std::clamp(static_cast<int>(std::floor(low - covered.right)) + 1, 0, width());
      const int x1 = std::clamp(static_cast<int>(std::ceil(high - covered.left)), 0, width());
      for_bits(row(y), std::max(x0 - begin, 0), std::min(x1 - begin, stored(y)),
               [](std::uint64_t& word, std::uint64_t ones) { word &= ~ones; });
      if (x0 < x1) left = std::min(left, x0), right = std::max(right, x1);
    }
  }
  return {cv::Point(std::min(left, right), first), cv::Point(right, end)};
}

}  // namespace veneer::planner
