#include "daemon/stock/known_backs.h"

#include <fmt/format.h>

#include <algorithm>

namespace veneer::daemon {

std::string scan_its_back(const PanelId& panel) {
  return fmt::format(
      "the camera finds panel {0} by the tags on its back, and nobody has scanned them: turn it over and run veneerctl "
      "panel scan --face back --panel {0}",
      panel.value);
}

Status backs_are_known(Repositories& repositories, const std::vector<db::PlannedPanel>& panels) {
  for (const db::PlannedPanel& planned : panels) {
    const auto fiducials = repositories.panels.fiducials(planned.panel);
    if (!fiducials) return fiducials.error();
    if (std::none_of(fiducials->begin(), fiducials->end(),
                     [](const db::FiducialRecord& f) { return f.face == Face::kBack; }))
      return Error{ErrorCode::kRefused, scan_its_back(planned.panel)};
  }
  return Ok();
}

}  // namespace veneer::daemon
