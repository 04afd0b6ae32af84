// A database with panels and jobs of square pieces, for the tests of db.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "db/job_store.h"
#include "db/ledger.h"
#include "db/panels.h"
#include "tests/support/temp_directory.h"

namespace veneer::db {

inline const std::string kNow = "2026-05-01T07:30:00.000Z";
inline const std::string kLater = "2026-05-01T08:30:00.000Z";

#define VENEER_ASSERT_OK(expression)                                  \
  do {                                                                \
    const auto& veneer_status = (expression);                         \
    ASSERT_TRUE(veneer_status.ok()) << veneer_status.error().message; \
  } while (false)
#define VENEER_EXPECT_OK(expression)                                  \
  do {                                                                \
    const auto& veneer_status = (expression);                         \
    EXPECT_TRUE(veneer_status.ok()) << veneer_status.error().message; \
  } while (false)

// The value, or the end of the test program with the sentence that says why.
template <class T>
T must(Result<T> result) {
  if (!result.ok()) {
    ADD_FAILURE() << result.error().message;
    std::abort();
  }
  return std::move(result).value();
}

inline Ring<PanelFrame> square(double x_mm, double y_mm, double side_mm) {
  return {point<PanelFrame>(x_mm, y_mm), point<PanelFrame>(x_mm + side_mm, y_mm),
          point<PanelFrame>(x_mm + side_mm, y_mm + side_mm), point<PanelFrame>(x_mm, y_mm + side_mm)};
}

inline Region<PanelFrame> rectangle(double x_mm, double y_mm, double width_mm, double height_mm) {
  return Region<PanelFrame>(Ring<PanelFrame>{point<PanelFrame>(x_mm, y_mm), point<PanelFrame>(x_mm + width_mm, y_mm),
                                             point<PanelFrame>(x_mm + width_mm, y_mm + height_mm),
                                             point<PanelFrame>(x_mm, y_mm + height_mm)});
}

inline constexpr double kSquareKerf = 0.3;

// A piece whose outline is a square; its wood is the outline grown by the kerf.
inline PlannedPatch square_piece(const std::string& mark, const PanelId& panel, double x_mm, double y_mm,
                                 double side_mm) {
  PlannedPatch piece;
  piece.mark = mark;
  for (const auto& p : square(0, 0, side_mm))
    piece.artwork_outline.push_back(point<ArtworkFrame>(p.x.count(), p.y.count()));
  piece.panel = panel;
  piece.panel_outline = square(x_mm, y_mm, side_mm);
  piece.allocation = offset(Region<PanelFrame>(piece.panel_outline), Millimetres(kSquareKerf));
  piece.panel_from_artwork = Isometry2<PanelFrame, ArtworkFrame>(Radians(0), point<PanelFrame>(x_mm, y_mm));
  return piece;
}

inline PanelRecord sheet(const PanelId& id) {
  PanelRecord panel;
  panel.id = id;
  panel.name = "walnut and maple";
  panel.width = 420_mm;
  panel.height = 280_mm;
  panel.map_file = "maps/" + id.value + ".png";
  panel.mask_file = "maps/" + id.value + "-mask.png";
  panel.map_hash = "0123";
  panel.created_at = kNow;
  return panel;
}

// A plan of these patches on the first version of each panel's mask.
inline NewPlan job_of(std::vector<PlannedPatch> patches) {
  NewPlan plan;
  plan.name = "portrait";
  plan.who = "local:1000";
  plan.target_file = "target.png";
  plan.plan_json = "{\"schema_version\":1}";
  plan.options_json = "{}";
  std::set<PanelId> panels;
  for (const PlannedPatch& patch : patches)
    if (patch.panel) panels.insert(*patch.panel);
  for (const PanelId& panel : panels) plan.planned_on.push_back({panel, 1});
  plan.pieces = std::move(patches);
  return plan;
}

class CellDatabase {
 public:
  CellDatabase() : database_(must(Database::open(file()))) {}

  std::filesystem::path file() const { return directory_ / "veneerd.db"; }
  Database& database() { return database_; }
  void reopen() {
    // The old connection and its lock go first, as they do with a process.
    { const Database closed = std::move(database_); }
    database_ = must(Database::open(file()));
  }
  PanelId new_panel() {
    PanelId id = must(panels().next_panel_id());
    if (!panels().add(sheet(id), {}, {}).ok()) std::abort();
    return id;
  }
  // How many pages of the file SQLite looks at for it: what it costs, whatever the clock says.
  template <class Work>
  int pages_for(const Work& work) {
    const auto looked_at = [this] {
      int all = 0;
      for (const int what : {SQLITE_DBSTATUS_CACHE_HIT, SQLITE_DBSTATUS_CACHE_MISS}) {
        int now = 0, highest = 0;
        sqlite3_db_status(database_.connection().getHandle(), what, &now, &highest, 1);
        all += now;
      }
      return all;
    };
    looked_at();  // what was counted before
    work();
    return looked_at();
  }
  Panels panels() { return Panels(database_); }
  Ledger ledger() { return Ledger(database_); }
  JobStore jobs() { return JobStore(database_); }

 private:
  testing::TempDirectory directory_;
  Database database_;
};

}  // namespace veneer::db
