#include "daemon/api/console_routes.h"

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "base/hash.h"
#include "console/console_page.h"
#include "daemon/api/gzip.h"
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

std::string etag_of(std::string_view content) { return "\"" + sha256_hex(std::as_bytes(std::span(content))) + "\""; }

ApiReply page_file(std::string content, std::string_view content_type) {
  ApiReply reply = ApiReply::bytes(std::move(content), std::string(content_type));
  reply.headers.emplace_back("Content-Security-Policy", kPagePolicy);
  reply.headers.emplace_back("X-Frame-Options", "DENY");
  reply.headers.emplace_back("Referrer-Policy", "same-origin");
  return reply;
}

// A file of the page as it goes over the wire: packed once, for whoever can unpack it.
class KeptPage {
 public:
  explicit KeptPage(const console::PageFile& file)
      : file_(file),
        plain_etag_(etag_of(file.content)),
        packed_(std::make_shared<const std::string>(gzipped(file.content))),
        packed_etag_(etag_of(*packed_)) {}

  ApiReply told(const ApiRequest& request) const {
    auto query = RequestReader::query_of(request);
    if (const Status read = query.end(); !read) return ApiReply::error(read.error());
    const bool packed = accepts_gzip(request.accept_encoding);
    ApiReply reply = told(packed, request.if_none_match);
    reply.headers.emplace_back("Vary", "Accept-Encoding");
    return reply;
  }

 private:
  ApiReply told(bool packed, std::string_view known) const {
    const std::string& etag = packed ? packed_etag_ : plain_etag_;
    if (etag_matches(known, etag)) return ApiReply::not_modified(etag);
    ApiReply reply = page_file(packed ? *packed_ : std::string(file_.content), file_.content_type);
    reply.etag = etag;
    if (packed) reply.headers.emplace_back("Content-Encoding", "gzip");
    return reply;
  }

  console::PageFile file_;
  std::string plain_etag_;
  std::shared_ptr<const std::string> packed_;  // shared by the copies of the handler
  std::string packed_etag_;
};

}  // namespace

ApiReply stopped_page(ApiReply told) {
  if (told.status != 200) return told;
  const console::PageFile& page = console::stopped_page();
  return page_file(std::string(page.content), page.content_type);
}

void bind_console_routes(Router& router) {
  router.add("GET", "/", Role::kNobody, [](const ApiRequest&, const Reply& reply) { reply(redirect_to_console()); });
  for (const console::PageFile& file : console::page_files()) {
    router.add("GET", file.path, Role::kNobody,
               [kept = KeptPage(file)](const ApiRequest& request, const Reply& reply) { reply(kept.told(request)); });
  }
}

}  // namespace veneer::daemon
