#include "daemon/api/console_routes.h"

#include <string>
#include <utility>

#include "console/console_page.h"
#include "daemon/api/access.h"

namespace veneer::daemon {
namespace {

// Nothing from elsewhere runs in the page, and no other page may frame its buttons.
constexpr const char* kPagePolicy =
    "default-src 'self'; img-src 'self' blob: data:; connect-src 'self' ws:; base-uri 'none'; form-action 'self'; "
    "frame-ancestors 'none'";

ApiReply redirect_to_console() {
  ApiReply reply;
  reply.status = 303;
  reply.headers.emplace_back("Location", "/console");
  return reply;
}

ApiReply page_file(const console::PageFile& file) {
  ApiReply reply = ApiReply::bytes(std::string(file.content), std::string(file.content_type));
  reply.headers.emplace_back("Content-Security-Policy", kPagePolicy);
  reply.headers.emplace_back("X-Frame-Options", "DENY");
  reply.headers.emplace_back("Referrer-Policy", "same-origin");
  return reply;
}

// A visit with a token opens a session and drops the token from the address bar.
ApiReply enter(ConsoleLinks& links, const std::string& token) {
  const auto secret = links.redeem(token);
  if (!secret) return ApiReply::error(403, "forbidden", secret.error().message);
  ApiReply reply = redirect_to_console();
  const auto life = std::chrono::duration_cast<std::chrono::seconds>(ConsoleLinks::kSessionLife).count();
  reply.headers.emplace_back("Set-Cookie", std::string(kSessionCookie) + "=" + *secret +
                                               "; Path=/; HttpOnly; SameSite=Strict; Max-Age=" + std::to_string(life));
  return reply;
}

void answer_new_link(const ApiRequest& request, ConsoleLinks& links, int port, const Reply& reply) {
  if (request.caller.transport != TransportKind::kUnix) {
    return reply(
        ApiReply::error(403, "forbidden", "console links are made on the machine itself: `veneerctl console`"));
  }
  if (port == 0) {
    return reply(ApiReply::error(
        Error{ErrorCode::kConflict, "the console is off: set listen = \"127.0.0.1:8765\" under [api] and restart"}));
  }
  const auto token = links.new_link();
  if (!token) return reply(ApiReply::error(token.error()));
  reply(ApiReply::json({{"url", "http://127.0.0.1:" + std::to_string(port) + "/console?token=" + *token}}));
}

}  // namespace

void bind_console_routes(Router& router, ConsoleLinks& links, std::function<int()> tcp_port) {
  router.add("GET", "/", Role::kViewer, [](const ApiRequest&, const Reply& reply) { reply(redirect_to_console()); });
  for (const console::PageFile& file : console::page_files()) {
    const bool index = file.path == "/console";
    router.add("GET", file.path, Role::kViewer, [&links, file, index](const ApiRequest& request, const Reply& reply) {
      const auto token = request.query_value("token");
      reply(index && token ? enter(links, *token) : page_file(file));
    });
  }
  router.bind("getSession", [](const ApiRequest& request, const Reply& reply) {
    reply(ApiReply::json({{"role", to_string(request.caller.role)}, {"who", request.caller.who}}));
  });
  router.bind("newConsoleLink",
              [&links, tcp_port = std::move(tcp_port)](const ApiRequest& request, const Reply& reply) {
                answer_new_link(request, links, tcp_port ? tcp_port() : 0, reply);
              });
}

}  // namespace veneer::daemon
