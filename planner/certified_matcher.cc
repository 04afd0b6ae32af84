#include "planner/certified_matcher.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "planner/match_query.h"

namespace veneer::planner {
namespace {

// The number of rows a sum for which sums and leftover rows together are fewest.
int choose_sum_rows(int window_height) {
  int best = 1, fewest = window_height;
  for (int rows = 2; rows <= kernels::kTallestSum; ++rows) {
    const int left = window_height / rows + window_height % rows;
    if (left <= fewest) best = rows, fewest = left;
  }
  return best;
}

}  // namespace

CertifiedMatcher::CertifiedMatcher(std::vector<MatchPanel> all_panels, std::vector<Radians> turns,
                                   std::vector<WindowClass> classes, double entries_per_unit)
    : Matcher(std::move(all_panels), std::move(turns)),
      classes_(std::move(classes)),
      entries_per_unit_(entries_per_unit),
      sum_rows_(choose_sum_rows(classes_.front().height)) {
  for (std::size_t p = 0; p < panels().size(); ++p) {
    const MatchPanel& panel = panels()[p];
    auto& blocked = blocked_.emplace_back();
    for (const WindowClass& windows : classes_) {
      const double side = std::min(windows.right - windows.left, windows.bottom - windows.top);
      blocked.push_back(
          blocked_pixels(panel.wood.raster(), panel.features.resolution.to_mm(Pixels(std::max(side, 1.0)))));
    }
    for (int r = 0; r < rotations(); ++r) indexed_.push_back({static_cast<int>(p), r, nullptr, {}});
  }
}

void CertifiedMatcher::build_index(std::size_t task) {
  IndexedLattice& it = indexed_[task];
  const MatchPanel& panel = panels()[static_cast<std::size_t>(it.panel)];
  it.pixels = std::make_unique<RotatedPanel>(panel.features.pixels, lattice(it.panel, it.rotation), entries_per_unit_,
                                             sum_rows_);
  for (std::size_t k = 0; k < classes_.size(); ++k)
    it.cells.emplace_back(*it.pixels, classes_[k], panel.features, blocked_[static_cast<std::size_t>(it.panel)][k],
                          panel.wood.border());
}

void CertifiedMatcher::remove(int panel, const Ring<PanelFrame>& taken) {
  const MatchPanel& it = panels()[static_cast<std::size_t>(panel)];
  for (IndexedLattice& indexed : indexed_) {
    if (indexed.panel != panel) continue;
    for (CellIndex& cells : indexed.cells) cells.remove(taken, it.features, it.wood.kerf());
  }
}

std::size_t CertifiedMatcher::index_bytes() const {
  std::size_t sum = 0;
  for (const IndexedLattice& it : indexed_) {
    if (it.pixels) sum += it.pixels->bytes();
    for (const CellIndex& cells : it.cells) sum += cells.bytes();
  }
  return sum;
}

// One call of best().
class Search {
 public:
  Search(const CertifiedMatcher& matcher, const MatchPatch& patch, const std::stop_token& stop,
         std::span<const Candidate> excluded, MatchCounts& counts)
      : matcher_(matcher),
        patch_(patch),
        query_(patch, matcher.classes_[patch.window_class], matcher.entries_per_unit_, matcher.sum_rows_),
        axis_x_(matcher.classes_[patch.window_class].x),
        axis_y_(matcher.classes_[patch.window_class].y),
        stop_(stop),
        excluded_(excluded),
        counts_(counts),
        taps_(query_.taps.size()) {
    set_limit(std::numeric_limits<double>::infinity());
  }

  std::optional<Candidate> run() {
    look_around();
    for (const int pass : {0, 1}) {
      collect([&](int row) { return (row % kPassRows == 0) == (pass == 0); }, 0, 1);
      evaluate_found();
    }
    if (!any_place()) return std::nullopt;
    return best_;
  }

 private:
  static constexpr int kPassRows = 8;      // the first pass looks at one row of cells in so many
  static constexpr int kLookAround = 512;  // chunks sampled for a first limit

  struct Found {
    std::uint16_t bound;
    std::uint16_t scale_shift;
    std::uint32_t lattice;
    std::int32_t row, cell;
  };

