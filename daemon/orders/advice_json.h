// Advice before planning as JSON between the daemon and its worker processes, for the few sources that write or read
// it.
#pragma once

#include "daemon/orders/advice_work.h"
#include "daemon/orders/job_wood_json.h"
#include "daemon/orders/records_json.h"

namespace veneer::daemon {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(GiveAdvice, name, picture, crop, size, options, importance, threads, kerf, wood,
                                   recipes)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(AdvisedPicture, crop, layout, size_mm, width_mm, height_mm, patch_mm, pieces,
                                   unfilled, likeness, cutting_s, preview)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(AdviceGiven, suggestions, suggested, remarks)

}  // namespace veneer::daemon
