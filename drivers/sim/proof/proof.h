// The proof: what the cell claims against the twin's truth (docs/ARCHITECTURE.md, "The twin"). It shares no geometry
// with the cell and reads the marks by OCR; every figure comes from the physical truth alone.
#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>

#include "drivers/sim/proof/assembly.h"
#include "drivers/sim/proof/ledger_proof.h"
#include "drivers/sim/proof/placement_proof.h"

namespace veneer::proof {

struct PanelProof {
  std::string panel;
  std::optional<Residual> registration;
  std::string note;  // why there is none
};

struct PoseProof {
  std::string panel;
  std::optional<Residual> pose;
};

// The real pieces of one sheet's back, by panel; kept for the pictures.
struct SheetProof {
  std::string panel;
  cv::Mat back;  // the sheet's back after all burns, as its viewer sees it; BGR
};

struct Proof {
  std::vector<PanelProof> registration;
  std::vector<PoseProof> poses;
  std::vector<long> job_numbers;
  std::vector<JobProof> jobs;
  std::vector<std::optional<bool>> ledger_matches;  // per job; nothing without a ledger
  std::optional<std::vector<std::string>>
      untrue_panels;  // whose ledger is not what was burnt; nothing without a ledger
  std::vector<SheetProof> sheets;
  std::size_t unclaimed_cuts = 0;  // cut out where neither a job nor the ledger claims a piece
  // Scans that the cell says it took of a panel, of which the twin knows nothing, or that it took of another sheet.
  std::size_t unattributed_scans = 0;
  std::optional<std::size_t> wood_used_twice;  // pieces; nothing without a ledger
  std::vector<std::string> notes;
};

// `threads` 0: as many as the machine has.
Result<Proof> prove(const Truth& truth, const Claims& claims, int threads);

// The fields of docs/FILES.md that come from truth, null where the claims have nothing to judge.
nlohmann::json to_json(const Proof& proof);

// proof.json, back-PANEL.png, assembled-JOB.png, side-by-side-JOB.png (assembled left, preview right).
Status write_proof(const Proof& proof, const std::filesystem::path& dir);

}  // namespace veneer::proof
