// What the model of the database knows: panels as grids of cells, jobs of blobs of them, and whose each cell is.
#pragma once

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "db/differences.h"
#include "db/leases.h"
#include "db/masks.h"
#include "db/materials.h"
#include "db/proposals.h"
#include "tests/db/cell_database.h"

namespace veneer::db {

inline constexpr int kGrid = 8;        // cells per side of a panel
inline constexpr double kCell = 12.5;  // mm
inline constexpr std::size_t kMostPanels = 5;
inline constexpr double kInset = 1.25;  // mm from an area's edge to its piece's outline
using Cell = std::pair<int, int>;

inline const std::string kBetween = "2026-05-01T08:00:00.000Z", kMuchLater = "2026-06-01T00:00:00.000Z";
// As a time: every lease that nobody has ended counts, and none does.
inline const std::string kEver, kNever = "~";

// Any of these, as often as the others: rapidcheck's own draws small numbers alone in a property's first cases, so that
// in a short sample some commands were never given.
template <class T>
rc::Gen<T> in_range(T from, T to) {
  return rc::gen::resize(rc::kNominalSize, rc::gen::inRange<T>(from, to));
}

struct ModelPiece {
  PieceId id;
  int panel = 0;
  std::set<Cell> cells;
  AllocationState state = AllocationState::kReserved;
  // What a scan saw of it since it became suspect, and of which map.
  std::optional<std::pair<Seen, std::string>> seen = std::nullopt;
  bool assembled = false;  // somebody laid it at its place, as long as it is cut
  int owed = 0;            // the how manieth booking it is of those that are owed a look; 0: of none
  // The cell that its outline lies in, of wood that was carried over: perhaps one that was sawn off.
  std::optional<Cell> carried_outline = std::nullopt;

  Cell outline_cell() const { return carried_outline ? *carried_outline : *cells.begin(); }
  void doubt() { state = AllocationState::kSuspect, seen.reset(), owed = 0; }
};
// A moment of the model: scans, and what they found, are told apart by it.
inline std::string moment(int tick) { return fmt::format("2026-05-01T07:40:00.{:03}Z", tick); }

// A scan of a panel's show face, and the files that it left.
struct ModelScan {
  int at = 0;
  std::string map, mask;
};
struct ModelPanel {
  std::vector<ModelScan> seen;  // by each version of its mask
  std::string counts = {};      // the file of the newest version: what that scan saw, or as people painted on it
  int mask() const { return static_cast<int>(seen.size()); }
  void count(const ModelScan& scan) { count(scan, scan.mask); }
  void count(const ModelScan& scan, const std::string& file) {
    const ModelScan kept = scan;  // perhaps one of those that were seen
    seen.push_back(kept), counts = file;
  }
  bool retired = false, sawn = false, has_part = false, is_part = false, merged = false;
  std::vector<bool> edits = {};  // of its mask, the oldest first: does it count still?
  std::set<int> tags = {};
  std::vector<std::string> zones = {};       // what each is of
  std::optional<std::string> shelf = {};     // where it lies
  std::vector<int> remnants = {};            // by each that was booked, the version of the mask
  std::optional<std::string> treated = {};   // when last
  int last_scan = 0, scans_when_merged = 0;  // their numbers: of the last one, and of the newest when it got other wood
};
struct ModelJob {
  JobId id;
  JobState state = JobState::kPlanned;
  bool archived = false;
  std::vector<ModelPiece> pieces;

  bool any(AllocationState wanted) const {
    return std::any_of(pieces.begin(), pieces.end(), [&](const auto& p) { return p.state == wanted; });
  }
  bool any_open() const {
    return any(AllocationState::kReserved) || any(AllocationState::kCutting) || any(AllocationState::kSuspect);
  }
  JobState after(JobState otherwise) const { return any_open() ? otherwise : JobState::kComplete; }
};
struct ModelPlan {
  PlanId id;
  std::vector<ModelPiece> pieces;
  std::vector<int> masks;  // of the panels, when it was made
  bool has_job = false;
  std::optional<std::string> lease;  // until when; until somebody ends it

