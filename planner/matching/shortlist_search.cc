#include "planner/matching/shortlist_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

#include "planner/cancelled.h"

namespace veneer::planner {
namespace {

// Cells are listed by their estimate, looked at on a sample of pixels, and the best again on more pixels; then all
// places of the last are looked at on all pixels. Lists get longer when a look costs less.
constexpr double kListed = 1536, kFewestListed = 64;
constexpr int kFewestSamples = 16;  // pixels of the first look, along the shorter side of a window
constexpr int kMoreSamples = 32;    // and of the second, at most
constexpr int kLargestBlock = 5;    // places along a side; larger cells are cut into smaller blocks after a first look
// The same where windows are not filled: chosen, since the windows of a usual mosaic then need no second list.
constexpr int kLargestOddBlock = 8;
constexpr auto kNoLimit = std::numeric_limits<std::uint64_t>::max();
constexpr int kMostAlike = 12;         // cells of one neighbourhood in a list of several places
constexpr int kMoreAlike = 3;          // where windows are not filled, so many times as many
constexpr int kCoarserEstimates = 2;   // and so many times as many cells are listed, since shares of blocks say less
constexpr std::size_t kLongest = 256;  // times as long as usual a list may be to find a further place
constexpr std::size_t kOverlong = 2;   // times as long as wanted a list may grow before it is cut
constexpr int kSampledRow = 8;         // one in so many rows of cells is scored first

std::vector<std::int32_t> block_taps(const MatchPatch& patch, const CellGrid& grid, bool filled,
                                     double entries_per_unit) {
  const int columns = grid.columns / 2, rows = grid.rows / 2, channels = patch.features->channels();
  const BoxMeans boxes = box_means(patch, columns, rows, 2 * grid.width, 2 * grid.height);
  const auto weight = [&](int block, int channel) {
    const auto at = static_cast<std::size_t>(block);
    if (channel < channels)
      return -boxes.means[at * static_cast<std::size_t>(channels) + static_cast<std::size_t>(channel)] *
             entries_per_unit;
    return channel == channels && !filled ? boxes.coverage[at] * CoarseMap::kEnergyUnit : 0.0;
  };
  const auto bits = [](double value) { return static_cast<std::uint16_t>(std::lround(value)); };
  std::vector<std::int32_t> taps;
  for (int channel = 0; channel < channels + (filled ? 0 : 1); channel += 2)
    for (int block = 0; block < rows * columns; ++block)
      taps.push_back(static_cast<std::int32_t>(bits(weight(block, channel)) |
                                               static_cast<std::uint32_t>(bits(weight(block, channel + 1))) << 16));
  return taps;
}

// Pixel strides of the looks at a window: few pixels, more, all.
std::array<int, 3> strides(int shorter_side) {
  return {std::max(1, shorter_side / kFewestSamples), (shorter_side + kMoreSamples - 1) / kMoreSamples, 1};
}

template <class T>
void keep_smallest(std::vector<T>& list, std::size_t wanted) {
  if (list.size() <= wanted) return;
  std::nth_element(list.begin(), list.begin() + static_cast<std::ptrdiff_t>(wanted) - 1, list.end());
  list.resize(wanted);
}

}  // namespace

ShortlistSearch::ShortlistSearch(const ShortlistMatcher& matcher, const MatchPatch& patch, const std::stop_token& stop)
    : matcher_(matcher),
      patch_(patch),
      stop_(stop),
      class_number_(matcher.class_of(patch)),
      class_(matcher.classes_[class_number_]),
      grid_(class_.windows.filled ? class_.grid : cells_over(class_.grid, patch.pixels.width, patch.pixels.height)),
      cover_(matcher.cover(patch)),
      cut_(std::max(grid_.width, grid_.height) > (class_.windows.filled ? kLargestBlock : kLargestOddBlock)),
      taps_(block_taps(patch, grid_, class_.windows.filled, matcher.entries_per_unit_)) {
  for (const int stride : strides(std::min(patch.pixels.width, patch.pixels.height)))
    windows_.emplace_back(patch, matcher.entries_per_unit_, stride);
}

Result<std::vector<LatticeCandidate>> ShortlistSearch::run(std::size_t count) {
  if (count == 0) return std::vector<LatticeCandidate>();
  const double samples = static_cast<double>(windows_.front().rows()) * windows_.front().columns();
  const double cheapness = std::max(1.0, kFewestSamples * kFewestSamples / samples);
  // Large cells make coarser estimates, too.
  const int coarseness = (class_.windows.filled ? 1 : kCoarserEstimates) * (cut_ ? 2 : 1);
  const auto usual =
      static_cast<std::size_t>(std::max(kFewestListed, kListed * cheapness * coarseness * matcher_.thoroughness_));
  // Longer lists when too few of the listed places are free after all.
  for (std::size_t times = count == 1 ? 1 : 4;; times *= 8) {
    std::vector<LatticeCandidate> found = listed(usual * times, count, count > 1);
    const bool longest = times >= kLongest;
    // Where wood is scarce, the places left may all be beside others: once more, with every cell.
    if (longest && count > 1 && found.size() < count && !complete_) {
      std::vector<LatticeCandidate> all = listed(usual * times, count, false);
      if (all.size() > found.size()) found = std::move(all);
    }
    if (stop_.stop_requested()) return cancelled();
    if (complete_ || found.size() == count || (longest && !found.empty())) return found;
  }
}

std::vector<LatticeCandidate> ShortlistSearch::listed(std::size_t cells, std::size_t count, bool thin) {
  complete_ = true;
  return cheapest(free_places(shortlist(cells, thin)), count);
}

std::vector<ShortlistSearch::Block> ShortlistSearch::shortlist(std::size_t listed, bool thin) {
  std::vector<Scored> cells = score_cells(listed);
  if (thin) {
    std::sort(cells.begin(), cells.end());
    cells = thinned(cells, listed / 2);
  }
  std::vector<Block> blocks;
  blocks.reserve(cells.size());
  for (const Scored& cell : cells) blocks.push_back(block_of(cell));
  const TargetWindow &few = windows_.front(), &more = windows_[1];
  if (!cut_) {
    look_at(blocks, few, listed / 6);
    // Small windows are looked at whole at once.
    if (few.rows() != more.rows()) look_at(blocks, more, listed / 24);
    return blocks;
  }
  // The middle of a large cell says little of its other places, so many are cut.
  look_at(blocks, few, listed / 8);
  blocks = cut(blocks);
  look_at(blocks, few, listed / 8);
  look_at(blocks, more, listed / 64);
  return blocks;
}

std::vector<ShortlistSearch::Scored> ShortlistSearch::score_cells(std::size_t wanted) {
  const int rows = grid_.rows / 2, columns = grid_.columns / 2;
  const kernels::BlockTaps taps{taps_.data(), static_cast<int>(taps_.size()) / (rows * columns), rows, columns};
  const TapSums sums = tap_sums(taps, patch_.features->channels());
  blocks_.resize(static_cast<std::size_t>(taps.pairs * rows));
  std::vector<Scored> found;
  limit_ = std::numeric_limits<std::int32_t>::max();
  for (std::uint32_t lattice = 0; lattice < matcher_.lattices(); ++lattice) {
    const CoarseMap& map = indexed(lattice).map;
    map.find_score_bounds(sums, bounds_);
    // A sample of the rows first, so that the limit is low when the others come.
    for (const bool sampled : {true, false}) {
      for (int row = 0; row + grid_.rows <= map.rows() && !stop_.stop_requested(); ++row)
        if ((row % kSampledRow == 0) == sampled) score_row(lattice, row, taps, sums, wanted, found);
      if (found.size() > wanted) keep_best(wanted, found);
    }
  }
  if (found.size() >= wanted) complete_ = false;
  return found;
}

void ShortlistSearch::score_row(std::uint32_t lattice, int row, const kernels::BlockTaps& taps, const TapSums& sums,
                                std::size_t wanted, std::vector<Scored>& found) {
  const CoarseMap& map = indexed(lattice).map;
  map.groups_within(row, bounds_, sums.most(limit_), groups_);
  if (groups_.empty()) return;
  const std::uint16_t* alive = map.alive(row);
  for (int pair = 0; pair < taps.pairs; ++pair)
    for (int k = 0; k < taps.rows; ++k)
      blocks_[static_cast<std::size_t>(pair * taps.rows + k)] = map.blocks(pair, row + 2 * k, map.begin(row));
  scores_.resize(groups_.size() * kernels::kGroup);
  below_.resize(groups_.size());
  kernels::score_groups(taps, {blocks_.data(), map.half_energy(row)}, groups_.data(), groups_.size(), limit_,
                        scores_.data(), below_.data());
  for (std::size_t i = 0; i < groups_.size(); ++i) {
    for (unsigned hits = below_[i] & alive[groups_[i] / kernels::kGroup]; hits != 0; hits &= hits - 1) {
      const int k = __builtin_ctz(hits);
      const Scored cell{scores_[i * kernels::kGroup + static_cast<std::size_t>(k)], lattice, row,
                        map.begin(row) + static_cast<int>(groups_[i]) + k};
      if (cover_.empty() || !ruled_out(block_of(cell))) found.push_back(cell);
    }
  }
  if (found.size() > kOverlong * wanted) keep_best(wanted, found);
}

void ShortlistSearch::keep_best(std::size_t wanted, std::vector<Scored>& found) {
  keep_smallest(found, wanted);
  // Equal scores may still be wanted for their place.
  const std::int32_t worst = std::max_element(found.begin(), found.end())->score;
  limit_ = worst == std::numeric_limits<std::int32_t>::max() ? worst : worst + 1;
}

std::vector<ShortlistSearch::Scored> ShortlistSearch::thinned(const std::vector<Scored>& cells, std::size_t wanted) {
  std::vector<Scored> out;
  // By the wood under their centres, in squares as wide as alike places are apart: those alike lie in adjacent squares.
  std::unordered_map<std::uint64_t, std::vector<LatticeCandidate>> kept;
  const double half_width = patch_.pixels.width / 2.0, half_height = patch_.pixels.height / 2.0;
  const double side = std::min(half_width, half_height);
  for (const Scored& cell : cells) {
    if (out.size() == wanted || stop_.stop_requested()) break;
    const Block block = block_of(cell);
    const LatticeCandidate at = candidate(block.lattice, block.middle_y(), block.middle_x());
    double column = 0, row = 0;
    matcher_.lattice_at(block.lattice).to_panel(at.x + half_width, at.y + half_height, column, row);
    const auto square = [&](int right, int down) {
      // Offset, since the centre of a block may lie a little outside the panel.
      const auto index = [side](double along, int step) {
        return static_cast<std::uint64_t>(std::floor(along / side) + step + 4096) & 0xffffffU;
      };
      return static_cast<std::uint64_t>(at.panel) << 48 | index(row, down) << 24 | index(column, right);
    };
    int like = 0;
    for (int down = -1; down <= 1; ++down) {
      for (int right = -1; right <= 1; ++right) {
        const auto found = kept.find(square(right, down));
        if (found == kept.end()) continue;
        for (const LatticeCandidate& other : found->second) like += matcher_.alike(patch_, at, other) ? 1 : 0;
      }
    }
    if (like >= kMostAlike * (class_.windows.filled ? 1 : kMoreAlike)) continue;
    kept[square(0, 0)].push_back(at);
    out.push_back(cell);
  }
  if (out.size() < cells.size()) complete_ = false;
  return out;
}

ShortlistSearch::Block ShortlistSearch::block_of(const Scored& cell) const {
  const CellGrid& grid = grid_;
  return {0,
          cell.lattice,
          CellGrid::first_place(cell.row, grid.height),
          CellGrid::first_place(cell.row + 1, grid.height),
          CellGrid::first_place(cell.cell, grid.width),
          CellGrid::first_place(cell.cell + 1, grid.width)};
}

bool ShortlistSearch::ruled_out(const Block& block) const {
  const double across = (block.x1 - block.x0 - 1) / 2.0, down = (block.y1 - block.y0 - 1) / 2.0;
  return cover_[block.lattice].rules_out(block.x0 + across, block.y0 + down, std::sqrt(across * across + down * down));
}

void ShortlistSearch::look_at(std::vector<Block>& blocks, const TargetWindow& window, std::size_t wanted) {
  sort_by_wood(blocks);
  samples_.resize(window.sample_entries());
  for (Block& block : blocks) {
    if (stop_.stop_requested()) return;
    sample(entries(block.lattice), matcher_.lattice_at(block.lattice), window.at(block.middle_x(), block.middle_y()),
           window.row_length(), samples_.data(), window.parts().data());
    block.distance = kernels::window_ssd(window.pixels(), samples_.data(), window.row_base(), 0, kNoLimit);
  }
  if (blocks.size() > wanted) complete_ = false;
  keep_smallest(blocks, std::max<std::size_t>(wanted, 1));
}

void ShortlistSearch::sort_by_wood(std::vector<Block>& blocks) const {
  constexpr double kTile = 64;  // pixels
  const double half_width = patch_.pixels.width / 2.0, half_height = patch_.pixels.height / 2.0;
  std::vector<std::pair<std::uint64_t, Block>> keyed;
  keyed.reserve(blocks.size());
  for (const Block& block : blocks) {
    double column = 0, row = 0;
    matcher_.lattice_at(block.lattice)
        .to_panel(block.middle_x() + half_width, block.middle_y() + half_height, column, row);
    const auto tile = [&](double at) { return static_cast<std::uint64_t>(std::max(at, 0.0) / kTile) & 0xffffU; };
    const auto panel = static_cast<std::uint64_t>(matcher_.panel_of(block.lattice));
    keyed.emplace_back(panel << 32 | tile(row) << 16 | tile(column), block);
  }
  std::sort(keyed.begin(), keyed.end());
  for (std::size_t i = 0; i < blocks.size(); ++i) blocks[i] = keyed[i].second;
}

std::vector<ShortlistSearch::Block> ShortlistSearch::cut(const std::vector<Block>& blocks) const {
  std::vector<Block> out;
  for (const Block& block : blocks) {
    const PlaceBits& places = indexed(block.lattice).places;
    const int columns = (block.x1 - block.x0 + kLargestBlock - 1) / kLargestBlock;
    const int rows = (block.y1 - block.y0 + kLargestBlock - 1) / kLargestBlock;
    const auto x = [&](int k) { return block.x0 + (block.x1 - block.x0) * k / columns; };
    const auto y = [&](int k) { return block.y0 + (block.y1 - block.y0) * k / rows; };
    for (int r = 0; r < rows; ++r) {
      for (int c = 0; c < columns; ++c) {
        const Block part{0, block.lattice, y(r), y(r + 1), x(c), x(c + 1)};
        if (places.any(part.x0, part.x1, part.y0, part.y1) && (cover_.empty() || !ruled_out(part))) out.push_back(part);
      }
    }
  }
  return out;
}

std::vector<ShortlistSearch::FreePlace> ShortlistSearch::free_places(const std::vector<Block>& blocks) {
  const auto channels = static_cast<std::size_t>(patch_.features->channels());
  const TargetWindow& all = windows_.back();
  std::vector<FreePlace> out;
  for (const Block& block : blocks) {
    if (stop_.stop_requested()) break;
    const PlaceBits& places = indexed(block.lattice).places;
    // Places beyond the lattice are not free.
    const int x0 = std::max(block.x0, 0), x1 = std::min(block.x1, places.width());
    const int y0 = std::max(block.y0, 0), y1 = std::min(block.y1, places.height());
    if (!places.any(x0, x1, y0, y1)) continue;
    const std::size_t row_length = all.row_length() + static_cast<std::size_t>(x1 - x0) * channels;
    const int rows = all.rows() + y1 - y0 - 1;
    samples_.resize(row_length * static_cast<std::size_t>(rows) + 2 * kernels::kRowStep);
    // What the rows of the window want that come to lie on a row of samples.
    parts_.assign(static_cast<std::size_t>(rows), {all.columns(), 0});
    for (int r = 0; r < rows; ++r) {
      SampledPart& part = parts_[static_cast<std::size_t>(r)];
      for (int own = std::max(0, r - (y1 - y0 - 1)); own <= std::min(r, all.rows() - 1); ++own) {
        const SampledPart& wanted = all.parts()[static_cast<std::size_t>(own)];
        part = {std::min(part.first, wanted.first), std::max(part.last, wanted.last + x1 - x0 - 1)};
      }
    }
    sample(entries(block.lattice), matcher_.lattice_at(block.lattice),
           {static_cast<double>(x0), static_cast<double>(y0), 1, 1, all.columns() + x1 - x0 - 1, rows}, row_length,
           samples_.data(), parts_.data());
    std::vector<std::ptrdiff_t> base;
    base.reserve(static_cast<std::size_t>(rows));
    for (int r = 0; r < rows; ++r) base.push_back(static_cast<std::ptrdiff_t>(row_length) * r);
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) {
        if (!places.at(x, y) || (!cover_.empty() && cover_[block.lattice].rules_out(x, y, 0))) continue;
        const std::uint64_t distance =
            kernels::window_ssd(all.pixels(), samples_.data(), base.data() + (y - y0),
                                static_cast<std::ptrdiff_t>(static_cast<std::size_t>(x - x0) * channels), kNoLimit);
        out.push_back({distance, block.lattice, y, x});
      }
    }
  }
  std::sort(out.begin(), out.end());
  return out;
}

