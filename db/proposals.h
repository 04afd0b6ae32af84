// What scans saw that is not stock yet. A proposal stays open until somebody accepts or refuses it, or until a later
// scan of the same sheet takes its place. Accepting one and entering what it shows is one transaction
// (Panels::add, add_part, add_mask).
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

namespace veneer::db {

using ProposalId = NumericId<struct ProposalIdTag>;

enum class ProposalVerdict {
  kAccepted,
  kRefused,
  kReplaced,  // by a later scan of the same sheet
};
const char* to_string(ProposalVerdict verdict);

// A strip that the eye was not sure of: somebody is asked whether it is wood.
struct AskedStripRecord {
  int number = 0;            // from 1, as in the name of its warning
  Ring<PanelFrame> outline;  // its corners; stored in whole micrometres
  double confidence = 0;     // 0 to 1
  bool taken = false;        // usable unless somebody says otherwise; else withheld
  std::string reason;        // the end of a sentence
};

struct ProposalRecord {
  struct Decision {
    ProposalVerdict verdict = ProposalVerdict::kRefused;
    std::vector<std::string> overruled;  // names of warnings
    std::optional<PanelId> panel;        // of an accepted one: what it became, or whose mask
    std::optional<int> mask_version;     // and the version that it is there
    std::string who, note, at;
  };
  ProposalId id;                 // 0 on insertion
  std::optional<PanelId> panel;  // a known one, whose wood it would change; nothing: a first scan
  std::optional<int> after;      // of a known one: the version of the mask that it was compared with
  std::string who, made_at;
  // Pictures, and what was read from them, as the daemon named them; removed when it is decided.
  std::string map_file, mask_file, read_file, read_sha256;
  std::vector<std::string> scan_files;
  std::vector<int> tags;  // of the show face
  Millimetres width{0}, height{0};
  // Stored in whole square micrometres. Of a known panel: free wood that it would take, not beside what was cut, and
  // wood that it would give back.
  SquareMillimetres usable{0}, lost{0}, gained{0};
  std::string warnings_json = "[]";     // why somebody should look first, written and read by the daemon
  std::vector<AskedStripRecord> asked;  // of proposals from schema 37 on; by number
  std::optional<Decision> decision;     // nothing while it is open
};

// That a proposal is accepted, in the transaction that enters what it shows.
struct Acceptance {
  ProposalId proposal;
  std::vector<std::string> overruled;
  std::string who;
};

class Proposals {
 public:
  explicit Proposals(Database& database) : database_(&database) {}

  // Its number. Open ones of the same panel, or of sheets with one of its tags, are replaced.
  Result<ProposalId> add(const ProposalRecord& proposal);
  // kNotFound; kConflict when it was decided before.
  Status refuse(ProposalId proposal, const std::string& who, const std::string& note, const std::string& at);

  Result<ProposalRecord> find(ProposalId proposal);        // kNotFound
  Result<std::vector<ProposalRecord>> list(bool decided);  // the newest first; open ones only, or all
  // At most `limit` of them, of those older than `before`; {0}: of all.
  Result<std::vector<ProposalRecord>> list(bool decided, ProposalId before, int limit);
  // Files of decided ones that nothing else in the database names.
  Result<std::vector<std::string>> spent_files();

 private:
  Database* database_;
};

}  // namespace veneer::db
