// What a function of the planner answers once its stop token was asked to stop: an error, never half of a result.
#pragma once

#include <stop_token>

#include "base/result.h"

namespace veneer::planner {

inline Error cancelled() { return {ErrorCode::kCancelled, "planning was cancelled"}; }

// kCancelled once a stop is requested.
inline Status unless_cancelled(const std::stop_token& stop) { return stop.stop_requested() ? cancelled() : Status(); }

}  // namespace veneer::planner
