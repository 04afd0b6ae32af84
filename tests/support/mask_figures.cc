#include "tests/support/mask_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace veneer::workshop {

Order campaign_order(std::uint64_t seed, int i, const std::filesystem::path& woods) {
  constexpr double kResolutions[] = {300, 200, 150, 240};
  Order order;
  order.seed = seed * 100'003 + static_cast<std::uint64_t>(i);
  order.board = i;
  order.dpi = kResolutions[i / kBoards % 4];
  order.width = 180 + 20 * (i % 5), order.height = 130 + 15 * (i % 4);
  order.woods = woods;
  return order;
}

void MaskFigures::add(const PanelVerdict& verdict) {
  ++panels;
  seconds += verdict.seconds;
  false_warnings += verdict.false_warnings;
  if (!verdict.refused.empty()) ++refused;
  if (verdict.refused.empty() && verdict.outline_error > kOutline) ++wrong_outline;
  for (const auto& strip : verdict.strips) {
    ++strips;
    asked_in_all += strip.asked ? 1 : 0;
    if (is_asked_about(strip)) {
      ++asked;
      continue;
    }
    failed += holds(strip) ? 0 : 1;
    precision_min = std::min(precision_min, strip.precision), recall_min = std::min(recall_min, strip.recall);
  }
  for (const auto& [fault, taken] : verdict.faults) {
    if (fault.matter == Matter::kCrack) {
      if (fault.size < kWideCrack) continue;
      ++cracks, cracks_in_mask += taken > 0.5 ? 1 : 0;
    } else if (fault.size >= kRoundFault) {
      ++round_faults, round_in_mask += taken > 0.02 ? 1 : 0;
    }
  }
  hair += verdict.hair, hair_in_mask += verdict.hair_in_mask;
  haired += verdict.hair > 0 ? 1 : 0;
  hairs_told += verdict.hair > 0 && verdict.hairs_told > 0 ? 1 : 0;
  false_hairs += verdict.hair == 0 && verdict.hairs_told > 0 ? 1 : 0;
}

void MaskFigures::add(const MaskFigures& other) {
  panels += other.panels, refused += other.refused, wrong_outline += other.wrong_outline;
  strips += other.strips, failed += other.failed;
  asked += other.asked, asked_in_all += other.asked_in_all, false_warnings += other.false_warnings;
  precision_min = std::min(precision_min, other.precision_min), recall_min = std::min(recall_min, other.recall_min);
  round_faults += other.round_faults, round_in_mask += other.round_in_mask;
  cracks += other.cracks, cracks_in_mask += other.cracks_in_mask;
  haired += other.haired, hairs_told += other.hairs_told, false_hairs += other.false_hairs;
  hair += other.hair, hair_in_mask += other.hair_in_mask, seconds += other.seconds;
}

std::string table_head() {
  return fmt::format("{:<18} {:>6} {:>7} {:>7} {:>6} {:>6} {:>5} {:>6} {:>5} {:>9} {:>7} {:>13} {:>12} {:>16} {:>6}\n",
                     "board", "panels", "refused", "outline", "strips", "missed", "asked", "in all", "false",
                     "precision", "recall", "round in mask", "wide cracks", "hairs in mask", "s");
}

std::string table_line(const std::string& name, const MaskFigures& f) {
  return fmt::format(
      "{:<18} {:>6} {:>7} {:>7} {:>6} {:>6} {:>5} {:>6} {:>5} {:>9.4f} {:>7.4f} {:>5} of {:<4} {:>4} of {:<4} "
      "{:>5.1f} % {:>3}/{:<3} {:>6.2f}\n",
      name, f.panels, f.refused, f.wrong_outline, f.strips, f.failed, f.asked, f.asked_in_all,
      f.false_warnings + f.false_hairs, f.precision_min, f.recall_min, f.round_in_mask, f.round_faults,
      f.cracks_in_mask, f.cracks, f.hair > 0 ? 100 * f.hair_in_mask / f.hair : 0.0, f.hairs_told, f.haired,
      f.seconds / std::max(1, f.panels));
}

nlohmann::json to_json(const MaskFigures& f) {
  return {{"panels", f.panels},
          {"refused", f.refused},
          {"wrong_outline", f.wrong_outline},
          {"strips", f.strips},
          {"failed", f.failed},
          {"asked", f.asked},
          {"asked_in_all", f.asked_in_all},
          {"false_warnings", f.false_warnings},
          {"precision_min", f.precision_min},
          {"recall_min", f.recall_min},
          {"screws_and_holes", f.round_faults},
          {"screws_and_holes_in_mask", f.round_in_mask},
          {"cracks", f.cracks},
          {"cracks_in_mask", f.cracks_in_mask},
          {"panels_with_hairs", f.haired},
          {"panels_whose_hairs_are_told", f.hairs_told},
          {"false_hairs", f.false_hairs},
          {"share_of_hairs_in_mask", f.hair > 0 ? f.hair_in_mask / f.hair : 0.0},
          {"seconds_per_panel", f.seconds / std::max(1, f.panels)}};
}

}  // namespace veneer::workshop