  bool leases(int panel, const std::set<Cell>& cells, const std::string& at) const {
    return lease && *lease > at && std::any_of(pieces.begin(), pieces.end(), [&](const ModelPiece& piece) {
             return piece.panel == panel &&
                    std::any_of(cells.begin(), cells.end(), [&](const Cell& c) { return piece.cells.contains(c); });
           });
  }
};
struct ModelDifference {
  DifferenceId id;
  int panel = 0;
  Cell cell;
  int found = 0;  // when
  bool gone = false, open = true, accepted = false;
  // Not seen by a scan of that moment; or the one that found it was taken back, by a person.
  std::optional<int> unseen = std::nullopt;
  bool taken_back = false;
};
struct ModelProposal {
  std::optional<int> panel;  // nothing: a first scan
  int after = 0;             // of a known panel, the mask that counted
  std::set<int> tags;        // of a first scan
  std::optional<ProposalVerdict> verdict;
};
struct ModelRun {
  RunId id;
  std::size_t job = 0;
  int panel = 0;
  RunFacts facts = {};
  bool looks = false;  // its panel was seen where it has to lie, once at least
};
struct ModelCredential {
  std::string secret, user;
  bool session = false;
};

inline Region<PanelFrame> area_of(const std::set<Cell>& cells) {
  std::vector<Region<PanelFrame>> squares;
  squares.reserve(cells.size());
  for (const auto& [x, y] : cells) squares.emplace_back(square(x * kCell, y * kCell, kCell));
  return unite(squares);
}

// A connected blob of cells, grown from a random one.
inline std::set<Cell> random_cells() {
  std::set<Cell> cells = {{*in_range(0, kGrid), *in_range(0, kGrid)}};
  const int size = *in_range(1, 6);
  for (int i = 1; i < size; ++i) {
    auto [x, y] = *rc::gen::elementOf(cells);
    (*rc::gen::arbitrary<bool>() ? x : y) += *rc::gen::arbitrary<bool>() ? 1 : -1;
    if (x >= 0 && y >= 0 && x < kGrid && y < kGrid) cells.insert({x, y});
  }
  return cells;
}

// What somebody said of a piece, and so of the wood that it had then.
struct ModelVerdict {
  PieceId piece;
  AllocationState verdict = AllocationState::kCut;
  bool as_seen = false;
  std::string who;
};

// A value: what was known when a backup was made is known again once that is put back.
struct ModelledKnowledge {
  std::vector<PanelId> panels_;
  std::vector<ModelPanel> known_;  // of panels_
  std::vector<ModelPlan> plans_;
  std::vector<ModelJob> jobs_;
  std::vector<JobId> queue_said_;        // as people ordered it last
  std::vector<ModelPiece> ruined_;       // written off, or what pieces were cut from before they were made again
  std::vector<ModelPiece> written_off_;  // boxes of differences, in the middle of their cells
  std::vector<ModelDifference> differences_;
  std::vector<ModelProposal> proposals_;  // the n-th has the number n + 1
  std::optional<ModelRun> run_;
  std::vector<ModelRun> runs_;  // all of them; run_ is the last one, as long as it is on
  int bookings_ = 0;
  std::vector<ModelVerdict> verdicts_;  // in the order in which they were said
  std::vector<PieceId> kept_cuts_;      // of the last run
  bool clear_owed_ = false;             // the newest abort
  bool at_work_ = false;                // something is under way
  int tick_ = 0;                        // the last moment
  int scans_ = 0;                       // rows of raw scans, of all panels
  int next_tag_ = 601;
  std::optional<int> scans_when_restored_;
  std::map<std::string, std::pair<std::optional<std::string>, std::optional<std::string>>> woods_;  // names, origins
  std::map<std::pair<std::string, Operation>, double> recipes_;                                     // speeds
  std::vector<CertificateId> certificates_;
  std::map<std::string, std::string> users_;  // and their roles
  std::vector<ModelCredential> credentials_;  // the oldest first
  int secrets_ = 0;
  std::map<std::string, std::string> requests_;  // by key, what was asked for
};

class ModelledWood : protected ModelledKnowledge {
 protected:
  ModelledWood() {
    for (int i = 0; i < 2; ++i) know_panel(cell_.new_panel());
  }
  ModelPanel& know_panel(const PanelId& id) {
    const PanelRecord as_entered = sheet(id);
    panels_.push_back(id);
    return known_.emplace_back(ModelPanel{{{0, as_entered.map_file, as_entered.mask_file}}, as_entered.mask_file});
  }
  // Its map tells it from others. Of one of two masks, for who looks at them.
  ModelScan next_scan() {
    const bool less = *in_range(0, 3) == 0;
    return {++tick_, fmt::format("map-{}", tick_), less ? "mask-less" : "mask"};
  }

