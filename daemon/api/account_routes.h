// Signing in and out, and who may: /api/v1/session, /api/v1/console-links, /api/v1/users and /api/v1/tokens.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "base/log.h"
#include "daemon/api/accounts.h"
#include "daemon/api/console_links.h"
#include "daemon/api/passwords.h"
#include "daemon/api/router.h"
#include "daemon/api/sign_in_throttle.h"

namespace veneer::daemon {

// All outlive the router.
struct AccountServices {
  Accounts& accounts;
  Passwords& passwords;
  SignInThrottle& throttle;
  ConsoleLinks& links;
  std::function<std::string()> console_url;  // "http://127.0.0.1:8765"; "" when the API is on no port
  Logger log;
};

// `done`, or the reason why not; it says whether the change holds.
ApiReply reply_of(const Outcome& outcome, const nlohmann::json& done);

void bind_session_routes(Router& router, const AccountServices& services);
void bind_account_routes(Router& router, const AccountServices& services);

}  // namespace veneer::daemon
