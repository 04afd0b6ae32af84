// What a job is to be planned with, as newJob (docs/openapi.json) is asked for it. Pure; thread-safe.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/ids.h"
#include "base/result.h"
#include "daemon/api/api_message.h"
#include "daemon/config.h"
#include "db/request_keys.h"
#include "planner/edits/plan_edits.h"
#include "planner/plan.h"

namespace veneer::daemon {

// The drawing that a plan's layout was made of, as it is kept with the plan.
struct KeptDrawing {
  std::string file;  // in the data folder; "" of plans of versions that kept none
  std::size_t bytes = 0;
};

struct JobRequest {
  std::string name;
  SharedText files;                                     // the picture's bytes, and after them the drawing's
  std::size_t segmentation_bytes = 0;                   // of the drawing whose regions become pieces; 0: there is none
  std::optional<KeptDrawing> kept_drawing{};            // of an earlier plan, whose layout this one has
  std::string crop;                                     // of the picture, as planner::crop_of() reads it; "": all of it
  Millimetres size{360};                                // shorter side
  planner::PlanOptions options;                         // threads, kerf and position margin are the cell's own
  std::string large_edges = "all", fine_edges = "all";  // that a morphed grid follows, as edge_mask() reads it
  std::string pinned_vertices;                          // of a morphed grid, as planner::pinned_vertices_of() reads it
  std::string cell_sizes = "salient";                   // of a mosaic, as cell_size_mask() reads it
  std::string flow_lines;                               // of a mosaic, as planner::flow_drawing_of() reads it
  std::string importance = "even";                      // of parts of the picture, as importance_mask() reads it
  std::vector<PanelId> panels;                          // empty = all in stock
  std::vector<std::string> woods;  // materials of zones; empty = all wood, also what nobody has named
  std::vector<std::pair<std::string, double>> wood_weights;  // how many times a wood's area counts in its tones
  std::vector<std::pair<std::string, double>> wood_limits;   // the most that a wood may be of the picture's area
  std::vector<planner::ForbiddenWood> forbidden;
  // When the request has a key: it makes one job at most, also when it is sent again after a restart.
  std::optional<db::KeyedRequest> keyed;
  // No more panels than this: those with the most free wood of the kinds asked for, remnants before fresh ones.
  std::optional<std::size_t> max_panels;
  // Asked for: fresh panels only while remnants have too little wood (orders/job_wood.h).
  std::optional<bool> remnants_first;

  std::string_view picture() const { return files.view().substr(0, files.size() - segmentation_bytes); }
  std::string_view segmentation() const { return files.view().substr(files.size() - segmentation_bytes); }
};

// kInvalidArgument: the picture is missing, a parameter is not known or cannot be what it says, a layout is told what
// it does not heed (edges, pinned vertices, a drawing), or the planner refuses an option whatever the picture and the
// wood (planner::check_options).
Result<JobRequest> read_job_request(const ApiRequest& request);

// Where the request leaves the choice of panels to the cell, and does not say whether remnants come first, the
// configuration does.
void choose_as_configured(JobRequest& request, const PlannerConfig& planner);

// For what draws squares whatever the layout: kInvalidArgument where the request says how a layout's pieces are to lie.
// `what`: "a sketch".
Status wants_no_guides(const JobRequest& request, std::string_view what);
// For what reads the picture alone: kInvalidArgument where a drawing of the pieces is sent with it.
Status wants_no_drawing(const JobRequest& request, std::string_view what);

// The same request again, from what is kept of it: for a plan that changes an earlier one, and has that one's layout.
// So its drawing is not read again, but stays known (JobRequest::kept_drawing). kStorage: it cannot be read.
Result<JobRequest> job_request_again(const std::string& name, SharedText picture, const std::string& options_json);

// All but name and files, under the names of the parameters: what is kept with the job, and shown. Where the drawing is
// kept stands beside them (`segmentation_file`) once there is such a file, for kept_drawing(); it is not for showing.
nlohmann::json options_json(const JobRequest& request);
inline constexpr const char* kDrawingFile = "segmentation_file";
// Of what is kept of a plan; none: its layout was made of no drawing, or the options cannot be read.
std::optional<KeptDrawing> kept_drawing(const std::string& options_json);

}  // namespace veneer::daemon
