#include "daemon/stock/found_differences.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "base/polygon_ops.h"

namespace veneer::daemon {
namespace {

Box<PanelFrame> bounds_of(const Region<PanelFrame>& region) {
  Box<PanelFrame> out;
  for (const auto& ring : region.rings())
    for (const auto& point : ring) out.add(point);
  return out;
}

bool touch(const Box<PanelFrame>& a, const Box<PanelFrame>& b) {
  return a.min.x <= b.max.x && b.min.x <= a.max.x && a.min.y <= b.max.y && b.min.y <= a.max.y;
}

}  // namespace

const char* in_words(calib::DifferenceKind kind) {
  return kind == calib::DifferenceKind::kGoneNotBooked ? "wood is gone that is not booked as cut"
                                                       : "booked as cut, and still in the panel";
}

Result<std::vector<FoundDifference>> with_pieces(Repositories& r, const PanelId& panel,
                                                 const std::vector<calib::Difference>& differences) {
  std::vector<FoundDifference> out;
  const auto live = r.ledger.live_allocations(panel);
  if (!live) return live.error();
  std::vector<Box<PanelFrame>> boxes;
  boxes.reserve(live->size());
  for (const auto& allocation : *live) boxes.push_back(bounds_of(allocation.area));
  for (const calib::Difference& difference : differences) {
    FoundDifference& found = out.emplace_back(FoundDifference{difference, {}});
    // Of rings that a worker may have let cross each other.
    const auto& shape = found.seen.shape = unite(difference.shape, {});
    const Box<PanelFrame> box = bounds_of(shape);
    for (std::size_t i = 0; i < live->size(); ++i) {
      const auto& allocation = (*live)[i];
      const bool cut = allocation.state == db::AllocationState::kCut || allocation.state == db::AllocationState::kScrap;
      const bool booked = difference.kind == calib::DifferenceKind::kBookedNotGone;
      if (allocation.piece.value == 0 || cut != booked || !touch(boxes[i], box)) continue;
      if (!overlaps(allocation.area, shape)) continue;
      const auto piece = r.jobs.find_piece(allocation.piece);
      if (!piece) return piece.error();
      found.pieces.push_back({allocation.job, piece->mark, allocation.state});
    }
  }
  return out;
}

std::vector<db::DifferenceRecord> to_records(const std::vector<FoundDifference>& differences) {
  std::vector<db::DifferenceRecord> out;
  for (const FoundDifference& difference : differences) {
    db::DifferenceRecord& record = out.emplace_back();
    record.gone = difference.seen.kind == calib::DifferenceKind::kGoneNotBooked;
    record.place = difference.seen.place;
    record.shape = difference.seen.shape;
    record.area = difference.seen.area;
    auto pieces = nlohmann::json::array();
    for (const auto& piece : difference.pieces)
      pieces.push_back({{"job", piece.job.value}, {"mark", piece.mark}, {"state", db::to_string(piece.state)}});
    record.pieces_json = pieces.dump();
  }
  return out;
}

}  // namespace veneer::daemon
