#include "daemon/plans/plan_web.h"

#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>

#include "base/polygon_ops.h"

namespace veneer::daemon {
namespace {

// What rounding to whole micrometres may take of the web, several times over.
constexpr Millimetres kRounding{0.01};

struct Allocated {
  Region<PanelFrame> area;
  Box<PanelFrame> box;
};

Box<PanelFrame> box_of(const Region<PanelFrame>& area) {
  Box<PanelFrame> box;
  for (const auto& ring : area.rings())
    for (const auto& p : ring) box.add(p);
  return box;
}

Result<std::vector<Allocated>> allocated_on(Repositories& repositories, const PanelId& panel, db::PlanId plan) {
  const auto live = repositories.ledger.live_allocations(panel);
  if (!live) return live.error();
  std::vector<Allocated> out;
  for (const auto& allocation : *live)
    if (plan.value == 0 || allocation.leased_to != plan) out.push_back({allocation.area, box_of(allocation.area)});
  return out;
}

bool apart(const Box<PanelFrame>& a, const Box<PanelFrame>& b) {
  return a.min.x > b.max.x || b.min.x > a.max.x || a.min.y > b.max.y || b.min.y > a.max.y;
}

}  // namespace

Status keeps_web(Repositories& repositories, const std::string& options_json,
                 const std::vector<db::PlannedPatch>& pieces, db::PlanId plan) {
  const auto options = nlohmann::json::parse(options_json, nullptr, false);
  const auto asked = options.find("web_mm");
  if (asked == options.end() || !asked->is_number()) return Ok();
  const Millimetres web(asked->get<double>());
  if (web <= kRounding) return Ok();
  std::map<PanelId, std::vector<Allocated>> on_panels;
  for (const db::PlannedPatch& piece : pieces) {
    if (!piece.panel) continue;
    auto known = on_panels.find(*piece.panel);
    if (known == on_panels.end()) {
      auto allocated = allocated_on(repositories, *piece.panel, plan);
      if (!allocated) return allocated.error();
      known = on_panels.emplace(*piece.panel, std::move(*allocated)).first;
    }
    const Region<PanelFrame> wide = offset(piece.allocation, web - kRounding);
    const Box<PanelFrame> box = box_of(wide);
    for (const Allocated& other : known->second)
      if (!apart(box, other.box) && overlaps(wide, other.area))
        return Error{ErrorCode::kConflict,
                     fmt::format("piece {} would leave less than {} mm of wood beside what is cut or reserved on panel "
                                 "{} by now, and chips might fall out there: plan again with the free wood",
                                 piece.mark, web.count(), piece.panel->value)};
  }
  return Ok();
}

}  // namespace veneer::daemon
