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
    "default-src 'self'; img-src 'self' blob: data:; connect-src 'self' ws: wss:; base-uri 'none'; form-action 'self'; "
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

}  // namespace

ApiReply stopped_page(ApiReply told) {
  return told.status == 200 ? page_file(console::stopped_page()) : std::move(told);
}

void bind_console_routes(Router& router) {
  router.add("GET", "/", Role::kNobody, [](const ApiRequest&, const Reply& reply) { reply(redirect_to_console()); });
  for (const console::PageFile& file : console::page_files()) {
    router.add("GET", file.path, Role::kNobody,
               [file, etag = etag_of(file)](const ApiRequest& request, const Reply& reply) {
                 auto query = RequestReader::query_of(request);
                 if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
                 if (etag_matches(request.if_none_match, etag)) return reply(ApiReply::not_modified(etag));
                 ApiReply page = page_file(file);
                 page.etag = etag;
                 reply(std::move(page));
               });
  }
}

}  // namespace veneer::daemon
