// Which wood a panel's zones are of, and how each wood is burnt.
//
// Bound to the thread of the Database it is given, which must outlive it.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/geometry.h"
#include "base/ids.h"
#include "base/polygon_ops.h"
#include "base/result.h"
#include "db/database.h"

namespace veneer::db {

enum class Operation { kCut, kEngrave };
const char* to_string(Operation operation);
std::optional<Operation> operation_of(const std::string& name);

// Full width burnt away by a cut: where the beam enters (a panel is cut from its back) and at the show face.
struct KerfRecord {
  Millimetres back, show;
  friend bool operator==(const KerfRecord&, const KerfRecord&) = default;
};

struct RecipeRecord {
  std::string material;
  Operation operation = Operation::kCut;
  MmPerSecond speed{0};
  PowerFraction power{0};
  int passes = 1;
  bool air = true;
  std::optional<KerfRecord> kerf;  // of a cut only; without: as the kerf certificate says. Stored in whole micrometres.
  std::string changed_at;
};

// A strip of usable wood.
struct ZoneRecord {
  int number = 0;            // from 1, left to right
  Region<PanelFrame> shape;  // of a panel whose zones were found under schemas before 37: a ring around all of it
  std::string material;      // "": nobody has said
  // How sure the eye was of it, 0 to 1 (calib::Zone); nothing of a zone that was found under a schema before 37, and
  // once a person drew it or what took wood from it.
  std::optional<double> confidence = std::nullopt;
  int version = 1;  // 1 as it was found; more since a person drew it or what took wood from it, the more the later
};

class Materials {
 public:
  explicit Materials(Database& database) : database_(&database) {}

  // Adds the recipe or takes the place of the one before. kInvalidArgument names the value that cannot be.
  Status set_recipe(const RecipeRecord& recipe);
  Status remove_recipe(const std::string& material, Operation operation);  // kNotFound
  Result<std::vector<RecipeRecord>> recipes();                             // by material, cut before engrave

  // Those of a panel that has none yet; a panel that has keeps its own. kNotFound without such a panel.
  Status add_zones(const PanelId& panel, const std::vector<ZoneRecord>& zones);
  Result<std::vector<ZoneRecord>> zones(const PanelId& panel);  // by number
  // The same of all panels at once, without the outlines, and without zones of which nothing is left since others were
  // drawn over them.
  Result<std::map<PanelId, std::vector<ZoneRecord>>> zones_without_outlines();
  // Of all panels what their zones of which something is left are said to be of, each wood once, in the order of the
  // zones.
  Result<std::map<PanelId, std::vector<std::string>>> woods();
  // A person draws the outline of a zone anew, or with nothing for `zone` a further one, without a material. What was
  // drawn is of no other zone from then on, and what is not drawn any more is of none. Wood that is reserved, leased,
  // cut, suspect or scrap stays in the zones that it is in, whatever is drawn, so that no piece's material changes. Its
  // number. kNotFound when there is no such zone; kConflict when all that was drawn is such wood.
  Result<int> draw_zone(const PanelId& panel, std::optional<int> zone, const Region<PanelFrame>& drawn,
                        const std::string& who, const std::string& at);
  // Of one zone, or of all. kNotFound when there is no such zone.
  Status set_material(const PanelId& panel, std::optional<int> zone, const std::string& material);

 private:
  Database* database_;
};

}  // namespace veneer::db
