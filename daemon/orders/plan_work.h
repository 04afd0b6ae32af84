// What a worker process does to make a plan: reads the picture and the wood, chooses, draws, finds lead-ins. Pure but
// for files.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "base/units.h"
#include "daemon/config.h"
#include "daemon/orders/job_wood.h"
#include "daemon/workers/work_runner.h"
#include "db/materials.h"
#include "planner/plan.h"

namespace veneer::daemon {

struct MakePlan {
  static constexpr const char* kKind = "make_plan";
  std::string name;
  std::string picture;                                  // file
  std::string crop;                                     // as planner::crop_of() reads it; "": all of the picture
  Millimetres size{0};                                  // shorter side
  std::map<std::string, std::string> options;           // planner::kNamedOptions
  std::string large_edges = "all", fine_edges = "all";  // edge_mask() of it; heeded by a morphed grid
  std::string pinned_vertices;                          // pinned_vertices_of() of it; heeded by a morphed grid
  std::string cell_sizes = "salient";                   // cell_size_mask() of it; heeded by a mosaic
  std::string flow_lines;                               // planner::flow_drawing_of() it; heeded by a mosaic
  std::string segmentation;                             // file of the drawing whose regions become pieces; "": none
  std::string importance = "even";                      // importance_mask() of it
  int threads = 0;
  Millimetres kerf{0};  // the certificate's
  double preview_dpi = 300;
  JobWood wood;
  RecipeConfig recipe;
  std::vector<db::RecipeRecord> recipes;
  // Of a plan that changes an earlier one: that one's file, and what is asked of it. Where the earlier one is being
  // made (PlanEdits::held), an answer's pieces are those that are made again.
  std::string earlier;
  planner::PlanEdits edits;
  double limit_s = 0;  // after which the work is given up, so that nothing is looked for beyond; 0: never
};
// What an answer leaves in the work's folder: the plan as planner::plan_to_json() writes it, its pieces as records
// (JSON), and the assembled picture.
inline constexpr const char *kMadePlan = "plan.json", *kMadePieces = "pieces.json", *kMadePreview = "preview.png";
// What becomes of a piece that is made again; costs are per pixel.
struct RedonePiece {
  std::string mark;
  std::optional<double> cost_before;  // none when it had no wood
  double cost = 0;
};
struct PlanMade {
  Millimetres kerf{0};  // of the whole plan: the widest any of the wood is cut with
  Millimetres web{0};   // that its pieces keep around their kerfs
  double cost_per_pixel = 0;
  std::size_t without_lead = 0;  // pieces whose cut begins on their own edge, for want of waste beside them
  std::vector<std::string> warnings;
  std::optional<planner::GlobalReport> global;
  std::optional<planner::FineReport> fine;
  std::optional<planner::RefineReport> refined;  // none of a plan that keeps an earlier one's curved pieces
  std::vector<RedonePiece> redone;
  double cost_before = 0;  // per pixel of the earlier plan, of a plan that makes pieces again
  double cutting_s = 0;    // of the whole plan, estimated; 0 where it cannot be
};
// kRefused when the wood does not fill the picture; the sentence says which tones are missing, and at which size or
// with which patches it does, where one was found in as long as the plan took, 30 s at least and 3 min at most
// (planner/suggest/fitting_size.h); where nothing could be tried, what is reckoned from areas. Otherwise as
// planner::make_plan and load_job_wood say.
Result<PlanMade> make_plan(const MakePlan& order, const std::filesystem::path& folder, const TaskProgress& progress);

}  // namespace veneer::daemon
