// What a worker process does to read a drawing that is to be burnt as it is, for a page that shows it first
// (planner/drawings/line_settings.h). What it reads goes into a file of its folder: a dense drawing is longer than a
// worker's answer may be.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "daemon/workers/work_runner.h"

namespace veneer::daemon {

// What is not said is nothing.
struct DrawnSetting {
  std::optional<double> power, speed_mm_s;  // of the rated power
  std::optional<int> passes;
  std::optional<bool> air;
};
struct LayerRecipe {
  std::string layer;
  double power = 0, speed_mm_s = 0;
};

struct ReadDrawing {
  static constexpr const char* kKind = "read_drawing";
  std::string file;                  // the SVG
  std::optional<double> x_mm, y_mm;  // where the lines' lower left corner is to be; none: the page's is the bed's
  std::vector<DrawnSetting> given;   // of each kind of line in turn; none: of no kind
  std::vector<LayerRecipe> recipes;  // for what nobody says of the lines of these layers
  std::size_t most_points = 0;
};
// In its folder: DrawingRead as JSON.
inline constexpr const char* kDrawingReadFile = "drawing.json";
struct DrawingWasRead {
  std::size_t points = 0;
};

// How lines of one layer and colour are burnt: passes and air are always said.
struct DrawnKind {
  std::string layer, colour;
  std::size_t lines = 0;
  double length_mm = 0;  // once each
  DrawnSetting setting;
};
struct DrawingRead {
  std::array<double, 2> page_mm{}, least_mm{}, most_mm{};  // the extent where it lies now
  std::vector<std::string> warnings;
  double length_mm = 0;  // once each
  std::vector<DrawnKind> kinds;
  std::vector<std::size_t> kind_of_stroke;
  std::vector<double> points_mm;     // as DrawnStrokes (daemon/plans/run_strokes.h), in place
  std::vector<std::size_t> strokes;  // points of each
};
inline constexpr std::size_t kMostLineKinds = 100;

inline constexpr double kFarthestMm = 10'000;  // where any machine may reach

// kInvalidArgument: it is no SVG that can be burnt as it looks, has nothing to burn, reaches beyond all machines, or
// has more points or kinds of line than may be, or other kinds than are given.
Result<DrawingWasRead> read_drawing(const ReadDrawing& order, const std::filesystem::path& folder,
                                    const TaskProgress& progress);

}  // namespace veneer::daemon
