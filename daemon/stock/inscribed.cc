#include "daemon/stock/inscribed.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace veneer::daemon {

std::optional<InscribedSquare> largest_square(const Raster<PanelFrame>& free) {
  // Of the square whose lower right pixel is this one: one more than the smallest of those that end beside it.
  std::vector<int> above(static_cast<std::size_t>(free.pixels.cols) + 1, 0), here = above;
  int side = 0, right = 0, lower = 0;
  for (int row = 0; row < free.pixels.rows; ++row) {
    const auto* const pixels = free.pixels.ptr<unsigned char>(row);
    for (int column = 0; column < free.pixels.cols; ++column) {
      const auto at = static_cast<std::size_t>(column) + 1;
      here[at] = pixels[column] == 0 ? 0 : 1 + std::min({above[at], above[at - 1], here[at - 1]});
      if (here[at] > side) side = here[at], right = column + 1, lower = row + 1;
    }
    std::swap(above, here);
  }
  if (side == 0) return std::nullopt;
  return InscribedSquare{free.from_pixels(right - side, lower), free.resolution.to_mm(Pixels(side))};
}

std::optional<InscribedCircle> largest_circle(const Raster<PanelFrame>& free) {
  // A lattice of half pixels: what is nearest to one of its points on a square pixel is one of them too, so that the
  // distance between points is the distance to the pixel.
  cv::Mat lattice(2 * free.pixels.rows + 1, 2 * free.pixels.cols + 1, CV_8UC1, cv::Scalar(255));
  for (int row = 0; row < free.pixels.rows; ++row) {
    const auto* const pixels = free.pixels.ptr<unsigned char>(row);
    auto* const middles = lattice.ptr<unsigned char>(2 * row + 1);
    for (int column = 0; column < free.pixels.cols; ++column)
      if (pixels[column] == 0) middles[2 * column + 1] = 0;
  }
  cv::erode(lattice, lattice, {});  // from the middle of such a pixel to its sides
  cv::rectangle(lattice, {0, 0, lattice.cols, lattice.rows}, cv::Scalar(0), 1);
  cv::Mat distance;
  cv::distanceTransform(lattice, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE, CV_32F);
  double most = 0;
  cv::Point at;
  cv::minMaxLoc(distance, nullptr, &most, nullptr, &at);
  if (most <= 0) return std::nullopt;
  return InscribedCircle{free.from_pixels(at.x / 2.0, at.y / 2.0), free.resolution.to_mm(Pixels(most / 2))};
}

