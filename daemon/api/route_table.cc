#include "daemon/api/route_table.h"

#include <algorithm>
#include <array>

namespace veneer::daemon {
namespace {

constexpr std::array kOperations = {
    ApiOperation{"getStatus", "GET", "/api/v1/status", Role::kViewer},
    ApiOperation{"getSession", "GET", "/api/v1/session", Role::kViewer},
    ApiOperation{"openSession", "POST", "/api/v1/session", Role::kViewer, Takes::kJson},
    ApiOperation{"stop", "POST", "/api/v1/stop", Role::kViewer},
    ApiOperation{"command", "POST", "/api/v1/commands/{command}", Role::kOperator, Takes::kJson},
    ApiOperation{"scan", "POST", "/api/v1/scans", Role::kOperator, Takes::kJson},
    ApiOperation{"findScanners", "POST", "/api/v1/scanners", Role::kOperator},
    ApiOperation{"listPanels", "GET", "/api/v1/panels", Role::kViewer, Takes::kQuery},
    ApiOperation{"getPanel", "GET", "/api/v1/panels/{id}", Role::kViewer},
    ApiOperation{"getPanelMap", "GET", "/api/v1/panels/{id}/map.png", Role::kViewer, Takes::kQuery},
    ApiOperation{"getPanelStock", "GET", "/api/v1/panels/{id}/stock.png", Role::kViewer, Takes::kQuery},
    ApiOperation{"printGrid", "GET", "/api/v1/fiducials/grid", Role::kViewer, Takes::kQuery},
    ApiOperation{"printPanelTags", "GET", "/api/v1/fiducials/panel", Role::kViewer, Takes::kQuery},
    ApiOperation{"getPanelLabel", "GET", "/api/v1/panels/{id}/label", Role::kViewer, Takes::kQuery},
    ApiOperation{"getPanelRemnant", "GET", "/api/v1/panels/{id}/remnant.png", Role::kViewer, Takes::kQuery},
    ApiOperation{"getPanelRegistration", "GET", "/api/v1/panels/{id}/registration", Role::kViewer, Takes::kQuery},
    ApiOperation{"getPanelPlace", "GET", "/api/v1/panels/{id}/place", Role::kViewer, Takes::kQuery},
    ApiOperation{"getPanelLedger", "GET", "/api/v1/panels/{id}/ledger", Role::kViewer, Takes::kQuery},
    ApiOperation{"setPanelMaterial", "POST", "/api/v1/panels/{id}/material", Role::kOperator, Takes::kJson},
    ApiOperation{"getPanelFacts", "GET", "/api/v1/panels/{id}/facts", Role::kViewer},
    ApiOperation{"setPanelFacts", "POST", "/api/v1/panels/{id}/facts", Role::kOperator, Takes::kJson},
    ApiOperation{"listMaterials", "GET", "/api/v1/materials", Role::kViewer},
    ApiOperation{"getMaterial", "GET", "/api/v1/materials/{material}", Role::kViewer},
    ApiOperation{"setMaterial", "POST", "/api/v1/materials/{material}", Role::kOperator, Takes::kJson},
    ApiOperation{"getPanelMasks", "GET", "/api/v1/panels/{id}/masks", Role::kViewer},
    ApiOperation{"revertPanel", "POST", "/api/v1/panels/{id}/revert", Role::kOperator, Takes::kJson},
    ApiOperation{"getPanelDifferences", "GET", "/api/v1/panels/{id}/differences", Role::kViewer, Takes::kQuery},
    ApiOperation{"decideDifference", "POST", "/api/v1/panels/{id}/differences/{number}/decide", Role::kOperator,
                 Takes::kJson},
    ApiOperation{"retirePanel", "POST", "/api/v1/panels/{id}/retire", Role::kOperator, Takes::kJson},
    ApiOperation{"splitPanel", "POST", "/api/v1/panels/{id}/split", Role::kOperator, Takes::kJson},
    ApiOperation{"restorePanel", "POST", "/api/v1/panels/{id}/restore", Role::kOperator, Takes::kJson},
    ApiOperation{"listRecipes", "GET", "/api/v1/recipes", Role::kViewer},
    ApiOperation{"setRecipe", "POST", "/api/v1/recipes/{material}/{operation}", Role::kOperator, Takes::kJson},
    ApiOperation{"removeRecipe", "DELETE", "/api/v1/recipes/{material}/{operation}", Role::kOperator},
    ApiOperation{"drawTestCard", "POST", "/api/v1/test-card", Role::kOperator, Takes::kJson},
    ApiOperation{"burnTestCard", "POST", "/api/v1/laser/test-card", Role::kOperator, Takes::kJson},
    ApiOperation{"getJobEgv", "GET", "/api/v1/jobs/{id}/cut.egv", Role::kViewer, Takes::kQuery},
    ApiOperation{"calibrate", "POST", "/api/v1/calibration/{device}", Role::kOperator, Takes::kJson},
    ApiOperation{"laserTestPattern", "POST", "/api/v1/laser/test-pattern", Role::kOperator, Takes::kJson},
    ApiOperation{"laserRun", "POST", "/api/v1/laser/run", Role::kOperator, Takes::kDrawing},
    ApiOperation{"laserCorner", "POST", "/api/v1/laser/corner", Role::kOperator},
    ApiOperation{"laserJog", "POST", "/api/v1/laser/jog", Role::kOperator, Takes::kJson},
    ApiOperation{"laserJogStop", "POST", "/api/v1/laser/jog/stop", Role::kOperator},
    ApiOperation{"laserOverrides", "POST", "/api/v1/laser/overrides", Role::kOperator, Takes::kJson},
    ApiOperation{"listCertificates", "GET", "/api/v1/certificates", Role::kViewer, Takes::kQuery},
    ApiOperation{"newPlan", "POST", "/api/v1/plans", Role::kOperator, Takes::kPictureAndQuery},
    ApiOperation{"listPlans", "GET", "/api/v1/plans", Role::kViewer, Takes::kQuery},
    ApiOperation{"getPlan", "GET", "/api/v1/plans/{id}", Role::kViewer},
    ApiOperation{"getPlanPieces", "GET", "/api/v1/plans/{id}/pieces", Role::kViewer, Takes::kQuery},
    ApiOperation{"getPlanPreview", "GET", "/api/v1/plans/{id}/preview.png", Role::kViewer, Takes::kQuery},
    ApiOperation{"getPlanMap", "GET", "/api/v1/plans/{id}/map", Role::kViewer, Takes::kQuery},
    ApiOperation{"getPlanFile", "GET", "/api/v1/plans/{id}/plan.json", Role::kViewer},
    ApiOperation{"changePlan", "POST", "/api/v1/plans/{id}/changes", Role::kOperator, Takes::kJson},
    ApiOperation{"leasePlan", "POST", "/api/v1/plans/{id}/lease", Role::kOperator, Takes::kJson},
    ApiOperation{"releasePlan", "DELETE", "/api/v1/plans/{id}/lease", Role::kOperator},
    ApiOperation{"removePlan", "DELETE", "/api/v1/plans/{id}", Role::kOperator},
    ApiOperation{"newJob", "POST", "/api/v1/jobs", Role::kOperator, Takes::kPictureAndQuery},
    ApiOperation{"listJobs", "GET", "/api/v1/jobs", Role::kViewer, Takes::kQuery},
    ApiOperation{"getJob", "GET", "/api/v1/jobs/{id}", Role::kViewer},
    ApiOperation{"getPiece", "GET", "/api/v1/pieces/{id}", Role::kViewer},
    ApiOperation{"getPiecePicture", "GET", "/api/v1/pieces/{id}/picture.png", Role::kViewer, Takes::kQuery},
    ApiOperation{"getPieceByMark", "GET", "/api/v1/jobs/{id}/pieces/{mark}", Role::kViewer},
    ApiOperation{"getJobPieces", "GET", "/api/v1/jobs/{id}/pieces", Role::kViewer, Takes::kQuery},
    ApiOperation{"getJobPreview", "GET", "/api/v1/jobs/{id}/preview.png", Role::kViewer, Takes::kQuery},
    ApiOperation{"getJobMap", "GET", "/api/v1/jobs/{id}/map", Role::kViewer, Takes::kQuery},
    ApiOperation{"getJobPlan", "GET", "/api/v1/jobs/{id}/plan.json", Role::kViewer},
    ApiOperation{"startJob", "POST", "/api/v1/jobs/{id}/start", Role::kOperator},
    ApiOperation{"redo", "POST", "/api/v1/jobs/{id}/redo", Role::kOperator, Takes::kJson},
    ApiOperation{"recut", "POST", "/api/v1/jobs/{id}/recut", Role::kOperator, Takes::kJson},
    ApiOperation{"cancelJob", "POST", "/api/v1/jobs/{id}/cancel", Role::kOperator},
    ApiOperation{"archiveDoneJobs", "POST", "/api/v1/jobs/archive-done", Role::kOperator},
    ApiOperation{"archiveJob", "POST", "/api/v1/jobs/{id}/archive", Role::kOperator},
    ApiOperation{"unarchiveJob", "POST", "/api/v1/jobs/{id}/unarchive", Role::kOperator},
    ApiOperation{"settlePiece", "POST", "/api/v1/jobs/{id}/pieces/{mark}/settle", Role::kOperator, Takes::kJson},
    ApiOperation{"checkIntegrity", "POST", "/api/v1/integrity-check", Role::kOperator},
    ApiOperation{"makeBackup", "POST", "/api/v1/backups", Role::kOperator},
    ApiOperation{"listBackups", "GET", "/api/v1/backups", Role::kViewer},
    ApiOperation{"getAudit", "GET", "/api/v1/audit", Role::kViewer, Takes::kQuery},
    ApiOperation{"getHistory", "GET", "/api/v1/history", Role::kViewer, Takes::kQuery},
    ApiOperation{"listTasks", "GET", "/api/v1/tasks", Role::kViewer},
    ApiOperation{"getTask", "GET", "/api/v1/tasks/{id}", Role::kViewer},
    ApiOperation{"cancelTask", "DELETE", "/api/v1/tasks/{id}", Role::kOperator},
    ApiOperation{"getBedPicture", "GET", "/api/v1/bed.jpg", Role::kViewer},
    ApiOperation{"getBedToolpath", "GET", "/api/v1/bed/toolpath", Role::kViewer},
    ApiOperation{"newConsoleLink", "POST", "/api/v1/console-links", Role::kOperator},
    ApiOperation{"getEvents", "GET", "/api/v1/events", Role::kViewer},
};

}  // namespace

std::span<const ApiOperation> api_operations() { return kOperations; }

const ApiOperation* find_operation(std::string_view id) {
  const auto* found = std::ranges::find(kOperations, id, &ApiOperation::id);
  return found == kOperations.end() ? nullptr : found;
}

}  // namespace veneer::daemon
