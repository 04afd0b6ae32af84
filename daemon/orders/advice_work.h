// What a worker process does to advise before planning: it tries crops, sizes, patches and layouts small and fast
// (planner/suggest/suggestions.h). Pure but for the files it reads.
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

struct GiveAdvice {
  static constexpr const char* kKind = "give_advice";
  std::string name;
  std::string picture;                         // file
  std::string crop;                            // as planner::crop_of() reads it; "": any that reads well
  Millimetres size{0};                         // shorter side, at most
  std::map<std::string, std::string> options;  // planner::kNamedOptions
  std::string importance = "even";             // importance_mask() of it
  int threads = 0;
  Millimetres kerf{0};  // the certificate's
  JobWood wood;
  std::vector<db::RecipeRecord> recipes;
};

struct AdvisedPicture {
  std::string crop;  // "": the whole picture
  std::string layout;
  double size_mm = 0, width_mm = 0, height_mm = 0, patch_mm = 0;
  std::size_t pieces = 0, unfilled = 0;
  double likeness = 0, cutting_s = 0;
  std::string preview;  // a JPEG file, in base64
};
struct AdviceGiven {
  std::vector<AdvisedPicture> suggestions;
  std::optional<std::size_t> suggested;  // counted from 0; none: none is complete
  std::vector<std::string> remarks;
};
// As planner::advise() and load_job_wood() say; kInvalidArgument also: the crop does not lie within the picture.
Result<AdviceGiven> give_advice(const GiveAdvice& order, const std::filesystem::path& folder,
                                const TaskProgress& progress);

}  // namespace veneer::daemon