Raster<PanelFrame> in_larger_pixels(const Raster<PanelFrame>& free, int factor) {
  if (factor <= 1) return free;
  // The raster's origin is its lower left corner: what is left over is added above and on the right.
  const int columns = (free.pixels.cols + factor - 1) / factor, rows = (free.pixels.rows + factor - 1) / factor;
  cv::Mat whole;
  cv::copyMakeBorder(free.pixels, whole, rows * factor - free.pixels.rows, 0, 0, columns * factor - free.pixels.cols,
                     cv::BORDER_CONSTANT, cv::Scalar(0));
  Raster<PanelFrame> out{cv::Mat(rows, columns, CV_8UC1), ScanResolution{free.resolution.px_per_mm / factor},
                         free.origin};
  const cv::Mat square = cv::getStructuringElement(cv::MORPH_RECT, {factor, factor});
  cv::erode(whole != 0, whole, square, {0, 0}, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      out.pixels.at<unsigned char>(row, column) = whole.at<unsigned char>(row * factor, column * factor);
  return out;
}

int whole_pixels(ScanResolution resolution, Millimetres side) {
  // A whole number of pixels stays one although millimetres were in between.
  return std::max(1, static_cast<int>(std::ceil(resolution.to_px(side).count() - 1e-6)));
}

namespace {

// The lower right pixels of squares of one size, as a block.
struct Block {
  int top, bottom, left, right;
};

// Blocks of all free squares of two pixels and more, by side, but for those that lie within a larger one.
class SquareBlocks {
 public:
  explicit SquareBlocks(const cv::Mat& free) : by_side_(static_cast<std::size_t>(std::min(free.rows, free.cols)) + 1) {
    // Of each pixel the side of the largest square that it ends; beyond the last column and row there is none.
    const auto columns = static_cast<std::size_t>(free.cols);
    std::vector<int> above(columns + 1, 0), here(columns + 1, 0);
    std::vector<Open> open(columns);
    for (int row = 0; row <= free.rows; ++row) {
      std::swap(above, here);
      const auto* const pixels = row < free.rows ? free.ptr<unsigned char>(row) : nullptr;
      for (std::size_t c = 0; c < columns; ++c) {
        const int beside = c == 0 ? 0 : std::min(above[c - 1], here[c - 1]);
        here[c] = pixels == nullptr || pixels[c] == 0 ? 0 : 1 + std::min(above[c], beside);
      }
      if (row > 0) add(row - 1, above, here, open);
    }
  }
  const std::vector<Block>& of(std::size_t side) const { return by_side_[side]; }
  std::size_t largest() const { return by_side_.size() - 1; }

 private:
  // The block that begins in a column, as the row above left it.
  struct Open {
    std::size_t side = 0, index = 0;
  };
  static bool larger_follows(const std::vector<int>& sides, const std::vector<int>& below, std::size_t c) {
    return std::max({sides[c + 1], below[c], below[c + 1]}) > sides[c];
  }
  void add(int row, const std::vector<int>& sides, const std::vector<int>& below, std::vector<Open>& open) {
    const std::size_t columns = open.size();
    for (std::size_t c = 0; c < columns;) {
      if (sides[c] < 2 || larger_follows(sides, below, c)) {
        ++c;
        continue;
      }
      const std::size_t first = c;
      while (++c < columns && sides[c] == sides[first] && !larger_follows(sides, below, c)) {
      }
      const auto side = static_cast<std::size_t>(sides[first]);
      const int left = static_cast<int>(first), right = static_cast<int>(c) - 1;
      auto& blocks = by_side_[side];
      if (open[first].side == side && blocks[open[first].index].bottom == row - 1 &&
          blocks[open[first].index].right == right) {
        blocks[open[first].index].bottom = row;
        continue;
      }
      open[first] = {side, blocks.size()};
      blocks.push_back({row, row, left, right});
    }
  }

  std::vector<std::vector<Block>> by_side_;
};

// Pixels as bits; all are set at first.
class Bits {
 public:
  explicit Bits(cv::Size size)
      : words_((static_cast<std::size_t>(size.width) + 63) / 64),
        bits_(words_ * static_cast<std::size_t>(size.height), ~std::uint64_t{0}) {}
  // Clears those from `left` to `right`; how many were set.
  int clear(int row, int left, int right) {
    std::uint64_t* const words = bits_.data() + words_ * static_cast<std::size_t>(row);
    const int first = left / 64, last = right / 64;
    int count = 0;
    for (int word = first; word <= last; ++word) {
      std::uint64_t mask = ~std::uint64_t{0};
      if (word == first) mask &= ~std::uint64_t{0} << static_cast<unsigned>(left % 64);
      if (word == last) mask &= ~std::uint64_t{0} >> static_cast<unsigned>(63 - right % 64);
      count += std::popcount(words[word] & mask);
      words[word] &= ~mask;
    }
    return count;
  }

 private:
  std::size_t words_;
  std::vector<std::uint64_t> bits_;
};

}  // namespace

std::vector<std::int64_t> covered_by_squares(const Raster<PanelFrame>& free) {
  std::vector<std::int64_t> out;
  if (free.pixels.empty()) return out;
  const SquareBlocks squares(free.pixels);
  Bits left(free.pixels.size());
  // The largest first: what they cover, smaller ones within them cover as well.
  std::int64_t covered = 0;
  for (std::size_t side = squares.largest(); side >= 2; --side) {
    const int before = static_cast<int>(side) - 1;
    for (const Block& block : squares.of(side))
      for (int row = block.top - before; row <= block.bottom; ++row)
        covered += left.clear(row, block.left - before, block.right);
    if (covered > 0) out.push_back(covered);
  }
  // Of squares of one pixel no list is needed.
  if (const int all = cv::countNonZero(free.pixels); all > 0) out.push_back(all);
  std::reverse(out.begin(), out.end());
  return out;
}

}  // namespace veneer::daemon
