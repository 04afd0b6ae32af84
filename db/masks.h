// What people gave back to the masks of panels, or withheld. Such edits are a layer over what scans see: each later
// version of a mask has them, until somebody takes them back.
//
// Bound to the thread of the Database it is given, which must outlive it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/ids.h"
#include "base/polygon_ops.h"
#include "base/result.h"
#include "db/database.h"
#include "db/panels.h"

namespace veneer::db {

using MaskEditId = NumericId<struct MaskEditIdTag>;

struct MaskEdit {
  struct Removal {
    std::string who, at;
  };
  MaskEditId id;             // 0 on insertion
  bool give = false;         // wood that the scan left out; else wood that it called usable is withheld
  Region<PanelFrame> shape;  // never empty
  std::string who, note, at;
  std::optional<Removal> removal;
};

class Masks {
 public:
  explicit Masks(Database& database) : database_(&database) {}

  // The oldest first, those too that were taken back. kNotFound: there is no such panel.
  Result<std::vector<MaskEdit>> of(const PanelId& panel);
  // The edit, and the version of the mask that was `made` with it, in one transaction; the audit log says who painted
  // how much. kConflict when another version than `after` counts by now, or the panel is retired.
  Result<MaskEditId> add(const PanelId& panel, const MaskEdit& edit, const MaskRecord& made, int after);
  // The same without one of them. kNotFound when the panel has no such edit; kConflict too when it was taken back.
  Status remove(const PanelId& panel, MaskEditId edit, const std::string& who, const std::string& at,
                const MaskRecord& made, int after);

 private:
  Database* database_;
};

}  // namespace veneer::db
