// Requests for every operation of the API, as those send them who mean no good: in pieces, too large, or to hang up on.
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include "daemon/api/route_table.h"

namespace veneer::testing {

// The path of an operation, its parameters filled in so that there is something at its end in the stock of a campaign
// (prepare_stop_data): the first panel has pieces, the second one pictures.
inline std::string path_of(const daemon::ApiOperation& operation) {
  std::string path(operation.pattern);
  const bool picture = path.ends_with(".png") || path.find("/mask") != std::string::npos;
  const std::string_view id = !path.starts_with("/api/v1/panels/") ? "1" : picture ? "P-0002" : "P-0001";
  for (const auto& [hole, value] : {std::pair<std::string_view, std::string_view>{"{id}", id},
                                    {"{command}", "hold"},
                                    {"{material}", "oak"},
                                    {"{operation}", "cut"},
                                    {"{device}", "scanner"},
                                    {"{mark}", "A1"},
                                    {"{number}", "1"},
                                    {"{name}", "anna"},
                                    {"{token}", "phone"}}) {
    const auto at = path.find(hole);
    if (at != std::string::npos) path.replace(at, hole.size(), value);
  }
  return path;
}

// The request line and Host, and whatever else; without the empty line.
inline std::string head_of(const daemon::ApiOperation& operation, const std::string& host,
                           const std::string& more = "") {
  return std::string(operation.method) + " " + path_of(operation) + " HTTP/1.1\r\nHost: " + host + "\r\n" + more;
}
inline std::string whole_request(const daemon::ApiOperation& operation, const std::string& host,
                                 const std::string& more = "") {
  return head_of(operation, host, more + "Content-Length: 0\r\n\r\n");
}
// Half a header that never goes on.
inline std::string slow_header(const daemon::ApiOperation& operation, const std::string& host) {
  return head_of(operation, host, "X-Slow: ");
}
// A body of ten bytes of which one comes.
inline std::string slow_body(const daemon::ApiOperation& operation, const std::string& host) {
  return head_of(operation, host, "Content-Length: 10\r\n\r\n{");
}
// A body that is one byte larger than the operation takes, and none of it.
inline std::string huge_body(const daemon::ApiOperation& operation, const std::string& host) {
  return head_of(operation, host,
                 "Content-Length: " + std::to_string(daemon::max_body(operation.takes) + 1) + "\r\n\r\n");
}

}  // namespace veneer::testing