  template <class T>
  static std::vector<T*> pointers(std::vector<T>& all) {
    std::vector<T*> out;
    for (T& one : all) out.push_back(&one);
    return out;
  }
  // By another piece, or under the lease of another plan than `own` that is not over `at` this time.
  bool taken(int panel, const std::set<Cell>& cells, const ModelJob& asking, const std::string& at,
             const ModelPlan* own = nullptr) const {
    for (const ModelPlan& plan : plans_)
      if (&plan != own && plan.leases(panel, cells, at)) return true;
    const auto clash = [&](const ModelJob& job) {
      return std::any_of(job.pieces.begin(), job.pieces.end(), [&](const ModelPiece& other) {
        return other.panel == panel && other.state != AllocationState::kReleased &&
               std::any_of(cells.begin(), cells.end(), [&](const Cell& c) { return other.cells.count(c) > 0; });
      });
    };
    ModelJob gone, boxes;
    gone.pieces = ruined_;
    boxes.pieces = written_off_;
    return clash(asking) || clash(gone) || clash(boxes) || std::any_of(jobs_.begin(), jobs_.end(), clash);
  }
  // A scan of it may change its wood, and nobody has decided.
  bool waits(int panel) const {
    return std::any_of(proposals_.begin(), proposals_.end(),
                       [&](const ModelProposal& p) { return p.panel == panel && !p.verdict; });
  }
  // Was it seen by the scan whose map is the newest of its panel?
  bool counts(const ModelPiece& piece) const {
    return piece.seen && piece.seen->second == known_[static_cast<std::size_t>(piece.panel)].seen.back().map;
  }
  // What is there of its wood nobody knows until it is scanned, or a scan of it is decided.
  bool is_unseen(int panel) const {
    const ModelPanel& known = known_[static_cast<std::size_t>(panel)];
    return waits(panel) || (known.scans_when_merged > 0 && known.scans_when_merged >= known.last_scan) ||
           (scans_when_restored_ && *scans_when_restored_ >= known.last_scan);
  }
  // Nothing is planned from it: unseen, or sanded or finished since what counts was scanned.
  bool is_to_scan(int panel) const {
    const ModelPanel& known = known_[static_cast<std::size_t>(panel)];
    const int at = known.seen.back().at;
    return is_unseen(panel) || (known.treated && *known.treated > (at == 0 ? kNow : moment(at)));
  }
  // Why wood could not be had for these pieces.
  bool says_why(const Error& error, const std::vector<ModelPiece>& pieces) const {
    if (doubted_) return error.code == ErrorCode::kUnavailable;
    const bool any_is_to_scan =
        std::any_of(pieces.begin(), pieces.end(), [&](const ModelPiece& piece) { return is_to_scan(piece.panel); });
    return error.code == ErrorCode::kConflict || (any_is_to_scan && error.code == ErrorCode::kRefused);
  }

