// Which handler answers which request. Bound to the reactor.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "daemon/api/api_message.h"
#include "daemon/api/route_table.h"

namespace veneer::daemon {

class Router {
 public:
  struct Route {
    std::string method;
    std::string pattern;
    std::vector<std::string> segments;  // "{id}" takes any one segment; a literal wins over it
    Role role = Role::kAdmin;
    std::size_t max_body = kSmallBody;
    Handler handler;
  };
  struct Match {
    const Route* route = nullptr;  // nullptr: see `refusal`
    std::map<std::string, std::string> path_params;
    std::map<std::string, std::string> query;
    ApiReply refusal;  // 400, 404 or 405
  };

  // The usual way: an operation of route_table.h by its id, which brings method, path, role and body limit.
  // An unknown id, or one bound twice, is a bug and aborts.
  void bind(std::string_view operation_id, Handler handler);
  // A route outside the table (the console's page).
  void add(std::string_view method, std::string_view pattern, Role role, Handler handler,
           std::size_t max_body = kSmallBody);

  // `target` as on the request line: path, and perhaps "?query". Pointers stay good until the next bind or add.
  Match match(std::string_view method, std::string_view target) const;

  // Ids of operations in the table that nothing answers yet; the daemon starts only when there are none.
  // ("getEvents" is answered by the server itself once it has an EventHub.)
  std::vector<std::string> unbound() const;
  const std::vector<Route>& routes() const { return routes_; }

 private:
  std::vector<Route> routes_;
};

}  // namespace veneer::daemon