std::vector<LatticeCandidate> ShortlistSearch::cheapest(std::vector<FreePlace> places, std::size_t count) const {
  // Entries are rounded: places that come this close are compared by their exact cost.
  constexpr double kRounding = 1 + 5e-4;
  constexpr int kMostExact = 6;
  std::vector<LatticeCandidate> out;
  std::size_t next = 0;
  while (out.size() < count && next < places.size() && !stop_.stop_requested()) {
    std::optional<LatticeCandidate> best;
    double limit = 0;
    int looked_at = 0;
    for (std::size_t i = next; i < places.size() && looked_at < kMostExact; ++i) {
      const FreePlace& place = places[i];
      const auto distance = static_cast<double>(place.distance);
      if (best && distance > limit) break;
      LatticeCandidate it = candidate(place.lattice, place.y, place.x);
      const bool seen = std::any_of(out.begin(), out.end(),
                                    [&](const LatticeCandidate& other) { return matcher_.alike(patch_, it, other); });
      if (seen || !matcher_.admits(patch_, it)) {
        if (i == next) ++next;
        continue;
      }
      if (!best) limit = distance * kRounding;
      it.cost = matcher_.exact_cost(patch_, it);
      if (!best || it < *best) best = it;
      ++looked_at;
    }
    if (!best) break;
    out.push_back(*best);
  }
  return out;
}

}  // namespace veneer::planner
