// Which handler answers which request. Bound to the reactor.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/api/api_message.h"
#include "daemon/api/idempotency.h"
#include "daemon/api/route_table.h"

namespace veneer::daemon {

class Router {
 public:
  struct Route {
    std::string method;
    std::string pattern;
    std::vector<std::string> segments;  // "{id}" takes any one segment; a literal wins over it
    Role role = Role::kAdmin;
    std::size_t max_body = kNoBody;
    Handler handler;
    bool changes = true;  // false: it only asks, whatever its method
  };
  struct Match {
    const Route* route = nullptr;  // nullptr: see `refusal`
    std::map<std::string, std::string> path_params;
    std::map<std::string, std::string> query;
    std::optional<std::string> repeated_query;
    ApiReply refusal;  // 400, 404 or 405
  };

  // The usual way: an operation of route_table.h by its id, which brings method, path, role and body limit. A query or
  // body that the operation does not take is refused before the handler sees it.
  // An unknown id, or one bound twice, is a bug and aborts.
  void bind(std::string_view operation_id, Handler handler);
  // Told of every operation that changes something before its handler runs, and again when it was refused or began a
  // task; of one that needs no login only once it was done. What comes of it is told on the thread that replies, which
  // may be any.
  struct Change {
    const Caller& caller;
    std::string_view operation;  // its id
    std::string detail;          // the request in one line, or why it was refused
    bool refused = false;
    std::optional<std::int64_t> task = {};  // told at last, of one that began long work
    bool failed = false;                    // nobody refused it, and the cell could not do it; `detail` says why
  };
  void on_change(std::function<void(const Change&)> note) { changes_->note = std::move(note); }
  // Asked before anything of a change is noted or done; what it says is the reply. Must not wait.
  void gate_changes(std::function<Status(std::string_view operation, const ApiRequest&)> may_begin) {
    changes_->may_begin = std::move(may_begin);
  }
  // Requests with an Idempotency-Key are done once. `keys` outlives the router.
  void remember_in(IdempotencyKeys& keys) { changes_->keys = &keys; }
  // A route outside the table (the console's page).
  void add(std::string_view method, std::string_view pattern, Role role, Handler handler,
           std::size_t max_body = kNoBody);

  // `target` as on the request line: path, and perhaps "?query". Pointers stay good until the next bind or add.
  Match match(std::string_view method, std::string_view target) const;

  // Ids of operations in the table that nothing answers yet; the daemon starts only when there are none.
  // ("getEvents" is answered by the server itself once it has an EventHub.)
  std::vector<std::string> unbound() const;
  const std::vector<Route>& routes() const { return routes_; }

 private:
  struct Changes {
    std::function<void(const Change&)> note;
    std::function<Status(std::string_view, const ApiRequest&)> may_begin;
    IdempotencyKeys* keys = nullptr;
  };
  static Handler noted(const ApiOperation& operation, std::shared_ptr<const Changes> changes, Handler handler);

  std::vector<Route> routes_;
  std::shared_ptr<Changes> changes_ = std::make_shared<Changes>();  // handlers hold it too
};

}  // namespace veneer::daemon
