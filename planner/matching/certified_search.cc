#include "planner/matching/certified_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "planner/cancelled.h"

namespace veneer::planner {
namespace {

constexpr int kPassRows = 8;      // the first pass looks at one row of cells in so many
constexpr int kLookAround = 512;  // chunks sampled for a first limit

std::uint64_t whole(double limit) { return static_cast<std::uint64_t>(std::min(limit, 1e16)) + 1; }

}  // namespace

CertifiedSearch::CertifiedSearch(const Matcher& matcher, std::span<const IndexedLattice> lattices, MatchQuery query,
                                 const MatchPatch& patch, std::vector<Cover> cover,
                                 std::span<const LatticeCandidate> excluded, const std::stop_token& stop,
                                 MatchCounts& counts)
    : matcher_(matcher),
      lattices_(lattices),
      query_(std::move(query)),
      patch_(patch),
      cover_(std::move(cover)),
      excluded_(excluded),
      stop_(stop),
      counts_(counts),
      taps_(query_.taps.size()) {
  const WindowClass& windows = cells_of(0).windows();
  const auto channels = static_cast<std::size_t>(lattices_[0].pixels->channels());
  const std::size_t reach = static_cast<std::size_t>(windows.x.cell - 1) * channels;
  sums_length_ = (query_.row_length + reach + kernels::kRowStep - 1) / kernels::kRowStep * kernels::kRowStep;
  const auto rows = static_cast<std::size_t>(windows.y.cell) * static_cast<std::size_t>(query_.sum_groups);
  sums_.resize(rows * sums_length_ + kernels::kRowStep);
  for (std::size_t i = 0; i < rows; ++i) sums_base_.push_back(static_cast<std::ptrdiff_t>(i * sums_length_));
  set_limit(kNoLimit);
}

Result<std::optional<LatticeCandidate>> CertifiedSearch::run() {
  look_around();
  for (const int pass : {0, 1}) {
    collect([&](int row) { return (row % kPassRows == 0) == (pass == 0); }, 0, 1);
    // The first pass takes the most promising cells first, for the sake of the limit; the second takes them as they lie
    // in memory.
    if (pass == 0) sort_found();
    evaluate_found();
  }
  decide();
  if (stop_.stop_requested()) return cancelled();
  return best_.cost == LatticeCandidate().cost ? std::nullopt : std::optional(best_);
}

// A first limit: the most promising cells of a sample spread over everything that is free.
void CertifiedSearch::look_around() {
  std::size_t chunks = 0;
  for (std::uint32_t l = 0; l < lattices_.size(); ++l) {
    const CellIndex& cells = cells_of(l);
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

// By rising bound, in kOrders steps: cheaper than a full order, and as good.
void CertifiedSearch::sort_found() {
  constexpr std::uint32_t kOrders = 1024;
  std::array<std::uint32_t, kOrders + 1> starts{};
  const auto order = [&](const Found& cell) { return cell.bound * kOrders / 65536U; };
  for (const Found& cell : found_) ++starts[order(cell) + 1];
  std::partial_sum(starts.begin(), starts.end(), starts.begin());
  sorted_.resize(found_.size());
  for (const Found& cell : found_) sorted_[starts[order(cell)]++] = cell;
  std::swap(found_, sorted_);
}

void CertifiedSearch::set_limit(double limit) {
  limit_ = limit;
  // As fine a unit as 16 bits allow, with room above the limit.
  for (shift_ = 10; shift_ > 0; --shift_)
    if (limit_ * CellIndex::kFineUnits * CellIndex::kFineUnits / query_.block_pixels * std::pow(4.0, shift_) <=
        50000.0 * 65536)
      break;
  bound_limit_ = limit_in_bounds(shift_);
  window_limit_ = whole(limit_);
  sums_limit_ = whole(query_.sums_limit(limit_));
}

std::uint16_t CertifiedSearch::limit_in_bounds(int shift) const {
  const double fine = limit_ * CellIndex::kFineUnits * CellIndex::kFineUnits / query_.block_pixels;
  return static_cast<std::uint16_t>(std::min(std::floor(std::ldexp(fine, 2 * shift - 16)), 65535.0));
}

// Every cell that may hold a place within the limit, of the wanted rows and of every stride-th chunk.
template <class RowWanted>
void CertifiedSearch::collect(RowWanted wanted, std::size_t skip, std::size_t stride) {
  for (std::uint32_t l = 0; l < lattices_.size(); ++l) {
    const CellIndex& cells = cells_of(l);
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

void CertifiedSearch::prepare_row(const CellIndex& cells, int row) {
  for (std::size_t t = 0; t < taps_.size(); ++t) {
    const MatchQuery::Tap& tap = query_.taps[t];
    taps_[t] = {cells.low(tap.part, tap.channel, tap.feature, row + tap.cell_y) + tap.cell_x,
                cells.high(tap.part, tap.channel, tap.feature, row + tap.cell_y) + tap.cell_x, tap.low, tap.high};
  }
}

void CertifiedSearch::collect_chunk(const CellIndex& cells, std::uint32_t lattice, int row, int first) {
  const std::uint32_t* places = cells.places(row);
  const int count = std::min(kernels::kCellsAtOnce, cells.end(row) - first);
  std::uint32_t alive = 0;
  for (int i = 0; i < count; ++i) alive |= static_cast<std::uint32_t>(places[first + i] != 0) << i;
  if (alive == 0) return;
  ++counts_.chunks;
  std::uint16_t bounds[kernels::kCellsAtOnce];
  std::uint32_t within = alive & kernels::cell_bounds(taps_.data(), taps_.size(), first, shift_, bound_limit_, bounds);
  for (; within != 0; within &= within - 1) {
    const int i = __builtin_ctz(within);
    found_.push_back({bounds[i], static_cast<std::uint16_t>(shift_), lattice, row, first + i});
  }
}

void CertifiedSearch::evaluate_found() {
  for (const Found& cell : found_) {
    if (cell.bound > limit_in_bounds(cell.shift)) continue;
    if (stop_.stop_requested()) break;
    evaluate(cell);
  }
  found_.clear();
}

void CertifiedSearch::evaluate(const Found& found) {
  const IndexedLattice& it = lattices_[found.lattice];
  const CellIndex& cells = cells_of(found.lattice);
  const int cell_x = cells.windows().x.cell, cell_y = cells.windows().y.cell;
  if (!cover_.empty()) {
    const double across = (cell_x - 1) / 2.0, down = (cell_y - 1) / 2.0;
    if (cover_[found.lattice].rules_out(found.cell * cell_x + across, found.row * cell_y + down,
                                        std::hypot(across, down)))
      return;
  }
  const int left = found.cell * cell_x, top = found.row * cell_y, channels = it.pixels->channels();
  // Places are known of the class's lowest window. A taller one ends on the panel where it is free, and elsewhere
  // beyond the rows that there are (RotatedPanel::kReach covers a cell).
  if (top + cell_y - 1 + patch_.pixels.height > it.pixels->rows()) return;
  ++counts_.cells;
  if (query_.sum_groups > 0)
    kernels::row_sums(it.pixels->data(), it.pixels->row_base() + top, static_cast<std::ptrdiff_t>(left) * channels,
                      query_.sum_height, query_.sum_groups, cell_y, sums_length_, sums_.data());
  for (std::uint32_t places = cells.places(found.row)[found.cell]; places != 0; places &= places - 1) {
    const int bit = __builtin_ctz(places), dx = bit % cell_x, dy = bit / cell_x;
    evaluate_place(it, left + dx, top + dy, dy, static_cast<std::ptrdiff_t>(dx) * channels);
  }
}

// `shift` and `column` say where the window lies in sums_.
void CertifiedSearch::evaluate_place(const IndexedLattice& it, int x, int y, int shift, std::ptrdiff_t column) {
  const RotatedPanel& panel = *it.pixels;
  const std::ptrdiff_t* row_base = panel.row_base() + y;
  const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(x) * panel.channels();
  ++counts_.sums;
  const std::uint64_t sums = kernels::window_ssd(
      query_.sums(), sums_.data(), sums_base_.data() + static_cast<std::ptrdiff_t>(shift) * query_.sum_groups, column,
      sums_limit_);
  if (sums > sums_limit_) return;
  if (query_.leftover().count > 0 &&
      query_.least_entries(sums) + static_cast<double>(kernels::window_ssd(query_.leftover(), panel.data(), row_base,
                                                                           first, window_limit_)) >
          static_cast<double>(window_limit_))
    return;
  ++counts_.windows;
  const std::uint64_t distance = kernels::window_ssd(query_.pixels(), panel.data(), row_base, first, window_limit_);
  if (distance > window_limit_) return;
  Near near{distance, {0, it.panel, it.rotation, y, x}, false};
  if (const double limit = query_.entries_limit_from(distance); limit < limit_) {
    if (!may_be_taken(near.candidate)) return;
    near.admitted = true;
    set_limit(limit);
  }
  near_.push_back(near);
}

bool CertifiedSearch::may_be_taken(const LatticeCandidate& candidate) const {
  return std::none_of(excluded_.begin(), excluded_.end(),
                      [&](const LatticeCandidate& other) { return matcher_.alike(patch_, candidate, other); }) &&
         matcher_.admits(patch_, candidate);
}

// Exact costs of what is left, the nearest first.
void CertifiedSearch::decide() {
  std::sort(near_.begin(), near_.end(), [](const Near& a, const Near& b) { return a.distance < b.distance; });
  for (Near& near : near_) {
    if (near.distance > window_limit_ || stop_.stop_requested()) break;
    if (!near.admitted && !may_be_taken(near.candidate)) continue;
    ++counts_.exact;
    near.candidate.cost = matcher_.exact_cost(patch_, near.candidate, best_.cost);
    if (!(near.candidate < best_)) continue;
    best_ = near.candidate;
    if (const double limit = query_.entries_limit(best_.cost); limit < limit_) set_limit(limit);
  }
}

}  // namespace veneer::planner
