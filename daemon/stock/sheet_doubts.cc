#include "daemon/stock/sheet_doubts.h"

#include <fmt/format.h>

#include "calib/hole_tie.h"

namespace veneer::daemon {
namespace {

constexpr double kSameSheet = 0.04;  // mm RMS, of two scans of one sheet

}  // namespace

std::vector<ScanWarning> doubts_about_sheet(const calib::PanelFiducials& sheet,
                                            const std::map<PanelId, calib::PanelFiducials>& stock) {
  const auto places = [](const calib::PanelFiducials& fiducials) {
    std::vector<Point<PanelFrame>> out;
    for (const auto& hole : fiducials.holes) out.push_back(hole.centre);
    return out;
  };
  std::vector<ScanWarning> out;
  const auto here = places(sheet);
  for (const auto& [id, known] : stock) {
    const auto there = places(known);
    const auto tie = calib::match_holes<PanelFrame, PanelFrame>(there, here);
    if (!tie || tie->residual.rms > kSameSheet || tie->pairs.size() < here.size()) continue;
    if (tie->to_from.handedness() == Handedness::kImproper)
      out.push_back(
          {"wrong-face",
           fmt::format("its holes lie as those of panel {0} seen from the other side: this is the back of that "
                       "panel, or a sheet drilled with it. Refuse this, and run `veneerctl panel scan --face "
                       "back --panel {0}`",
                       id.value)});
    else
      out.push_back({"same-sheet", fmt::format("its holes lie as those of panel {}, which is in stock with other tags: "
                                               "is this the same sheet? Then `veneerctl panel merge` makes them one",
                                               id.value)});
    break;
  }
  return out;
}

}  // namespace veneer::daemon
