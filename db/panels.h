// Panels, their scans, their fiducials, the parts they are sawn into, and what turns out to be one. The records hold
// base types only; pictures are files, named by their hash.
//
// Bound to the thread of the Database it is given, which must outlive it.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/face.h"
#include "base/frames.h"
#include "base/geometry.h"
#include "base/ids.h"
#include "base/result.h"
#include "base/units.h"
#include "db/database.h"
#include "db/materials.h"
#include "db/proposals.h"

namespace veneer::db {

enum class FiducialKind { kTag, kHole };
const char* to_string(FiducialKind kind);

// Why and since when a panel is no longer in stock.
struct Retirement {
  std::string reason;
  std::string at;
  bool sawn = false;  // its parts are panels of their own, or become such when they are scanned
};

// Where a part lay in the panel that it was sawn from.
struct PartRecord {
  Isometry2<PanelFrame, PanelFrame> part_from_parent;  // proper
  int fiducials = 0;                                   // tags and holes of the parent that it was measured on
  Millimetres rms{0};                                  // of their places
};

// That two panels are one sheet.
struct MergeRecord {
  PanelId kept, merged;
  Isometry2<PanelFrame, PanelFrame> kept_from_merged;  // improper: the back was scanned as the show face
  int fiducials = 0;                                   // tags and holes in common
  Millimetres rms{0};                                  // of their places
  std::string who, at;
};

// One physical sheet, or what is left of it. Width and height are those of the veneer map's bounding box.
struct PanelRecord {
  PanelId id;  // "P-0001"
  std::string name;
  Millimetres width, height;
  int mask_version = 1;                     // of map and mask: counts up from 1; the highest is what counts
  std::string map_file, mask_file;          // of that version, as the daemon named them; empty until stitched
  std::string map_hash;                     // SHA-256 of the map file
  std::optional<SquareMillimetres> usable;  // what that mask calls usable; nothing while nobody has counted it
  std::string created_at;
  std::optional<PanelId> parent;      // a remnant's panel before it; null for a fresh sheet
  PanelId root;                       // the sheet it all came from; a fresh sheet is its own root
  std::optional<Retirement> retired;  // null while it is in stock
};

// What a panel's wood looked like and which of it is usable, at one time. Never edited.
struct MaskRecord {
  int version = 0;  // 0 on insertion
  std::string map_file, mask_file, map_hash;
  std::string made_at;
  std::optional<SquareMillimetres> usable = std::nullopt;  // stored in whole square micrometres
  // The mask as the scan alone saw it, where people painted on it (db/masks.h). Empty on insertion where nobody did;
  // then what is read is mask_file.
  std::string seen_file = {};
};

// With the first version that has the same map and mask: its own number, unless it took an earlier one back.
struct ListedMask {
  MaskRecord mask;
  int first = 0;
};

// Stored in whole micrometres.
struct FiducialRecord {
  FiducialKind kind = FiducialKind::kTag;
  int tag_id = -1;  // of a tag; holes are numbered by the caller, from 0
  Face face = Face::kShow;
  std::vector<Point<PanelFrame>> corners;  // a tag's four, in the detector's order; a hole's centre
};

// One raw raster and how it was registered. Never edited afterwards.
struct ScanRecord {
  ScanId id;  // 0 on insertion
  PanelId panel;
  Face face = Face::kShow;
  std::string device;  // "twin:capture-12"
  std::string file;
  std::string sha256;
  double dpi = 0;
  // Registration residuals of all tiles of a scanning together, the same with each of them: what tells them from those
  // of another one. Null for the only tile of a first scan.
  std::optional<Millimetres> rms, max;
  std::string lattice;  // the scan -> panel map, as calib writes it
  std::string taken_at;
};

// What a list tells of each panel beside its wood.
struct PanelSummary {
  int open_differences = 0;        // between its wood and the ledger, that nobody has decided on
  bool back_known = false;         // it has a fiducial on its back
  std::optional<Millimetres> rms;  // of the last scan of either face
};

class Panels {
 public:
  explicit Panels(Database& database) : database_(&database) {}

