#include "daemon/orders/toolpath_work.h"

#include <algorithm>
#include <numeric>

#include "daemon/orders/have_done.h"
#include "daemon/orders/toolpath_json.h"
#include "daemon/workers/work_folder.h"

namespace veneer::daemon {
namespace {

// Of 170 pieces it took half a second.
constexpr std::chrono::minutes kLimit{5};

// Every piece that was asked for, once, and all strokes a piece's own: nothing else may come before the beam.
bool answers(const planner::Toolpath& path, const LayToolpath& order) {
  std::vector<PieceId> asked, laid;
  for (const auto& piece : order.pieces) asked.push_back(piece.piece);
  for (const auto& piece : path.pieces) laid.push_back(piece.piece);
  std::sort(asked.begin(), asked.end());
  std::sort(laid.begin(), laid.end());
  if (asked != laid) return false;
  auto stroke = path.strokes.begin();
  for (const auto& piece : path.pieces)
    for (std::size_t i = 0; i < piece.strokes; ++i, ++stroke)
      if (stroke == path.strokes.end() || stroke->piece != piece.piece || stroke->path.size() < 2) return false;
  return stroke == path.strokes.end();
}

}  // namespace

Result<planner::Toolpath> lay_toolpath(const LayToolpath& order, const std::filesystem::path&, const TaskProgress&) {
  return planner::make_toolpath(order.pieces, order.options);
}

Result<planner::Toolpath> have_toolpath_laid(WorkRunner& workers, const std::filesystem::path& data_dir,
                                             const LayToolpath& order, const std::stop_token& stop) {
  const auto folder = WorkFolder::make(data_dir);
  if (!folder) return folder.error();
  WorkOrder work;
  work.kind = LayToolpath::kKind;
  work.what = "finding the beam's way";
  work.folder = folder->path();
  work.deadline = kLimit;
  auto path = have_done_despite_a_death<planner::Toolpath>(
      workers, work, order, [](double, const std::string&) {}, stop);
  if (path && !answers(*path, order))
    return Error{
        ErrorCode::kInternal,
        "the beam's way came back with other pieces than were asked for: try again, and report it when it comes "
        "back"};
  return path;
}

}  // namespace veneer::daemon
