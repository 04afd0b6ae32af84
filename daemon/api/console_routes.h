// The operator's page and how a browser becomes an operator: GET /, /console and the files it names,
// GET and POST /api/v1/session, POST /api/v1/console-links.
#pragma once

#include <filesystem>
#include <functional>

#include "daemon/api/console_links.h"
#include "daemon/api/router.h"

namespace veneer::daemon {

// `links` outlives the router. `tcp_port` gives the port the console is reached at, 0 when TCP is off.
void bind_console_routes(Router& router, ConsoleLinks& links, std::function<int()> tcp_port);

// What a browser shows that pressed STOP without scripts, when `told` says that it was taken; else `told` itself.
ApiReply stopped_page(ApiReply told);

}  // namespace veneer::daemon
