// Plans of the gallery, each made once by `veneerctl plan`, as a user would make it.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "planner/plan.h"
#include "tests/gallery/sources.h"
#include "tests/gallery/studies.h"

namespace veneer::gallery {

struct PlanFigures {
  std::size_t pieces = 0, unfilled = 0;
  std::optional<double> preview_cost_per_pixel;
  double cost_per_pixel = 0;
  double seconds = 0;
  double wood_cm2 = 0;  // of all pieces, without kerf
};

struct PlanRun {
  std::string command;           // to be run in the gallery's folder
  std::filesystem::path folder;  // what the command wrote, below it
  planner::Plan plan;
  PlanFigures figures;
};

class PlanRuns {
 public:
  // The working directory is the gallery's folder. `began` is told of each command before it runs.
  PlanRuns(std::filesystem::path veneerctl, Sources& sources, std::function<void(const std::string& command)> began)
      : veneerctl_(std::move(veneerctl)), sources_(sources), began_(std::move(began)) {}

  // `name` becomes the folder's, if this plan is asked for for the first time. The error is the planner's own sentence.
  // The plan lives as long as this.
  Result<const PlanRun*> run(const PlanOrder& order, const std::string& name);

 private:
  Result<PlanRun> made(const PlanOrder& order, const std::string& name);

  std::filesystem::path veneerctl_;
  Sources& sources_;
  std::function<void(const std::string& command)> began_;
  std::map<PlanOrder, Result<PlanRun>> known_;
};

// The options that the order names, others as they are by default. kInvalidArgument: a value that is none.
Result<planner::PlanOptions> plan_options(const PlanOrder& order);
// The shorter side of the order's picture, mm.
double size_mm(const PlanOrder& order);

}  // namespace veneer::gallery
