// Every operation of the API: method, path, who may call it, what it takes. The one place that says who may
// do what; docs/openapi.json describes the same operations, and a test keeps the two equal.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "daemon/api/api_message.h"

namespace veneer::daemon {

inline constexpr std::size_t kNoBody = 1024;  // "{}", where an operation takes none
// Names and passwords. Anybody may send these, and they are read on the loop that answers STOP.
inline constexpr std::size_t kSecretsBody = 4 * 1024;
inline constexpr std::size_t kSmallBody = 64 * 1024;
inline constexpr std::size_t kPictureBody = 64 * 1024 * 1024;
// 500,000 points in strokes of two, as veneerctl writes them (coordinates to 0.1 um, each speed and power of its own),
// are 19 MiB.
inline constexpr std::size_t kDrawingBody = 24 * 1024 * 1024;

// What a request of an operation may carry besides its path. kSecrets is JSON that is written nowhere: no log, no
// audit, no memory of requests that were sent twice.
enum class Takes { kNothing, kQuery, kJson, kSecrets, kDrawing, kDrawingAndQuery, kPictureAndQuery };
constexpr std::size_t max_body(Takes takes) {
  switch (takes) {
    case Takes::kNothing:
    case Takes::kQuery:
      return kNoBody;
    case Takes::kSecrets:
      return kSecretsBody;
    case Takes::kJson:
      return kSmallBody;
    case Takes::kDrawing:
    case Takes::kDrawingAndQuery:
      return kDrawingBody;
    case Takes::kPictureAndQuery:
      return kPictureBody;
  }
  return kNoBody;
}

struct ApiOperation {
  std::string_view id;  // OpenAPI operationId
  std::string_view method;
  std::string_view pattern;  // "/api/v1/jobs/{id}/start"
  Role role = Role::kAdmin;
  Takes takes = Takes::kNothing;
  bool asks = false;  // changes nothing, although it is no GET: noted nowhere, and may be repeated
};

std::span<const ApiOperation> api_operations();
// nullptr when there is none.
const ApiOperation* find_operation(std::string_view id);

}  // namespace veneer::daemon
