// The operator's page: GET /, /console and the files it names.
#pragma once

#include "daemon/api/router.h"

namespace veneer::daemon {

void bind_console_routes(Router& router);

// What a browser shows that pressed STOP without scripts, when `told` says that it was taken; else `told` itself.
ApiReply stopped_page(ApiReply told);

}  // namespace veneer::daemon
