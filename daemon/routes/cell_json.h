// Records as the API tells them (docs/openapi.json). Pure.
#pragma once

#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "daemon/api/api_message.h"
#include "daemon/calibration/calibration_service.h"
#include "daemon/plans/plan_service.h"
#include "daemon/stock/panel_figures.h"
#include "daemon/stock/remnants.h"
#include "daemon/stock/scan_service.h"
#include "daemon/store/database_thread.h"
#include "daemon/unit/cell_view.h"

namespace veneer::daemon {

// Who may take a scan into stock against a warning of that name.
Role role_to_overrule(std::string_view warning);

template <class Frame>
nlohmann::json points_json(const std::vector<Point<Frame>>& points) {
  nlohmann::json out = nlohmann::json::array();
  for (const auto& p : points) out.push_back({p.x.count(), p.y.count()});
  return out;
}

nlohmann::json to_json(const db::PanelRecord& panel, const PanelFigures::Figures& figures);
nlohmann::json to_json(const db::PanelFacts& facts);
nlohmann::json to_json(const db::Treatment& treatment);
nlohmann::json to_json(const AreaBook& book);
nlohmann::json to_json(const Remnant& remnant);
nlohmann::json to_json(const std::vector<db::ZoneRecord>& zones);
nlohmann::json to_json(const db::AllocationRecord& allocation, const std::string& mark);
nlohmann::json to_json(const db::JobRecord& job);
// With what the unit does with it, and what is to be done next for it.
nlohmann::json to_json(const db::JobRecord& job, const CellView& view);
nlohmann::json to_json(const db::DifferenceRecord& difference);
nlohmann::json to_json(const db::PlanRecord& plan);
nlohmann::json to_json(const db::PlannedPatch& piece);
nlohmann::json to_json(const db::Sighting& sighting);
nlohmann::json to_json(const db::PieceRecord& piece);
nlohmann::json to_json(const db::RunRecord& run, const db::RunFacts& facts);
nlohmann::json to_json(const JudgedCertificate& certificate);
// Where a part lay in its parent.
nlohmann::json to_json(const db::PartRecord& part);
nlohmann::json to_json(const db::ProposalRecord& proposal);
nlohmann::json to_json(const ScanOutcome& outcome);
nlohmann::json to_json(const JobOutcome& outcome);
nlohmann::json to_json(const CalibrationOutcome& outcome);

}  // namespace veneer::daemon
