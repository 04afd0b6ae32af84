// What a worker process does to show how a picture would about look in the wood, while somebody moves a slider
// (planner/suggest/picture_sketch.h). Writes nothing but what it keeps of the wood (kept_wood.h).
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/units.h"
#include "daemon/orders/job_wood.h"
#include "daemon/workers/work_runner.h"
#include "db/materials.h"

namespace veneer::daemon {

struct DrawSketch {
  static constexpr const char* kKind = "draw_sketch";
  std::string name;
  std::string picture;                         // file
  std::string crop;                            // as planner::crop_of() reads it; "": all of it
  Millimetres size{0};                         // shorter side
  std::map<std::string, std::string> options;  // planner::kNamedOptions
  std::string importance = "even";             // importance_mask() of it
  Millimetres kerf{0};                         // the certificate's
  JobWood wood;
  std::vector<db::RecipeRecord> recipes;
  std::string kept_dir;                                 // where the wood is kept for the next sketch
  bool fine = false;                                    // planner::GridEffort; only a fine one heeds what follows
  std::string large_edges = "all", fine_edges = "all";  // edge_mask() of them
  std::string pinned_vertices;                          // planner::pinned_vertices_of() it
  std::string cell_sizes = "salient";                   // cell_size_mask() of it
  std::string flow_lines;                               // planner::flow_drawing_of() it
};

struct SketchDrawn {
  std::string layout;
  double width_mm = 0, height_mm = 0, patch_mm = 0;
  std::size_t pieces = 0, unfilled = 0;
  double likeness = 0;
  std::optional<double> cutting_s;
  std::vector<std::string> remarks;
  std::string preview;                // a JPEG file, in base64
  std::vector<std::string> left_out;  // panels whose wood may not be used, and why; said by whoever chose them
};
// As planner::sketch_picture() and load_job_wood() say; kInvalidArgument also: the crop does not lie within the
// picture.
Result<SketchDrawn> draw_sketch(const DrawSketch& order, const std::filesystem::path& folder,
                                const TaskProgress& progress);

}  // namespace veneer::daemon
