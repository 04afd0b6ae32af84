#include "daemon/plans/drawn_file.h"

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>

#include "base/json_depth.h"
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

// Reading a value takes many times the memory of its text.
bool has_few_values(std::string_view text) {
  const auto values = std::count_if(text.begin(), text.end(), [](char c) { return c == ',' || c == '[' || c == '{'; });
  return static_cast<std::size_t>(values) <= 4 * kMostPointsToRun + 100 * kMostLineKinds;
}

bool are_counts(const nlohmann::json& list) {
  return list.is_array() &&
         std::all_of(list.begin(), list.end(), [](const nlohmann::json& it) { return it.is_number_unsigned(); });
}

// What a page would be asked to burn is whole, or it is nothing.
bool adds_up(const DrawingRead& read) {
  std::size_t points = 0;
  for (const std::size_t count : read.strokes) {
    if (count < 2 || count > kMostPointsToRun - points) return false;
    points += count;
  }
  if (2 * points != read.points_mm.size()) return false;
  if (read.strokes.empty() || read.kind_of_stroke.size() != read.strokes.size()) return false;
  for (const std::size_t kind : read.kind_of_stroke)
    if (kind >= read.kinds.size()) return false;
  return true;
}

// What somebody said of a kind of line, else what the recipe of its layer says, is what it is burnt with: a worker is
// believed where the lines are, which are seen before they burn, and not how strongly.
bool is_as_said(const DrawingRead& read, const ReadDrawing& wanted) {
  if (read.kinds.size() > kMostLineKinds) return false;
  if (!wanted.given.empty() && wanted.given.size() != read.kinds.size()) return false;
  for (std::size_t i = 0; i < read.kinds.size(); ++i) {
    DrawnSetting said = wanted.given.empty() ? DrawnSetting() : wanted.given[i];
    for (const LayerRecipe& recipe : wanted.recipes) {
      if (recipe.layer != read.kinds[i].layer) continue;
      if (!said.power) said.power = recipe.power;
      if (!said.speed_mm_s) said.speed_mm_s = recipe.speed_mm_s;
    }
    const DrawnSetting& its = read.kinds[i].setting;
    if (its.power != said.power || its.speed_mm_s != said.speed_mm_s || its.passes != said.passes.value_or(1) ||
        its.air != said.air.value_or(false))
      return false;
  }
  return true;
}

// Where the lines that would be burnt lie, whatever else was told.
void measure(DrawingRead& read) {
  read.least_mm = read.most_mm = {read.points_mm[0], read.points_mm[1]};
  for (std::size_t i = 0; i < read.points_mm.size(); ++i) {
    read.least_mm[i % 2] = std::min(read.least_mm[i % 2], read.points_mm[i]);
    read.most_mm[i % 2] = std::max(read.most_mm[i % 2], read.points_mm[i]);
  }
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
  if (!text || nested_too_deeply(*text) || !has_few_values(*text)) return nonsense();
  try {
    const auto parsed = nlohmann::json::parse(*text);
    if (!are_counts(parsed.at("strokes")) || !are_counts(parsed.at("kind_of_stroke"))) return nonsense();
    auto read = parsed.get<DrawingRead>();
    if (!adds_up(read) || !is_as_said(read, wanted)) return nonsense();
    measure(read);
    return read;
  } catch (const nlohmann::json::exception&) {
    return nonsense();
  }
}

}  // namespace veneer::daemon
