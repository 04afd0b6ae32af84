// From what was read of a scan to stock: it waits as a proposal until somebody accepts or refuses it, or is entered.
//
// A first scan always waits; so does one that would take more of a panel's free wood, or give more back, than is left
// to nobody's eye. While one of a known panel waits, nothing is planned or cut from that panel. What is accepted enters
// in one transaction with the word that accepted it. Files of decided proposals are removed.
//
// Threading: blocks on files and the database; all on one worker, the scanner's.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/log.h"
#include "base/result.h"
#include "daemon/orders/scan_work.h"
#include "daemon/stock/found_differences.h"
#include "daemon/stock/panel_library.h"
#include "daemon/stock/seen_sheet.h"
#include "daemon/stock/strip_answers.h"
#include "daemon/stock/suspect_sightings.h"
#include "daemon/store/database_thread.h"

namespace veneer::daemon {

struct ScanOutcome {
  std::size_t tiles = 0;         // collected so far
  std::optional<PanelId> panel;  // none while further tiles follow, and of a new sheet that waits to be accepted
  std::optional<db::ProposalId> proposal;  // that waits to be accepted or refused: nothing has changed yet
  bool is_new = false;
  std::optional<PanelId> part_of;  // of a new panel: the one that it was sawn from
  std::size_t carried = 0;         // pieces and scrap of that one that lay in its wood
  Face face = Face::kShow;
  std::optional<Millimetres> rms, max;  // of the registration
  std::optional<Millimetres> left_out;  // the worst fiducial of a later scan, from where the others put it
  std::vector<int> new_tags;            // that became the panel's
  SquareMillimetres usable{0};          // of a show face
  std::size_t zones = 0;
  std::optional<std::vector<FoundDifference>> differences;  // of a show face that was known: against the ledger
  std::vector<SeenSuspect> suspects;                        // of a show face that was known
  Millimetres width{0}, height{0};                          // of a show face: the sheet
  SquareMillimetres lost{0}, gained{0};                     // of a show face that was known: PanelRead
  std::vector<ScanWarning> warnings;                        // of a show face
};

// How much free wood a scan may take from a panel, or give back, before somebody has to look: the greater of the two.
inline constexpr SquareMillimetres kMostUnasked{200};
inline constexpr double kMostUnaskedShare = 0.01;  // of what the mask calls usable

class ScanProposals {
 public:
  // All references outlive this.
  ScanProposals(DatabaseThread& database, const PanelLibrary& library, Logger log)
      : database_(database), library_(library), log_(std::move(log)) {}

  // Warnings that only stock tells are added: wood that would be lost or gained. A known panel whose wood changes less
  // is entered at once, with all warnings told.
  Result<ScanOutcome> propose(SeenSheet seen, const std::string& who);
  // kNotFound; kConflict when it was decided before, or stock has changed since; kRefused when a warning is not among
  // the `overruled`, and is no strip that is answered: the sentence names it. kInvalidArgument: it has no warning of a
  // name that is overruled, or asks about no such strip. What follows from the answers are edits of the mask
  // (db/masks.h), each a version of it behind the scan's, and enters with it. A warning tells of a strip that is wood
  // and no zone: a panel that has zones keeps them.
  Result<ScanOutcome> accept(db::ProposalId proposal, const std::vector<std::string>& overruled, const std::string& who,
                             const StripAnswers& answers = {});
  Status refuse(db::ProposalId proposal, const std::string& note, const std::string& who);

 private:
  Result<SeenSheet> read_back(const db::ProposalRecord& proposal) const;
  // `edits`: that enter behind it.
  Result<ScanOutcome> enter(SeenSheet seen, const std::optional<db::Acceptance>& of, std::vector<db::MaskEdit> edits);
  Result<ScanOutcome> enter_new(const SeenSheet& seen, const PanelId& id, const std::optional<db::Acceptance>& of,
                                const std::vector<db::MaskEdit>& edits);
  Result<ScanOutcome> enter_again(const SeenSheet& seen, const std::optional<db::Acceptance>& of,
                                  const std::vector<db::MaskEdit>& edits);
  Status move_pictures(SeenSheet& seen, const PanelId& panel) const;
  void remove_spent();

  DatabaseThread& database_;
  const PanelLibrary& library_;
  Logger log_;
};

// Of the tags that a scan of a known face added to it.
std::vector<db::FiducialRecord> new_tag_records(const PanelRead& read, Face face);

std::vector<db::ScanRecord> scan_records(const PanelId& panel, Face face, const std::vector<TakenTile>& tiles,
                                         const PanelRead& read);

}  // namespace veneer::daemon
