// Strokes as files, for lasers that are driven by other programs. Nothing is moved or read here. Pure; thread-safe.
#pragma once

#include <string>
#include <vector>

#include "daemon/orders/toolpath_work.h"
#include "daemon/orders/wood_recipes.h"
#include "db/job_store.h"
#include "drivers/laser_job.h"
#include "planner/cutting/test_card.h"

namespace veneer::daemon {

LaserJob job_of(const planner::TestCard& card, bool dark = false);

// Where a Lihuiyu board's strokes may lie; its home corner is the upper left one.
struct Travel {
  Millimetres x{300}, y{200};
};

struct CutFile {
  std::string text;
  std::vector<std::string> warnings;  // one sentence each: a mark left out, a bridge that found no place
};

// The way to be found through the pieces of one panel that lies with its back up, the upper left corner of what is then
// seen in the home corner. kInvalidArgument names a piece with an outline that no beam can follow.
Result<LayToolpath> path_from_home(const db::PanelRecord& panel, const std::vector<db::PieceRecord>& pieces,
                                   const WoodRecipes& recipes, const RecipeConfig& config, const Travel& travel);
// As LHYMICRO-GL. kInvalidArgument when it leaves the travel.
Result<CutFile> egv_of(const planner::Toolpath& path, const Travel& travel);
Result<CutFile> egv_of(const planner::TestCard& card, const Travel& travel);

}  // namespace veneer::daemon
