// What the campaign of the eyes counts: verdicts on workshop panels, added up.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "tests/support/mask_judge.h"

namespace veneer::workshop {

// The i-th panel of a campaign: boards, woods, sizes and resolutions come round.
Order campaign_order(std::uint64_t seed, int i, const std::filesystem::path& woods);

struct MaskFigures {
  int panels = 0, refused = 0, wrong_outline = 0;             // a sheet's corner off by more than half a millimetre
  int strips = 0, failed = 0, asked = 0, false_warnings = 0;  // asked: instead of missing; the recall is short
  int asked_in_all = 0;                      // strips that the operator is asked about, whatever became of them
  double precision_min = 1, recall_min = 1;  // of strips that are not asked about
  int round_faults = 0, round_in_mask = 0, cracks = 0, cracks_in_mask = 0;  // from 2 mm across, from 0.5 mm wide
  int haired = 0, hairs_told = 0, false_hairs = 0;  // panels: with a hair over wood; told; not true
  double hair = 0, hair_in_mask = 0;                // pixels of hairs over wood
  double seconds = 0;

  void add(const PanelVerdict& verdict);
  void add(const MaskFigures& other);
};

constexpr double kRoundFault = 2, kWideCrack = 0.5, kOutline = 0.5;  // mm

// A line of a table, and that above the first of them.
std::string table_head();
std::string table_line(const std::string& name, const MaskFigures& figures);
nlohmann::json to_json(const MaskFigures& figures);

}  // namespace veneer::workshop
