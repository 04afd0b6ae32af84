// Plans: each is one answer to the question which wood makes a picture. A plan is stored, looked at and compared; a job
// is made of it (JobStore::create), and only that reserves wood; until then the plan may lease it. A plan never
// changes: other options, or wood that is forbidden, make another plan that names the one it came from as its parent. A
// plan by which lost pieces of a job are made again (JobStore::redo) has no patches of its own: it places some of those
// of the job's plan. What it says in full, `plan_json`, is a file beside the database, `plans/<SHA-256>.json`.
//
// Bound to the thread of the Database it is given, which must outlive it.
#pragma once

#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "base/frames.h"
#include "base/geometry.h"
#include "base/ids.h"
#include "base/polygon_ops.h"
#include "base/result.h"
#include "db/database.h"

namespace veneer::db {

using PlanId = NumericId<struct PlanIdTag>;

// A part of the picture and where its wood is taken from. `panel` is empty for a patch that found no wood; then all of
// the panel's side is.
struct PlannedPatch {
  std::string mark;  // engraved on the back, unique within the plan: "A3-12"
  Ring<ArtworkFrame> artwork_outline;
  std::optional<PanelId> panel;
  Ring<PanelFrame> panel_outline;  // the same vertices as artwork_outline, in the same order; no kerf
  Region<PanelFrame> allocation;   // panel_outline grown by k, and what its lead-in burns
  Isometry2<PanelFrame, ArtworkFrame> panel_from_artwork;
  std::optional<Point<PanelFrame>> lead_in;  // where its cut begins in waste
};

// What a plan takes for granted of a panel.
struct PlannedPanel {
  PanelId panel;
  int mask_version = 0;  // PanelRecord::mask_version when the plan was made
  friend bool operator==(const PlannedPanel&, const PlannedPanel&) = default;
};

struct NewPlan {
  std::string name;
  std::optional<PlanId> parent;
  std::string who;  // asked for it: "uid 1000"
  std::string target_file, preview_file;
  std::string plan_json, options_json;
  std::string report_json = "{}";  // what planning said of it: cost, warnings
  std::vector<PlannedPatch> pieces;
  std::vector<PlannedPanel> planned_on;  // every panel that pieces are taken from
};

// Who has the plan's wood held for it, since when it was made or renewed last, and until when (db/leases.h).
struct PlanLease {
  std::string who, at, until;
  friend bool operator==(const PlanLease&, const PlanLease&) = default;
};

struct PlanRecord {
  PlanId id;
  std::string name;
  std::optional<PlanId> parent;
  std::string who, created_at;
  std::string target_file, preview_file, options_json, report_json;  // the plan itself: plan_json()
  int patches = 0, placed = 0;  // placed: those that found wood, or were made again
  std::vector<PlannedPanel> panels;
  std::vector<PanelId> outdated;   // of these: scanned again since, so that no job can be made of the plan
  std::vector<JobId> jobs;         // made of it, or made again by it
  std::optional<PlanLease> lease;  // one that nobody has ended yet, though its time may have come
};

class Plans {
 public:
  explicit Plans(Database& database) : database_(&database) {}

  // kInvalidArgument when a patch contradicts itself or its panel is not named.
  Result<PlanId> add(const NewPlan& plan, const std::string& at);
  // kConflict when a job was made of it, another plan came from it, or it leases its wood.
  Status remove(PlanId plan);

  Result<PlanRecord> find(PlanId plan);    // kNotFound
  Result<std::vector<PlanRecord>> list();  // newest first
  // At most `limit` of them, from before `before` on; {0}: from the newest. `leasing`: those with a lease only.
  Result<std::vector<PlanRecord>> list(PlanId before, int limit, bool leasing = false);
  // From its file beside the database. kStorage names the file when it is missing or not what was written.
  Result<std::string> plan_json(PlanId plan);
  // Reads the file of every plan, and says the same of the first that is not as it was written. kCancelled soon after
  // `stop`.
  Status check_files(const std::stop_token& stop = {});
  Result<std::vector<PlannedPatch>> patches(PlanId plan);  // in the order of the plan; what it places, of a redo
  // At most `limit` of them, without the first `skipped`.
  Result<std::vector<PlannedPatch>> patches(PlanId plan, std::int64_t skipped, int limit);
  // Marks of the patches whose wood is held for another piece or plan by now; a job can be made while there are none.
  Result<std::vector<std::string>> taken(PlanId plan);

 private:
  Database* database_;
};

}  // namespace veneer::db
