#include "daemon/api/http_server.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/steady_timer.hpp>
#include <limits>
#include <map>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "daemon/api/access.h"
#include "daemon/api/http_connection.h"
#include "daemon/api/listen.h"
#include "daemon/api/network.h"

namespace veneer::daemon {

namespace asio = boost::asio;
using asio::ip::tcp;
using asio::local::stream_protocol;
using boost::system::error_code;

class HttpServer::Impl : public std::enable_shared_from_this<Impl> {
 public:
  Impl(asio::io_context& reactor, std::shared_ptr<ServerShared> shared)
      : shared_(std::move(shared)),
        tcp_(reactor),
        unix_(reactor),
        tls_(reactor),
        retry_tcp_(reactor),
        retry_unix_(reactor),
        retry_tls_(reactor),
        turns_(reactor) {}

  Status listen(asio::io_context& reactor) {
    const HttpServerOptions& options = shared_->options;
    if (!options.listen_tls.empty()) {
      auto identity = TlsIdentity::load(options.tls_certificate, options.tls_key);
      if (!identity) return identity.error();
      auto acceptor = listen_anywhere(reactor, options.listen_tls);
      if (!acceptor) return acceptor.error();
      shared_->tls = std::move(*identity);
      tls_ = std::move(*acceptor);
      error_code fault;
      shared_->tls_port = tls_.local_endpoint(fault).port();
    }
    if (!options.listen.empty()) {
      auto acceptor = listen_on_loopback(reactor, options.listen);
      if (!acceptor) return acceptor.error();
      tcp_ = std::move(*acceptor);
      error_code fault;
      shared_->tcp_port = tcp_.local_endpoint(fault).port();
    }
    if (!options.unix_path.empty()) {
      auto acceptor = listen_on_socket(reactor, options.unix_path);
      if (!acceptor) return acceptor.error();
      unix_ = std::move(*acceptor);
    }
    return Ok();
  }

  void start() {
    shared_->on_gone = [weak = weak_from_this()](const HttpConnection& connection) {
      if (const auto self = weak.lock()) self->forget(connection);
    };
    shared_->on_waiting = [weak = weak_from_this()] {
      if (const auto self = weak.lock()) self->give_turns();
    };
    if (tcp_.is_open()) accept_tcp();
    if (tls_.is_open()) accept_tls();
    if (unix_.is_open()) accept_unix();
  }

  void close() {
    error_code ignored;
    retry_tcp_.cancel();
    retry_unix_.cancel();
    retry_tls_.cancel();
    turns_.cancel();
    tcp_.close(ignored);
    tls_.close(ignored);
    if (unix_.is_open()) {
      unix_.close(ignored);
      std::error_code no_file;
      std::filesystem::remove(shared_->options.unix_path, no_file);
    }
    for (auto* door : doors()) {
      const auto everyone = std::exchange(*door, {});
      for (const auto& connection : everyone) connection->drop();
    }
  }

  int tcp_port() const { return shared_->tcp_port; }
  int tls_port() const { return shared_->tls_port; }
  std::string console_url() const {
    if (shared_->tcp_port != 0) return "http://127.0.0.1:" + std::to_string(shared_->tcp_port);
    if (shared_->tls_port == 0) return {};
    return "https://" + shared_->tls->name() + ":" + std::to_string(shared_->tls_port);
  }
  std::size_t connections() const {
    return tcp_connections_.size() + tls_connections_.size() + unix_connections_.size();
  }
  std::size_t uploads() const { return shared_->shares.uploads(); }

 private:
  using Connections = std::vector<std::shared_ptr<HttpConnection>>;

  void accept_tcp() {
    tcp_.async_accept([self = shared_from_this()](error_code fault, tcp::socket socket) {
      if (!self->tcp_.is_open()) return;
      if (fault) return self->retry(self->retry_tcp_, &Impl::accept_tcp);
      error_code ignored;
      socket.set_option(tcp::no_delay(true), ignored);
      HttpConnection::Visitor visitor{TransportKind::kTcp, address_of(socket)};
      self->admit(self->tcp_connections_, ApiSocket(std::move(socket)), std::move(visitor));
      self->accept_tcp();
    });
  }

  // Everybody is heard, so that no crowd keeps anybody out; who comes too often goes at once.
  void accept_tls() {
    tls_.async_accept([self = shared_from_this()](error_code fault, tcp::socket socket) {
      if (!self->tls_.is_open()) return;
      if (fault) return self->retry(self->retry_tls_, &Impl::accept_tls);
      HttpConnection::Visitor visitor{TransportKind::kTls, address_of(socket)};
      if (self->shared_->gate.admits(network_of(visitor.address), std::chrono::steady_clock::now())) {
        error_code ignored;
        socket.set_option(tcp::no_delay(true), ignored);
        self->admit(self->tls_connections_, ApiSocket(std::move(socket)), std::move(visitor));
      }
      self->accept_tls();
    });
  }

  void give_turns() {
    const auto again = shared_->gate.serve(std::chrono::steady_clock::now());
    if (!again) return;
    turns_.expires_at(*again);
    turns_.async_wait([weak = weak_from_this()](error_code fault) {
      const auto self = weak.lock();
      if (self && !fault) self->give_turns();
    });
  }