  // A first limit: the most promising cells of a sample spread over everything that is free.
  void look_around() {
    std::size_t chunks = 0;
    for (const auto& it : matcher_.indexed_) {
      const CellIndex& cells = it.cells[patch_.window_class];
      for (int row = 0; row < cells.cell_rows(); ++row)
        chunks += static_cast<std::size_t>(cells.end(row) - cells.begin(row) + kernels::kCellsAtOnce - 1) /
                  kernels::kCellsAtOnce;
    }
    const std::size_t stride = std::max<std::size_t>(1, chunks / kLookAround);
    collect([](int) { return true; }, stride / 2, stride);
    sort_found();
    constexpr std::size_t kPromising = 24;
    for (std::size_t i = 0; i < found_.size() && (i < kPromising || !any_place()) && !stop_.stop_requested(); ++i)
      evaluate(found_[i]);
    found_.clear();
  }

  bool any_place() const { return best_.cost < std::numeric_limits<double>::infinity(); }

  // By rising bound, in kOrders steps: cheaper than a full order, and as good.
  void sort_found() {
    constexpr std::uint32_t kOrders = 1024;
    std::array<std::uint32_t, kOrders + 1> starts{};
    const auto order = [&](const Found& cell) { return cell.bound * kOrders / 65536U; };
    for (const Found& cell : found_) ++starts[order(cell) + 1];
    std::partial_sum(starts.begin(), starts.end(), starts.begin());
    sorted_.resize(found_.size());
    for (const Found& cell : found_) sorted_[starts[order(cell)]++] = cell;
    std::swap(found_, sorted_);
  }

  void set_limit(double cost) {
    limit_ = query_.entries_limit(cost);
    const double unit = CellIndex::kFineUnits * CellIndex::kFineUnits / query_.block_pixels;
    for (shift_ = 1; shift_ < 8; ++shift_)
      if (limit_ * unit / std::pow(4.0, shift_) <= 50000) break;
    bound_limit_ = limit_in_bounds(shift_);
    window_limit_ = static_cast<std::uint64_t>(std::min(limit_, 1e16));
    sums_limit_ = window_limit_ * static_cast<std::uint64_t>(query_.sum_height) +
                  static_cast<std::uint64_t>(query_.sum_height) - 1;
  }

  std::uint16_t limit_in_bounds(int shift) const {
    const double unit = CellIndex::kFineUnits * CellIndex::kFineUnits / query_.block_pixels;
    return static_cast<std::uint16_t>(std::min(std::floor(limit_ * unit / std::pow(4.0, shift)), 65535.0));
  }

  // Every cell that may hold a place within the limit, of the wanted rows and of every stride-th chunk.
  template <class RowWanted>
  void collect(RowWanted wanted, std::size_t skip, std::size_t stride) {
    for (std::uint32_t l = 0; l < matcher_.indexed_.size(); ++l) {
      const CellIndex& cells = matcher_.indexed_[l].cells[patch_.window_class];
      for (int row = 0; row < cells.cell_rows(); ++row) {
        if (!wanted(row) || cells.begin(row) >= cells.end(row)) continue;
        if (stop_.stop_requested()) return;
        bool ready = false;
        for (int cell = cells.begin(row); cell < cells.end(row); cell += kernels::kCellsAtOnce) {
          if (skip > 0) {
            --skip;
            continue;
          }
          skip = stride - 1;
          if (!ready) prepare_row(cells, row), ready = true;
          collect_chunk(cells, l, row, cell);
        }
      }
    }
  }

  void prepare_row(const CellIndex& cells, int row) {
    for (std::size_t t = 0; t < taps_.size(); ++t) {
      const MatchQuery::Tap& tap = query_.taps[t];
      taps_[t] = {cells.low(tap.part, tap.channel, tap.feature, row + tap.cell_y) + tap.cell_x,
                  cells.high(tap.part, tap.channel, tap.feature, row + tap.cell_y) + tap.cell_x, tap.low, tap.high};
    }
  }

