#include "daemon/plans/drawn_file.h"

#include <chrono>
#include <string>
#include <utility>

#include "daemon/api/route_table.h"
#include "daemon/orders/drawing_json.h"
#include "daemon/orders/have_done.h"
#include "daemon/plans/run_strokes.h"
#include "daemon/workers/work_folder.h"

namespace veneer::daemon {
namespace {

Error nonsense() {
  return {ErrorCode::kInternal,
          "reading the drawing was broken off, because its process answered nonsense: try again, and report it when it "
          "comes back"};
}

// What a page would be asked to burn is whole, or it is nothing.
bool fits_together(const DrawingRead& read) {
  std::size_t points = 0;
  for (const std::size_t count : read.strokes) points += count;
  if (points > kMostPointsToRun || 2 * points != read.points_mm.size()) return false;
  if (read.strokes.empty() || read.kind_of_stroke.size() != read.strokes.size()) return false;
  for (const std::size_t kind : read.kind_of_stroke)
    if (kind >= read.kinds.size()) return false;
  return true;
}

}  // namespace

Result<DrawingRead> read_drawn_file(std::string_view svg, ReadDrawing wanted, const std::filesystem::path& data_dir,
                                    WorkRunner& workers, const std::stop_token& stop) {
  constexpr std::chrono::seconds kLimit{20};
  auto folder = WorkFolder::make(data_dir);
  if (!folder) return folder.error();
  wanted.file = (folder->path() / "drawing.svg").string();
  wanted.most_points = kMostPointsToRun;
  if (const Status kept = keep_for_a_moment(svg, wanted.file); !kept) return kept.error();
  WorkOrder order;
  order.kind = ReadDrawing::kKind;
  order.what = "reading the drawing";
  order.folder = folder->path();
  order.deadline = kLimit;
  order.nice = 10;
  const auto done = have_done<DrawingWasRead>(
      workers, std::move(order), wanted, [](double, const std::string&) {}, stop);
  if (!done) return done.error();
  // Names every stroke's kind too.
  const auto text = folder->made(kDrawingReadFile, 2 * kDrawingBody);
  if (!text) return nonsense();
  try {
    auto read = nlohmann::json::parse(*text).get<DrawingRead>();
    if (!fits_together(read)) return nonsense();
    return read;
  } catch (const nlohmann::json::exception&) {
    return nonsense();
  }
}

}  // namespace veneer::daemon
