// Records as the API tells them (docs/openapi.json). Pure.
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "daemon/calibration_service.h"
#include "daemon/database_thread.h"
#include "daemon/job_runner.h"
#include "daemon/plan_service.h"
#include "daemon/scan_service.h"

namespace veneer::daemon {

template <class Frame>
nlohmann::json points_json(const std::vector<Point<Frame>>& points) {
  nlohmann::json out = nlohmann::json::array();
  for (const auto& p : points) out.push_back({p.x.count(), p.y.count()});
  return out;
}

// What GET /panels/{id} adds to the record; areas in mm2.
struct PanelFigures {
  double usable = 0, reserved = 0, cut = 0;
  int pieces = 0;
  bool back_known = false;
  std::optional<Millimetres> rms;
};
nlohmann::json to_json(const db::PanelRecord& panel, const PanelFigures& figures);
nlohmann::json to_json(const std::vector<db::ZoneRecord>& zones);
nlohmann::json to_json(const db::AllocationRecord& allocation, const std::string& mark);
nlohmann::json to_json(const db::JobRecord& job);
nlohmann::json to_json(const db::PieceRecord& piece);
nlohmann::json to_json(const db::RunRecord& run);
nlohmann::json to_json(const db::CertificateRecord& certificate, const std::string& now);
nlohmann::json to_json(const ScanOutcome& outcome);
nlohmann::json to_json(const JobOutcome& outcome);
nlohmann::json to_json(const CalibrationOutcome& outcome);

}  // namespace veneer::daemon
