#include "daemon/api/route_table.h"

#include <algorithm>
#include <array>

namespace veneer::daemon {
namespace {

constexpr std::array kOperations = {
    ApiOperation{"getStatus", "GET", "/api/v1/status", Role::kViewer},
    ApiOperation{"getSession", "GET", "/api/v1/session", Role::kViewer},
    ApiOperation{"stop", "POST", "/api/v1/stop", Role::kViewer},
    ApiOperation{"command", "POST", "/api/v1/commands/{command}", Role::kOperator},
    ApiOperation{"scan", "POST", "/api/v1/scans", Role::kOperator},
    ApiOperation{"listPanels", "GET", "/api/v1/panels", Role::kViewer},
    ApiOperation{"getPanel", "GET", "/api/v1/panels/{id}", Role::kViewer},
    ApiOperation{"getPanelMap", "GET", "/api/v1/panels/{id}/map.png", Role::kViewer},
    ApiOperation{"getPanelStock", "GET", "/api/v1/panels/{id}/stock.png", Role::kViewer},
    ApiOperation{"getPanelRegistration", "GET", "/api/v1/panels/{id}/registration", Role::kViewer},
    ApiOperation{"getPanelLedger", "GET", "/api/v1/panels/{id}/ledger", Role::kViewer},
    ApiOperation{"setPanelMaterial", "POST", "/api/v1/panels/{id}/material", Role::kOperator},
    ApiOperation{"listRecipes", "GET", "/api/v1/recipes", Role::kViewer},
    ApiOperation{"setRecipe", "POST", "/api/v1/recipes/{material}/{operation}", Role::kOperator},
    ApiOperation{"removeRecipe", "DELETE", "/api/v1/recipes/{material}/{operation}", Role::kOperator},
    ApiOperation{"drawTestCard", "POST", "/api/v1/test-card", Role::kOperator},
    ApiOperation{"burnTestCard", "POST", "/api/v1/laser/test-card", Role::kOperator},
    ApiOperation{"getJobEgv", "GET", "/api/v1/jobs/{id}/cut.egv", Role::kViewer},
    ApiOperation{"calibrate", "POST", "/api/v1/calibration/{device}", Role::kOperator},
    ApiOperation{"laserTestPattern", "POST", "/api/v1/laser/test-pattern", Role::kOperator},
    ApiOperation{"laserJog", "POST", "/api/v1/laser/jog", Role::kOperator},
    ApiOperation{"laserJogStop", "POST", "/api/v1/laser/jog/stop", Role::kOperator},
    ApiOperation{"laserOverrides", "POST", "/api/v1/laser/overrides", Role::kOperator},
    ApiOperation{"listCertificates", "GET", "/api/v1/certificates", Role::kViewer},
    ApiOperation{"newJob", "POST", "/api/v1/jobs", Role::kOperator, kPictureBody},
    ApiOperation{"listJobs", "GET", "/api/v1/jobs", Role::kViewer},
    ApiOperation{"getJob", "GET", "/api/v1/jobs/{id}", Role::kViewer},
    ApiOperation{"getJobPieces", "GET", "/api/v1/jobs/{id}/pieces", Role::kViewer},
    ApiOperation{"getJobPreview", "GET", "/api/v1/jobs/{id}/preview.png", Role::kViewer},
    ApiOperation{"getJobPlan", "GET", "/api/v1/jobs/{id}/plan.json", Role::kViewer},
    ApiOperation{"startJob", "POST", "/api/v1/jobs/{id}/start", Role::kOperator},
    ApiOperation{"recut", "POST", "/api/v1/jobs/{id}/recut", Role::kOperator},
    ApiOperation{"cancelJob", "POST", "/api/v1/jobs/{id}/cancel", Role::kOperator},
    ApiOperation{"settlePiece", "POST", "/api/v1/jobs/{id}/pieces/{mark}/settle", Role::kOperator},
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
