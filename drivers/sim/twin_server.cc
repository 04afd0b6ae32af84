#include "drivers/sim/twin_server.h"

#include <fmt/format.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>
#include <string>
#include <utility>

namespace veneer::sim {

namespace asio = boost::asio;
namespace fs = std::filesystem;
using boost::system::error_code;
using nlohmann::json;
using Local = asio::local::stream_protocol;

namespace {
constexpr std::size_t kLongestLine = 1 << 16;
}

class TwinServer::Session : public std::enable_shared_from_this<TwinServer::Session> {
 public:
  Session(Local::socket socket, TwinServer& server) : socket_(std::move(socket)), server_(server) {}

  void read() {
    asio::async_read_until(socket_, asio::dynamic_buffer(buffer_, kLongestLine), '\n',
                           [self = shared_from_this()](error_code failed, std::size_t length) {
                             if (failed == asio::error::not_found) return self->refuse_long_line();
                             if (!failed) self->take_line(length);
                           });
  }

 private:
  void take_line(std::size_t length) {
    const json request = json::parse(buffer_.substr(0, length), nullptr, false);
    buffer_.erase(0, length);
    if (TwinService::is_quick(request)) return reply(server_.service_.handle(request), true);
    asio::post(server_.worker_, [self = shared_from_this(), request] {
      json answer = self->server_.service_.handle(request);
      asio::post(self->server_.io_, [self, answer = std::move(answer)] { self->reply(answer, true); });
    });
  }
  void refuse_long_line() {
    reply(TwinService::refusal({ErrorCode::kInvalidArgument, "a request to the twin is one line of at most 64 KiB"}),
          false);
  }
  void reply(const json& answer, bool go_on) {
    const auto line = std::make_shared<std::string>(answer.dump(-1, ' ', false, json::error_handler_t::replace) + "\n");
    asio::async_write(socket_, asio::buffer(*line),
                      [self = shared_from_this(), line, go_on](error_code failed, std::size_t) {
                        if (!failed && go_on) self->read();
                      });
  }

  Local::socket socket_;
  TwinServer& server_;
  std::string buffer_;
};

TwinServer::TwinServer(asio::io_context& io, TwinService& service, Logger log)
    : io_(io), service_(service), log_(std::move(log)), acceptor_(io) {}

TwinServer::~TwinServer() { stop(); }

Status TwinServer::listen(const fs::path& socket) {
  if (socket.string().size() >= 108) {
    return Error{ErrorCode::kInvalidArgument, fmt::format("the socket path {} is too long", socket.string())};
  }
  const Local::endpoint endpoint(socket.string());
  std::error_code ignored;
  if (fs::exists(socket, ignored)) {
    error_code nobody;
    Local::socket probe(io_);
    probe.connect(endpoint, nobody);
    if (!nobody) {
      return Error{ErrorCode::kConflict, fmt::format("another twin listens on {} already", socket.string())};
    }
    fs::remove(socket, ignored);
  }
  error_code failed;
  acceptor_.open(endpoint.protocol(), failed);
  if (!failed) acceptor_.bind(endpoint, failed);
  if (!failed) acceptor_.listen(asio::socket_base::max_listen_connections, failed);
  if (failed) {
    return Error{ErrorCode::kUnavailable,
                 fmt::format("the twin cannot listen on {}: {}", socket.string(), failed.message())};
  }
  path_ = socket;
  accept();
  return Ok();
}

void TwinServer::accept() {
  acceptor_.async_accept([this](error_code failed, Local::socket socket) {
    if (failed == asio::error::operation_aborted || !acceptor_.is_open()) return;
    if (failed) {
      log_->warn("the twin's socket: {}", failed.message());
    } else {
      std::make_shared<Session>(std::move(socket), *this)->read();
    }
    accept();
  });
}

void TwinServer::stop() {
  error_code ignored;
  acceptor_.close(ignored);
  worker_.stop();
  worker_.join();
  std::error_code also_ignored;
  if (!path_.empty()) fs::remove(path_, also_ignored);
  path_.clear();
}

}  // namespace veneer::sim
