#include "daemon/api/console_routes.h"

#include <span>
#include <string>
#include <utility>

#include "base/hash.h"
#include "console/console_page.h"
#include "daemon/api/request_reader.h"

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

std::string etag_of(const console::PageFile& file) {
  return "\"" + sha256_hex(std::as_bytes(std::span(file.content))) + "\"";
}

ApiReply page_file(const console::PageFile& file) {
  ApiReply reply = ApiReply::bytes(std::string(file.content), std::string(file.content_type));
  reply.headers.emplace_back("Content-Security-Policy", kPagePolicy);
  reply.headers.emplace_back("X-Frame-Options", "DENY");
  reply.headers.emplace_back("Referrer-Policy", "same-origin");
  return reply;
}

// The token of a link becomes a session. Its secret stays in the tab that asked (docs/SAFETY.md).
void open_session(const ApiRequest& request, ConsoleLinks& links, const Reply& reply) {
  auto body = RequestReader::body_of(request);
  const auto token = body.text("token");
  body.require("token");
  if (const Status read = body.end(); !read) return reply(ApiReply::error(read.error()));
  const auto session = links.redeem(*token);
  if (!session) return reply(ApiReply::error(403, "forbidden", session.error().message));
  reply(ApiReply::json({{"session", session->secret}, {"role", to_string(Role::kOperator)}, {"who", session->who}}));
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
  const auto token = links.new_link(request.caller.who);
  if (!token) return reply(ApiReply::error(token.error()));
  reply(ApiReply::json({{"url", "http://127.0.0.1:" + std::to_string(port) + "/console#token=" + *token}}));
}

}  // namespace

ApiReply stopped_page(ApiReply told) {
  return told.status == 200 ? page_file(console::stopped_page()) : std::move(told);
}

void bind_console_routes(Router& router, ConsoleLinks& links, std::function<int()> tcp_port) {
  router.add("GET", "/", Role::kViewer, [](const ApiRequest&, const Reply& reply) { reply(redirect_to_console()); });
  for (const console::PageFile& file : console::page_files()) {
    router.add("GET", file.path, Role::kViewer,
               [file, etag = etag_of(file)](const ApiRequest& request, const Reply& reply) {
                 auto query = RequestReader::query_of(request);
                 if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
                 if (etag_matches(request.if_none_match, etag)) return reply(ApiReply::not_modified(etag));
                 ApiReply page = page_file(file);
                 page.etag = etag;
                 reply(std::move(page));
               });
  }
  router.bind("getSession", [](const ApiRequest& request, const Reply& reply) {
    reply(ApiReply::json({{"role", to_string(request.caller.role)}, {"who", request.caller.who}}));
  });
  router.bind("openSession",
              [&links](const ApiRequest& request, const Reply& reply) { open_session(request, links, reply); });
  router.bind("newConsoleLink",
              [&links, tcp_port = std::move(tcp_port)](const ApiRequest& request, const Reply& reply) {
                answer_new_link(request, links, tcp_port ? tcp_port() : 0, reply);
              });
}

}  // namespace veneer::daemon
