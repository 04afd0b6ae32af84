// What a worker process does to show where the lines of a morphed grid will be, while somebody moves a slider, paints
// edges or pins vertices (planner/suggest/grid_sketch.h). It looks at no wood, and writes nothing.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/units.h"
#include "daemon/workers/work_runner.h"

namespace veneer::daemon {

struct DrawGrid {
  static constexpr const char* kKind = "draw_grid";
  std::string name;
  std::string picture;                                  // file
  std::string crop;                                     // as planner::crop_of() reads it; "": all of it
  Millimetres size{0};                                  // shorter side
  std::map<std::string, std::string> options;           // planner::kNamedOptions
  std::string large_edges = "all", fine_edges = "all";  // edge_mask() of them
  std::string pinned_vertices;                          // planner::pinned_vertices_of() it
  bool fine = false;                                    // planner::GridEffort
};

struct GridDrawn {
  using Place = std::array<double, 2>;  // millimetres from the artwork's lower left corner, to a hundredth
  double width_mm = 0, height_mm = 0;
  int rows = 0, columns = 0;
  std::vector<Place> vertices;            // as planner::GridPreview has them
  std::vector<std::vector<Place>> lines;  // likewise
};
// As planner::sketch_grid() says; kInvalidArgument also: the crop does not lie within the picture.
Result<GridDrawn> draw_grid(const DrawGrid& order, const std::filesystem::path& folder, const TaskProgress& progress);

}  // namespace veneer::daemon