  static std::string address_of(const tcp::socket& socket) {
    error_code fault;
    const auto other = socket.remote_endpoint(fault);
    return fault ? "unknown" : other.address().to_string();
  }

  void accept_unix() {
    unix_.async_accept([self = shared_from_this()](error_code fault, stream_protocol::socket socket) {
      if (!self->unix_.is_open()) return;
      if (fault) return self->retry(self->retry_unix_, &Impl::accept_unix);
      const HttpServerOptions& options = self->shared_->options;
      const Caller peer = caller_of_peer(peer_credentials(socket.native_handle()), geteuid(), options.operator_gid,
                                         options.maintainer_gid);
      self->admit(self->unix_connections_, ApiSocket(std::move(socket)), {TransportKind::kUnix, "", peer});
      self->accept_unix();
    });
  }

  // Out of descriptors, most likely: they come back when connections end.
  void retry(asio::steady_timer& timer, void (Impl::*accept)()) {
    timer.expires_after(std::chrono::milliseconds(100));
    timer.async_wait([self = shared_from_this(), accept](error_code fault) {
      if (!fault) (self.get()->*accept)();
    });
  }

  void admit(Connections& door, ApiSocket socket, HttpConnection::Visitor visitor) {
    if (door.size() >= shared_->options.max_connections) make_room(door);
    const auto connection = std::make_shared<HttpConnection>(std::move(socket), shared_, std::move(visitor));
    door.push_back(connection);
    connection->start();
  }

  // The identity that holds most connections gives one up, the one that has been quiet for longest: a crowd pushes out
  // itself, and nobody who comes to press STOP. Over TCP whoever has not sent a header yet counts as one of the crowd,
  // but as the least quiet of it. What an operator waits for goes last of the operator's own.
  static void make_room(Connections& door) {
    std::map<std::string_view, std::size_t> held;
    for (const auto& connection : door) ++held[connection->identity()];
    const auto rank = [&held](const std::shared_ptr<HttpConnection>& c) {
      const bool awaited = c->trusted() && c->doing() == HttpConnection::Doing::kHandling;
      return std::tuple(std::numeric_limits<std::size_t>::max() - held[c->identity()], c->trusted(), awaited,
                        c->last_activity());
    };
    const auto quietest = std::ranges::min_element(door, {}, rank);
    (*quietest)->drop();
    door.erase(quietest);
  }

  void forget(const HttpConnection& connection) {
    for (auto* door : doors()) {
      std::erase_if(*door, [&](const auto& held) { return held.get() == &connection; });
    }
  }

  std::array<Connections*, 3> doors() { return {&tcp_connections_, &tls_connections_, &unix_connections_}; }

  std::shared_ptr<ServerShared> shared_;
  tcp::acceptor tcp_;
  stream_protocol::acceptor unix_;
  tcp::acceptor tls_;
  asio::steady_timer retry_tcp_;
  asio::steady_timer retry_unix_;
  asio::steady_timer retry_tls_;
  asio::steady_timer turns_;  // of handshakes
  Connections tcp_connections_;
  Connections tls_connections_;
  Connections unix_connections_;
};

HttpServer::HttpServer(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}

HttpServer::~HttpServer() { close(); }

Result<std::unique_ptr<HttpServer>> HttpServer::open(asio::io_context& reactor, HttpServerOptions options,
                                                     const Router& router, EventHub& hub, const Accounts& accounts,
                                                     std::function<ApiReply(const WhoAsks&)> on_stop, Logger log) {
  if (const auto unbound = router.unbound(); !unbound.empty())
    return Error{ErrorCode::kInternal,
                 "nothing answers the API's operation " + unbound.front() + ": this veneerd was built wrongly"};
  const ClientShareLimits limits = options.shares;
  const std::size_t handshakes = options.max_handshakes;
  auto shared = std::make_shared<ServerShared>(ServerShared{std::move(options),
                                                            router,
                                                            hub,
                                                            accounts,
                                                            std::move(on_stop),
                                                            std::move(log),
                                                            nullptr,
                                                            0,
                                                            0,
                                                            ClientShares(limits),
                                                            TlsGate(handshakes),
                                                            0,
                                                            Turns(),
                                                            false,
                                                            {},
                                                            {}});
  auto impl = std::make_shared<Impl>(reactor, std::move(shared));
  if (Status listening = impl->listen(reactor); !listening) {
    impl->close();
    return listening.error();
  }
  impl->start();
  return std::unique_ptr<HttpServer>(new HttpServer(std::move(impl)));
}

int HttpServer::tcp_port() const { return impl_->tcp_port(); }
int HttpServer::tls_port() const { return impl_->tls_port(); }
std::string HttpServer::console_url() const { return impl_->console_url(); }
std::size_t HttpServer::connections() const { return impl_->connections(); }
std::size_t HttpServer::uploads() const { return impl_->uploads(); }
void HttpServer::close() { impl_->close(); }

}  // namespace veneer::daemon