  // The id the next panel will get: "P-0001". Ids are never used twice.
  Result<PanelId> next_panel_id();
  // The panel, its scans, its frozen fiducials and its zones enter together, or not at all. An empty root means the
  // panel itself. kConflict when a panel in stock carries one of the tags: it is the same sheet. Like add_part() and
  // add_mask(): of a proposal, which is accepted with it (db/proposals.h).
  Status add(const PanelRecord& panel, const std::vector<ScanRecord>& scans,
             const std::vector<FiducialRecord>& fiducials, const std::optional<Acceptance>& of = {},
             const std::vector<ZoneRecord>& zones = {});
  // The same of a part of `panel.parent`, which was sawn apart; its root is the parent's. All wood of it that was cut
  // or written off while it was the parent's enters as such, in its frame, within its width and height.
  // kConflict too when the parent is not sawn any more, turned out to be another panel or has a suspect piece, or when
  // wood of the part was booked under a name that it does not come from.
  Status add_part(const PanelRecord& panel, const std::vector<ScanRecord>& scans,
                  const std::vector<FiducialRecord>& fiducials, const PartRecord& part,
                  const std::optional<Acceptance>& of = {}, const std::vector<ZoneRecord>& zones = {});
  // Nothing of a panel that is no part.
  Result<std::optional<PartRecord>> part(const PanelId& panel);
  Result<std::vector<PanelId>> parts_of(const PanelId& parent);  // in order of id
  // A later look at a known panel: its scans, and the fiducials of a face that had none (kConflict when it has, or when
  // the panel is retired); `new_tags` were glued to a face that has some (kConflict when a panel in stock carries one).
  Status add_scans(const PanelId& panel, const std::vector<ScanRecord>& scans,
                   const std::vector<FiducialRecord>& fiducials, const std::vector<FiducialRecord>& new_tags = {});
  // A new version of map and mask, made by comparison with version `after`; its number. The frame, the size, the
  // fiducials and earlier versions stay. kConflict when another version counts by now, or the panel is retired.
  Result<int> add_mask(const PanelId& panel, const MaskRecord& mask, int after,
                       const std::optional<Acceptance>& of = {});
  Result<std::vector<MaskRecord>> masks(const PanelId& panel);  // newest first
  // At most `limit` of them, of those before version `before`; 0: of all. kNotFound.
  Result<std::vector<ListedMask>> masks(const PanelId& panel, int before, int limit);
  // What the scan of `version` saw counts again, as a new version; its number. `painted`: that mask with the edits that
  // count now, where there are any, made while version `after` counted. Differences that only later scans found are not
  // open any more, and those that only these did not see are open again. kNotFound when there is no such version,
  // kConflict when it is the one that counts, or `after` is not any more.
  struct Painted {
    MaskRecord mask;
    int after = 0;
  };
  Result<int> revert_mask(const PanelId& panel, int version, const std::string& at, const std::string& who = "veneerd",
                          const std::optional<Painted>& painted = {});

  // The panel leaves the stock: it is neither planned from nor looked for any more; what was cut from it stays known.
  // kConflict while pieces of it are reserved, being cut or suspect.
  // `who` asked for it, as of restore(): kept with it, unless it is empty.
  Status retire(const PanelId& panel, const std::string& reason, const std::string& at, const std::string& who = {});
  // The same, because it was sawn apart: sheets with its tags are parts of it from now on. Also kConflict while a run
  // of it is on.
  Status split(const PanelId& panel, const std::string& who, const std::string& reason, const std::string& at);
  Result<std::vector<PanelId>> sawn();  // the one that was sawn last first
  // And comes back; kConflict when a panel in stock carries one of its tags, when wood of a panel that carries one
  // was ever booked, which is the same sheet, or when a part of it was entered.
  Status restore(const PanelId& panel, const std::string& reason, const std::string& at, const std::string& who = {});

  // That a backup of the time `made_at` takes the place of a database: each panel counts as unseen until it is scanned.
  Status note_restoration(const std::string& made_at, const std::string& who, const std::string& at);
  // kRefused when what is there of its wood is not known: a backup took the place of the database, or the panel was
  // merged with another one, after its show face was scanned; or a scan that would change much of it waits to be
  // accepted or refused.
  Status check_seen(const PanelId& panel);

  // Two panels turn out to be one sheet: `kept` holds the wood of both from now on. What is gone from `merged` is
  // booked in it, `tags` are those that it has not yet, `scans` become its own; `merged` leaves the stock for
  // good. kConflict, with the pieces' names, when both were cut from the same wood, when wood that is reserved or
  // leased is gone by the other's record, or while pieces of `merged` are reserved, being cut or suspect.
  Status merge(const MergeRecord& merge, const std::vector<FiducialRecord>& tags, const std::vector<ScanRecord>& scans);
  Result<std::optional<PanelId>> merged_into(const PanelId& panel);  // nothing of a panel that was not merged

  Result<PanelRecord> find(const PanelId& panel);                          // kNotFound
  Result<std::vector<PanelRecord>> list();                                 // in order of id, retired ones too
  Result<std::vector<PanelRecord>> list(std::int64_t skipped, int limit);  // at most so many, behind the first ones
  Result<std::vector<PanelRecord>> in_stock();                             // in order of id
  // Of all panels, in one query, or of one of them; nothing of one that is not there.
  Result<std::map<PanelId, PanelSummary>> summaries(const std::optional<PanelId>& of = {});
  Result<std::vector<FiducialRecord>> fiducials(const PanelId& panel);
  // The highest tag that any panel ever carried, retired ones too; nothing when there is none.
  Result<std::optional<int>> highest_tag();
  Result<std::vector<ScanRecord>> scans(const PanelId& panel);  // in order of id
  // At most `limit` of them, behind `after`; each may hold a registration of hundreds of kilobytes.
  Result<std::vector<ScanRecord>> scans(const PanelId& panel, ScanId after, int limit);
  // Nothing where that face was never scanned.
  Result<std::optional<ScanRecord>> last_scan(const PanelId& panel, Face face);
  // When the picture of this content was scanned last, as its stored file is: of this panel, proposals that were
  // decided among them, or, without one, of any panel that ever was. Nothing where it never was.
  Result<std::optional<std::string>> scanned_before(const std::string& sha256, const std::optional<PanelId>& panel);

 private:
  Database* database_;
};

}  // namespace veneer::db
