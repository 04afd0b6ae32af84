#include "calib/strip_colours.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace veneer::calib {
namespace {

// Colours of the planes in steps: lightness, and the two opponent colours.
constexpr std::array<double, 3> kHueStep = {0.10, 0.055, 0.055}, kLowest = {-3.5, -1.2, -1.2};
constexpr std::array<int, 3> kColourBins = {60, 44, 44};
constexpr int kHueReach = 2;  // steps from an own colour within which a colour is still the wood's

int colour_bin_of(const BoardView& view, int r, int c) {
  int bin = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const int at = static_cast<int>((view.planes[k].at<float>(r, c) - kLowest[k]) / kHueStep[k]);
    bin = bin * kColourBins[k] + std::clamp(at, 0, kColourBins[k] - 1);
  }
  return bin;
}

// Sets every colour within kHueReach steps of one that is set.
void widen(std::vector<std::uint8_t>& own) {
  const std::array<int, 3> stride = {kColourBins[1] * kColourBins[2], kColourBins[2], 1};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::vector<std::uint8_t> before = own;
    for (int i = 0; i < static_cast<int>(own.size()); ++i) {
      if (before[static_cast<std::size_t>(i)] == 0) continue;
      const int at = i / stride[k] % kColourBins[k];
      for (int d = -kHueReach; d <= kHueReach; ++d)
        if (at + d >= 0 && at + d < kColourBins[k]) own[static_cast<std::size_t>(i + d * stride[k])] = 1;
    }
  }
}

}  // namespace

OwnColours::OwnColours(const BoardView& view, const cv::Mat& strip, const cv::Rect& box) {
  constexpr double kCell = 4;        // mm; a colour is counted by the cells of the strip that show it
  constexpr double kAllOver = 0.12;  // share of the cells that make a colour the wood's own
  constexpr double kAcross = 0.4;    // share of the strip's rows and columns of cells that show an own colour
  const auto cell = std::max(1, static_cast<int>(kCell * view.px_per_mm));
  const int columns = std::min(64, (box.width + cell - 1) / cell), rows = std::min(64, (box.height + cell - 1) / cell);
  struct Seen {
    std::uint64_t columns = 0, rows = 0;
    int cells = 0, last = -1, pixels = 0;
  };
  std::vector<Seen> seen(static_cast<std::size_t>(kColourBins[0]) * kColourBins[1] * kColourBins[2]);
  int count = 0;
  for (int top = box.y; top < box.br().y; top += cell)
    for (int left = box.x; left < box.br().x; left += cell) {
      int inside = 0;
      for (int r = top; r < std::min(top + cell, box.br().y); ++r)
        for (int c = left; c < std::min(left + cell, box.br().x); ++c) {
          if (strip.at<std::uint8_t>(r, c) == 0) continue;
          ++inside;
          Seen& colour = seen[static_cast<std::size_t>(colour_bin_of(view, r, c))];
          if (colour.last != count) colour.last = count, colour.pixels = 0;
          if (++colour.pixels != 2) continue;
          ++colour.cells;
          colour.columns |= std::uint64_t{1}
                            << ((left - box.x) / cell * columns / std::max(columns, (box.width + cell - 1) / cell));
          colour.rows |= std::uint64_t{1}
                         << ((top - box.y) / cell * rows / std::max(rows, (box.height + cell - 1) / cell));
        }
      if (inside > 0) ++count;
    }
  own_.resize(seen.size(), 0);
  for (std::size_t i = 0; i < seen.size(); ++i)
    own_[i] = seen[i].cells >= std::max(3.0, kAllOver * count) && std::popcount(seen[i].columns) >= kAcross * columns &&
                      std::popcount(seen[i].rows) >= kAcross * rows
                  ? 1
                  : 0;
  widen(own_);
}

bool OwnColours::has(const BoardView& view, int row, int column) const {
  return own_[static_cast<std::size_t>(colour_bin_of(view, row, column))] != 0;
}

PigmentLine::PigmentLine(const BoardView& view, const cv::Mat& strip, const cv::Rect& box, const OwnColours* own) {
  constexpr int kSampled = 3;  // px
  cv::Mat colours(0, 3, CV_32FC1);
  for (int r = box.y; r < box.br().y; r += kSampled)
    for (int c = box.x; c < box.br().x; c += kSampled)
      if (strip.at<std::uint8_t>(r, c) != 0 && (own == nullptr || own->has(view, r, c)))
        colours.push_back(cv::Mat(cv::Matx13f(view.planes[0].at<float>(r, c), view.planes[1].at<float>(r, c),
                                              view.planes[2].at<float>(r, c))));
  if (colours.rows < 100) return;
  const cv::PCA pca(colours, {}, cv::PCA::DATA_AS_ROW);
  for (int k = 0; k < 3; ++k) middle_[k] = pca.mean.at<float>(0, k), along_[k] = pca.eigenvectors.at<float>(0, k);
  along_spread_ = std::sqrt(pca.eigenvalues.at<float>(0));
  beside_spread_ = std::sqrt(pca.eigenvalues.at<float>(1) + pca.eigenvalues.at<float>(2));
}

bool PigmentLine::holds(const BoardView& view, int row, int column) const {
  constexpr double kFarAlong = 4, kFarBeside = 2.5;  // spreads, along the line and beside it
  cv::Vec3f off;
  for (int k = 0; k < 3; ++k) off[k] = view.planes[static_cast<std::size_t>(k)].at<float>(row, column) - middle_[k];
  const double at = off.dot(along_), beside = cv::norm(off - along_ * static_cast<float>(at));
  return std::abs(at) < kFarAlong * along_spread_ && beside < kFarBeside * beside_spread_;
}

}  // namespace veneer::calib
