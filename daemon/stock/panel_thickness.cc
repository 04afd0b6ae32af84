#include "daemon/stock/panel_thickness.h"

namespace veneer::daemon {

Result<Millimetres> thickness_of(Repositories& repositories, const PanelId& panel, Millimetres configured) {
  const auto facts = repositories.facts.of(panel);
  if (!facts) return facts.error();
  // Of veneer alone nobody knows what it is glued on.
  if (!facts->veneer || !facts->substrate) return configured;
  return *facts->veneer + *facts->substrate;
}

}  // namespace veneer::daemon
