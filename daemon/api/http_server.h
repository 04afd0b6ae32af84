// The API's doors: a Unix socket for this machine's users, whose role follows their peer credentials; loopback TCP for
// browsers on this machine, where everybody is a viewer who has not signed in; and TLS for other machines, where nobody
// may more than STOP and sign in before that.
//
// Bound to the reactor: handlers run on it, and nothing here blocks. POST /api/v1/stop runs as soon as its header has
// arrived: before its body, before other requests' replies, at any number of connections.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "base/log.h"
#include "base/result.h"
#include "daemon/api/accounts.h"
#include "daemon/api/client_shares.h"
#include "daemon/api/event_hub.h"
#include "daemon/api/router.h"

namespace veneer::daemon {

struct HttpServerOptions {
  std::filesystem::path unix_path;  // empty: no Unix socket
  std::string listen;               // "127.0.0.1:8765", "[::1]:8765", "localhost:8765"; port 0 = any; empty: no TCP
  // Any address, with the certificate for it and its key; empty: no TLS.
  std::string listen_tls;
  std::filesystem::path tls_certificate, tls_key;
  // Over the socket these groups' members are operators, or maintainers.
  std::optional<unsigned> operator_gid, maintainer_gid;
  std::size_t max_header_bytes = 16 * 1024;
  // Per door; beyond that one of the identity that holds most of them makes room. Whoever is slow costs less while it
  // is left waiting than when it is shown the door and comes again at once.
  std::size_t max_connections = 256;
  std::size_t max_handshakes = 32;  // of TLS, begun within a second; the others wait for their turn (tls_gate.h)
  ClientShareLimits shares;
  std::chrono::milliseconds header_timeout{10'000};  // from the connection, or the end of the last reply
  std::chrono::milliseconds body_timeout{60'000};
  std::chrono::milliseconds reply_timeout{120'000};  // a handler that takes longer is answered for with 504
  std::chrono::milliseconds write_timeout{30'000};
  // Told, in one sentence, when the handler of a change threw: what it was about may be half done.
  std::function<void(const std::string&)> on_broken_change;
};

class HttpServer {
 public:
  // Listens at once. kInvalidArgument when `listen` is not a loopback address or TLS lacks what it needs, kConflict
  // when somebody else answers at the socket or port, kStorage when the socket cannot be made, kInternal when an
  // operation of the API is bound to nothing. `router`, `hub`, `accounts` outlive the server. `on_stop` is STOP: it
  // must not wait for anything, and stops before it asks who wants it. Its reply is sent at once.
  static Result<std::unique_ptr<HttpServer>> open(boost::asio::io_context& reactor, HttpServerOptions options,
                                                  const Router& router, EventHub& hub, const Accounts& accounts,
                                                  std::function<ApiReply(const WhoAsks&)> on_stop, Logger log);
  ~HttpServer();  // close(), and the socket file is removed
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  int tcp_port() const;  // 0 without TCP
  int tls_port() const;  // 0 without TLS
  // Where a browser finds the console, on this machine if there is a way: "http://127.0.0.1:8765"; "" without any.
  std::string console_url() const;
  std::size_t connections() const;
  std::size_t uploads() const;  // large bodies on their way, or in their handlers
  // Stops listening and drops every connection; running handlers' replies go nowhere.
  void close();

 private:
  class Impl;
  explicit HttpServer(std::shared_ptr<Impl> impl);
  std::shared_ptr<Impl> impl_;
};

}  // namespace veneer::daemon
