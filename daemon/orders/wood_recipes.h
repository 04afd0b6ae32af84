// How a piece is burnt: by the recipe of the wood it lies in, and where nothing is written about that wood, as the
// configuration and the kerf certificate say. Values of one moment; pure once made, thread-safe.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "daemon/config.h"
#include "daemon/store/database_thread.h"
#include "drivers/laser_driver.h"
#include "planner/cutting/toolpath.h"

namespace veneer::daemon {

class WoodRecipes {
 public:
  // Of one panel's zones. `kerf` is the certificate's.
  WoodRecipes(const RecipeConfig& config, Millimetres kerf, std::vector<db::RecipeRecord> recipes,
              std::vector<db::ZoneRecord> zones);
  static Result<WoodRecipes> read(Repositories& repositories, const RecipeConfig& config, Millimetres kerf,
                                  const PanelId& panel);

  planner::Recipe recipe_of(const std::string& material) const;
  // Of the zone most of this outline lies in; "" where nobody has said what wood it is.
  std::string material_at(const Ring<PanelFrame>& outline) const;
  // The widest a cut of this panel can be: what a plan must keep between pieces.
  Millimetres widest_kerf() const;

 private:
  planner::Recipe otherwise_;
  std::vector<db::RecipeRecord> recipes_;
  std::vector<db::ZoneRecord> zones_;
};

// What of the configuration is the same for all wood: marks, clearance, bridges, order.
planner::ToolpathOptions toolpath_options(const RecipeConfig& config);

// What the estimate of time needs of the machine; the estimate's own assumptions where it tells nothing.
planner::Kinematics kinematics_of(const std::optional<LaserMotion>& machine);

// By which the cut of a piece may begin, where it lies on the bed: one, or none. kInvalidArgument names the piece.
Result<std::vector<planner::Lead<BedFrame>>> leads_on_bed(const db::PieceRecord& piece, const planner::Recipe& recipe,
                                                          Millimetres fit_clearance,
                                                          const Isometry2<BedFrame, PanelFrame>& bed_from_panel);

// kRefused when the recipe burns more around the outline and on the lead-in than was booked: the plan was made before
// the recipe.
Status check_booked(const db::PieceRecord& piece, const std::string& material, const planner::Recipe& recipe,
                    Millimetres fit_clearance, const Region<PanelFrame>& booked);

}  // namespace veneer::daemon
