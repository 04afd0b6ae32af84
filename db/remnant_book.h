// What was left of panels: booked after each run and whenever their usable wood changed, so that it is known what a
// panel had at any time, and nothing has to be counted in its mask for what it has now.
//
// Bound to the thread of the Database it is given, which must outlive it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/geometry.h"
#include "base/ids.h"
#include "base/result.h"
#include "base/units.h"
#include "db/database.h"
#include "db/job_store.h"

namespace veneer::db {

using RemnantId = NumericId<struct RemnantIdTag>;

struct RemnantRecord {
  // Sides along the panel's; or a circle about `at`, whose radius is `size`. Stored in whole micrometres, never larger
  // than it is.
  struct Room {
    Point<PanelFrame> at{};  // the lower left corner
    Millimetres size{0};     // side
  };
  // Free wood of one material; "" where nobody has said. Stored in whole square micrometres.
  struct Wood {
    std::string material;
    SquareMillimetres free{0};
  };
  // How much of it a search finds, as the daemon names that. Stored in the same way.
  struct Fitting {
    std::string search;
    SquareMillimetres area{0};
  };
  RemnantId id;  // 0 on insertion
  PanelId panel;
  int mask_version = 0;      // that counted
  std::optional<RunId> run;  // the panel's last one; nothing while there was none
  std::string counted_of;    // names mask, what was booked and what the zones were of, as the daemon does
  std::vector<Wood> woods;
  std::optional<Room> square, circle;  // nothing when no wood is free
  std::vector<Fitting> fitting;
  std::string picture_file;  // as the daemon named it; empty where none could be drawn
  std::string at;
};

class RemnantBook {
 public:
  explicit RemnantBook(Database& database) : database_(&database) {}

  // kConflict when the panel has no such mask or run.
  Status book(const RemnantRecord& remnant);
  // kNotFound when it is not one of the panel's.
  Result<RemnantRecord> find(const PanelId& panel, RemnantId remnant);
  // The one that was booked last.
  Result<std::optional<RemnantRecord>> newest(const PanelId& panel);
  // At most `limit`, the newest first.
  Result<std::vector<RemnantRecord>> list(const PanelId& panel, int limit);

  // Panels in stock that were cut, or got another mask, since their remnant was booked; those that were touched last
  // first.
  struct Due {
    PanelId panel;
    std::optional<RunId> run;  // the panel's last one, which is over
  };
  Result<std::vector<Due>> due(int limit);

 private:
  Database* database_;
};

}  // namespace veneer::db
