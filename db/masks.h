// What people gave back to the masks of panels, or withheld. Such edits are a layer over what scans see: each later
// version of a mask has them, until somebody takes them back.
//
// Bound to the thread of the Database it is given, which must outlive it.
#pragma once

#include <cstddef>
#include <functional>
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

// An edit, and the mask as it is with that one and all before it.
struct PaintedEdit {
  MaskEdit edit;
  MaskRecord made;
};

// Of one panel: whoever scans it again has all that count drawn again. What is given or withheld by more of them is
// painted with fewer and wider strokes.
inline constexpr std::size_t kMostMaskEdits = 200;
inline constexpr std::size_t kMostMaskEditCorners = 100'000;

struct MaskEditPage {
  std::vector<MaskEdit> edits;
  bool more = false;  // some follow
};

class Masks {
 public:
  explicit Masks(Database& database) : database_(&database) {}

  // Those that count, the oldest first. kNotFound: there is no such panel.
  Result<std::vector<MaskEdit>> counting(const PanelId& panel);
  // Those too that were taken back, unless only those that count are asked for, from the one behind `after` on: `limit`
  // at most (-1: all), fewer where they have many corners together. kNotFound: there is no such panel.
  Result<MaskEditPage> list(const PanelId& panel, MaskEditId after, int limit, bool only_counting = false);
  // kNotFound: the panel has no such edit, or there is no such panel.
  Result<MaskEdit> find(const PanelId& panel, MaskEditId edit);
  // The edit, and the version of the mask that was `made` with it, in one transaction; the audit log says who painted
  // how much. kConflict when another version than `after` counts by now, or the panel is retired.
  Result<MaskEditId> add(const PanelId& panel, const MaskEdit& edit, const MaskRecord& made, int after);
  // What `enter` writes of the panel, a scan say, and these edits behind it, in their order: one transaction, of which
  // nothing is written when a part of it fails. As add() refuses, and as `enter` does.
  Status add_behind(const PanelId& panel, const std::function<Status()>& enter, const std::vector<PaintedEdit>& edits);
  // The mask without one of them. kNotFound when the panel has no such edit; kConflict too when it was taken back.
  Status remove(const PanelId& panel, MaskEditId edit, const std::string& who, const std::string& at,
                const MaskRecord& made, int after);

 private:
  Database* database_;
};

}  // namespace veneer::db
