// What a worker process does to show where the lines of a morphed grid or the cells of a mosaic will be, while somebody
// moves a slider, paints, pins vertices or draws lines (planner/suggest/grid_sketch.h, mosaic_sketch.h). It looks at no
// wood, and writes nothing but the edges that the next grid of the same picture asks for.
#pragma once

#include <array>
#include <cstddef>
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
  std::string kept_dir;                                 // where edges are kept for the next grid (kept_edges.h)
};

using DrawnPlace = std::array<double, 2>;  // millimetres from the artwork's lower left corner, to a hundredth

struct GridDrawn {
  double width_mm = 0, height_mm = 0;
  int rows = 0, columns = 0;
  std::vector<DrawnPlace> vertices;            // as planner::GridPreview has them
  std::vector<std::vector<DrawnPlace>> lines;  // likewise
};
// As planner::sketch_grid() says; kInvalidArgument also: the crop does not lie within the picture.
Result<GridDrawn> draw_grid(const DrawGrid& order, const std::filesystem::path& folder, const TaskProgress& progress);

struct DrawMosaic {
  static constexpr const char* kKind = "draw_mosaic";
  std::string name;
  std::string picture;                         // file
  std::string crop;                            // as planner::crop_of() reads it; "": all of it
  Millimetres size{0};                         // shorter side
  std::map<std::string, std::string> options;  // planner::kNamedOptions
  std::string cell_sizes = "salient";          // cell_size_mask() of it
  std::string flow_lines;                      // planner::flow_drawing_of() it
  std::string importance = "even";             // importance_mask() of it
  bool fine = false;                           // planner::GridEffort
};

struct MosaicDrawn {
  double width_mm = 0, height_mm = 0;
  std::size_t cells = 0;
  std::vector<std::vector<DrawnPlace>> lines;  // as planner::MosaicPreview has them
};
// As planner::sketch_mosaic() says; kInvalidArgument also: the crop does not lie within the picture, or nothing can be
// made of what was painted and drawn.
Result<MosaicDrawn> draw_mosaic(const DrawMosaic& order, const std::filesystem::path& folder,
                                const TaskProgress& progress);

}  // namespace veneer::daemon
