#include "drivers/sim/proof/placement_proof.h"

#include <algorithm>

namespace veneer::proof {
namespace {

constexpr double kGrid = 10;  // mm

template <class Visit>
void over_grid(const sim::Sheet& sheet, Visit visit) {
  const auto middle = [](int cell) { return (cell + 0.5) * kGrid; };
  for (int row = 0; middle(row) < sheet.height_mm; ++row)
    for (int column = 0; middle(column) < sheet.width_mm; ++column) visit(Vec2{middle(column), middle(row)});
}

// What the lattice was claimed of; nothing when the twin took no such scan of the sheet.
const sim::ScanTruth* scan_of(const ClaimedLattice& lattice, const Tie& tie, const Truth& truth) {
  const auto capture = truth.captures.find(lattice.capture);
  return capture == truth.captures.end() || capture->second.sheet != tie.sheet->name ? nullptr : &capture->second;
}

}  // namespace

std::size_t unattributed_scans(const Tie& tie, const Truth& truth) {
  return static_cast<std::size_t>(std::ranges::count_if(
      tie.panel->registration, [&](const ClaimedLattice& lattice) { return scan_of(lattice, tie, truth) == nullptr; }));
}

std::optional<Residual> prove_registration(const Tie& tie, const Truth& truth) {
  ResidualSum sum;
  for (const ClaimedLattice& lattice : tie.panel->registration) {
    const sim::ScanTruth* scan = scan_of(lattice, tie, truth);
    if (scan == nullptr) continue;
    over_grid(*tie.sheet, [&](Vec2 point) {
      if (const auto claimed = lattice.panel_at(scan->scan_pixel(point)))
        sum.add(sim::length(*claimed - tie.panel_from_sheet(point)));
    });
  }
  if (sum.count() == 0) return std::nullopt;
  return sum.result();
}

std::optional<Residual> prove_pose(const ClaimedPose& pose, const Tie& tie, const Truth& truth) {
  const auto loads = truth.loads.find(tie.sheet->name);
  if (loads == truth.loads.end()) return std::nullopt;
  std::optional<Residual> best;
  for (std::size_t k = static_cast<std::size_t>(std::max(0, pose.sheet_load)); k < loads->second.size(); ++k)
    for (const sim::SheetPose& lies : loads->second[k]) {
      ResidualSum sum;
      over_grid(*tie.sheet,
                [&](Vec2 point) { sum.add(sim::length(pose.bed(tie.panel_from_sheet(point)) - lies.place(point))); });
      if (!best || sum.result().rms < best->rms) best = sum.result();
    }
  return best;
}

}  // namespace veneer::proof