  void collect_chunk(const CellIndex& cells, std::uint32_t lattice, int row, int first) {
    const std::uint32_t* places = cells.places(row);
    const int count = std::min(kernels::kCellsAtOnce, cells.end(row) - first);
    std::uint32_t any = 0;
    for (int i = 0; i < count; ++i) any |= places[first + i];
    if (any == 0) return;
    ++counts_.chunks;
    std::uint16_t bounds[kernels::kCellsAtOnce];
    const auto scale = static_cast<std::uint16_t>(65536U >> shift_);
    if (kernels::cell_bounds(taps_.data(), taps_.size(), first, scale, bound_limit_, bounds) > bound_limit_) return;
    for (int i = 0; i < count; ++i)
      if (bounds[i] <= bound_limit_ && places[first + i] != 0)
        found_.push_back({bounds[i], static_cast<std::uint16_t>(shift_), lattice, row, first + i});
  }

  void evaluate_found() {
    sort_found();
    for (const Found& cell : found_) {
      if (cell.bound > limit_in_bounds(cell.scale_shift)) continue;
      if (stop_.stop_requested()) break;
      evaluate(cell);
    }
    found_.clear();
  }

  void evaluate(const Found& found) {
    ++counts_.cells;
    const auto& it = matcher_.indexed_[found.lattice];
    std::uint32_t places = it.cells[patch_.window_class].places(found.row)[found.cell];
    while (places != 0) {
      const int bit = __builtin_ctz(places);
      places &= places - 1;
      const int y = found.row * axis_y_.cell + bit / axis_x_.cell, x = found.cell * axis_x_.cell + bit % axis_x_.cell;
      evaluate_place(it, x, y);
    }
  }

  void evaluate_place(const CertifiedMatcher::IndexedLattice& it, int x, int y) {
    const RotatedPanel& panel = *it.pixels;
    const std::ptrdiff_t* row_base = panel.row_base() + y;
    const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(x) * panel.channels();
    ++counts_.sums;
    const std::uint64_t sums = kernels::window_ssd(query_.sums(), panel.row_sums(), row_base, first, sums_limit_);
    if (sums > sums_limit_) return;
    const std::uint64_t at_least = sums / static_cast<std::uint64_t>(query_.sum_height);
    if (at_least + kernels::window_ssd(query_.leftover(), panel.data(), row_base, first, window_limit_) > window_limit_)
      return;
    ++counts_.windows;
    if (kernels::window_ssd(query_.pixels(), panel.data(), row_base, first, window_limit_) > window_limit_) return;
    Candidate candidate{0, it.panel, it.rotation, y, x};
    if (is_excluded(candidate) || !matcher_.admits(patch_, candidate)) return;
    ++counts_.exact;
    candidate.cost = matcher_.exact_cost(patch_, candidate, best_.cost);
    if (candidate < best_) {
      best_ = candidate;
      set_limit(best_.cost);
    }
  }

  bool is_excluded(const Candidate& candidate) const {
    return std::any_of(excluded_.begin(), excluded_.end(),
                       [&](const Candidate& other) { return matcher_.alike(patch_, candidate, other); });
  }

  const CertifiedMatcher& matcher_;
  const MatchPatch& patch_;
  MatchQuery query_;
  const BlockAxis &axis_x_, &axis_y_;
  const std::stop_token& stop_;
  std::span<const Candidate> excluded_;  // nothing alike is wanted
  MatchCounts& counts_;
  std::vector<kernels::TapRow> taps_;
  std::vector<Found> found_, sorted_;
  Candidate best_;
  double limit_ = 0;
  int shift_ = 8;
  std::uint16_t bound_limit_ = 65535;
  std::uint64_t window_limit_ = 0, sums_limit_ = 0;
};

std::optional<Candidate> CertifiedMatcher::best(const MatchPatch& patch, const std::stop_token& stop,
                                                std::span<const Candidate> found, MatchCounts* counts) const {
  MatchCounts ignored;
  return Search(*this, patch, stop, found, counts != nullptr ? *counts : ignored).run();
}

std::vector<Candidate> CertifiedMatcher::places(const MatchPatch& patch, std::size_t count,
                                                const std::stop_token& stop) const {
  std::vector<Candidate> found;
  while (found.size() < count && !stop.stop_requested()) {
    const auto next = best(patch, stop, found, nullptr);
    if (!next) break;
    found.push_back(*next);
  }
  return found;
}

}  // namespace veneer::planner