  int any_panel() const { return *in_range(0, static_cast<int>(panels_.size())); }
  std::size_t index_of(const PanelId& panel) const {
    return static_cast<std::size_t>(std::find(panels_.begin(), panels_.end(), panel) - panels_.begin());
  }
  std::vector<int> masks() const {
    std::vector<int> out;
    for (const ModelPanel& panel : known_) out.push_back(panel.mask());
    return out;
  }
  // Leases whose time has come end with whatever is done next.
  std::size_t expire(const std::string& at) {
    std::size_t count = 0;
    for (ModelPlan& plan : plans_)
      if (plan.lease && *plan.lease <= at) plan.lease.reset(), ++count;
    return count;
  }
  // Is any of its wood to be cut, in doubt, or leased beyond this time?
  bool is_held(int panel, const std::string& at) const {
    bool held = false;
    for (const ModelJob& job : jobs_)
      for (const ModelPiece& piece : job.pieces)
        held = held || (piece.panel == panel &&
                        (piece.state == AllocationState::kReserved || piece.state == AllocationState::kCutting ||
                         piece.state == AllocationState::kSuspect));
    for (const ModelPlan& plan : plans_)
      for (const ModelPiece& piece : plan.pieces)
        held = held || (piece.panel == panel && plan.leases(panel, piece.cells, at));
    return held;
  }
  ModelPiece* random_piece() {
    std::vector<ModelPiece*> all;
    for (auto& job : jobs_)
      for (auto& piece : job.pieces) all.push_back(&piece);
    return all.empty() ? nullptr : *rc::gen::elementOf(all);
  }
  // Three times of four one of those that are so, where there is one: most commands would be refused otherwise.
  template <class T, class Condition>
  static T* mostly(std::vector<T>& all, const Condition& is_so) {
    if (all.empty()) return nullptr;
    std::vector<T*> wanted;
    for (T& one : all)
      if (is_so(one)) wanted.push_back(&one);
    if (wanted.empty() || *in_range(0, 4) == 0) wanted = pointers(all);
    return *rc::gen::elementOf(wanted);
  }
  template <class Condition>
  ModelPiece* mostly_a_piece(const Condition& is_so) {
    std::vector<ModelPiece*> wanted;
    for (ModelJob& job : jobs_)
      for (ModelPiece& piece : job.pieces)
        if (is_so(piece)) wanted.push_back(&piece);
    return wanted.empty() || *in_range(0, 4) == 0 ? random_piece() : *rc::gen::elementOf(wanted);
  }
  std::vector<ModelPiece*> random_pieces() {
    std::vector<ModelPiece*> out;
    for (int i = 0, n = *in_range(0, 4); i < n; ++i)
      if (ModelPiece* piece = random_piece()) out.push_back(piece);
    return out;
  }
  static std::vector<PieceId> ids_of(const std::vector<ModelPiece*>& pieces) {
    std::vector<PieceId> out;
    for (const ModelPiece* piece : pieces) out.push_back(piece->id);
    return out;
  }
  void doubt(const std::vector<ModelPiece*>& pieces) {
    for (ModelPiece* piece : pieces) {
      if (piece->state != AllocationState::kReserved && piece->state != AllocationState::kCut) continue;
      piece->doubt();
      for (ModelJob& job : jobs_)
        if (has(job, *piece) && job.state == JobState::kComplete) job.state = JobState::kStopped;
    }
  }
  static bool has(const ModelJob& job, const ModelPiece& piece) {
    return &piece >= job.pieces.data() && &piece < job.pieces.data() + job.pieces.size();
  }
  bool in_run(const ModelPiece& piece) const {
    return run_ && piece.panel == run_->panel && has(jobs_[run_->job], piece);
  }
  static void suspect_what_was_cutting(ModelJob& job) {
    for (auto& piece : job.pieces)
      if (piece.state == AllocationState::kCutting) piece.doubt();
  }

  void reopen() {
    cell_.reopen();
    if (opened_) opened_(cell_.database());
  }

  CellDatabase cell_;
  std::function<void(Database&)> opened_;
  bool doubted_ = false;  // another program has written, and nobody has checked what
};

}  // namespace veneer::db
